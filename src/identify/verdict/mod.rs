//! Has this stage complex non-minimum phase zeros? "detected", "excluded" or "undecided", and why.
//!
//! Three witnesses are heard, and none of them may contradict:
//!
//! 1. the zeros of the fit, each with its probability of lying in the right half plane;
//! 2. the signs of the residues: two close modes of opposite signs beside a remainder are necessary for CNMP zeros between
//!    them (sections 3.2.2 and 3.2.4);
//! 3. the phase, which falls by a turn more than the magnitude asks for at each CNMP pair, whatever the modes ([`phase_drop`]).
//!
//! A verdict needs data that carry it: as many modes seen as the model has there, and errors that noise explains. Beyond
//! the band of the verdict nothing is said. Every comparison asks what must hold, not what must not, so that a figure that
//! is not a number (a covariance that broke down, a bin of nothing) ends as undecided.

mod phase;
mod zeros;

pub use phase::{PhaseDrop, phase_drop};
pub use zeros::{UncertainZero, zeros};

use serde::{Deserialize, Serialize};

use crate::identify::FrfDatum;
use crate::identify::modal::{FittedMode, MeasurementChain, ModalFit, SIGMAS_95};
use crate::model::plant::PlantError;
use crate::model::zeros::ZeroKind;

/// A zero is on a side if it is on the other with a probability below this.
const SURE: f64 = 1e-3;
/// No fit of a bench is truer than this ratio: a zero closer to the imaginary axis is on neither side.
const TRUEST: f64 = 1e-4;
/// A fit that leaves so many times the power of the noise does not describe the stage.
pub(crate) const MISFIT: f64 = 4.0;
/// The phase must be so close to a number of half turns, in degrees.
const CLEAR_DEG: f64 = 60.0;
/// A response stands out of the noise with so many times its power.
const CLEAR_POWER: f64 = 20.0;
/// A residue of the other sign with a probability above this is of no known sign.
const UNKNOWN_SIGN: f64 = 1e-3;

/// What can be said of CNMP zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cnmp {
    /// There are.
    Detected,
    /// There are none.
    Excluded,
    /// The data do not tell.
    Undecided,
}

impl Cnmp {
    /// `detected`, `excluded` or `undecided`.
    pub fn name(self) -> &'static str {
        match self {
            Cnmp::Detected => "detected",
            Cnmp::Excluded => "excluded",
            Cnmp::Undecided => "undecided",
        }
    }
}

/// A verdict, and its reasons in words.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// What is said.
    pub cnmp: Cnmp,
    /// Why; where undecided, what to change.
    pub why: String,
    /// The zeros in the band of the verdict.
    pub zeros: Vec<UncertainZero>,
    /// The phase over the modes of the band, where there are two or more.
    pub phase: Option<PhaseDrop>,
}

impl Verdict {
    /// Nothing can be said, and why.
    pub fn undecided(why: String) -> Verdict {
        Verdict {
            cnmp: Cnmp::Undecided,
            why,
            zeros: Vec::new(),
            phase: None,
        }
    }

    /// The same with something told beside its reasons.
    pub fn with(self, caution: Option<String>) -> Verdict {
        let why = std::iter::once(self.why)
            .chain(caution)
            .collect::<Vec<_>>()
            .join("; ");
        Verdict { why, ..self }
    }
}

/// What the verdict is about.
#[derive(Clone, Copy, Debug)]
pub struct VerdictInput<'a> {
    /// The modes that were fitted.
    pub fit: &'a ModalFit,
    /// Through what the mechanics were seen.
    pub view: &'a MeasurementChain<'a>,
    /// What they were fitted to, frequencies rising.
    pub frf_data: &'a [FrfDatum],
    /// Zeros and modes up to here count, in rad/s.
    pub up_to_rad_s: f64,
    /// Modes that the model has there, of those that show between its actuator and its probe.
    pub expected_modes: Option<usize>,
}

/// Weighs the witnesses. Fails where the zeros of the fit cannot be computed.
pub fn verdict(case: &VerdictInput<'_>) -> Result<Verdict, PlantError> {
    let within = |w: f64| w <= case.up_to_rad_s && w >= case.frf_data.first().map_or(0.0, omega);
    let zeros: Vec<UncertainZero> = zeros(case.fit)?
        .into_iter()
        .filter(|zero| within(zero.s.norm()))
        .collect();
    let modes: Vec<FittedMode> = case
        .fit
        .modes()
        .into_iter()
        .filter(|mode| within(mode.omega_rad_s.value))
        .collect();
    let phase = fall(case, &modes);
    let (cnmp, why) = match doubt(case, &modes).or_else(|| unclear(&zeros)) {
        Some(doubt) => (Cnmp::Undecided, doubt),
        None => weigh(&zeros, &modes, phase),
    };
    Ok(Verdict {
        cnmp,
        why,
        zeros,
        phase,
    })
}

/// Why the data carry no verdict.
fn doubt(case: &VerdictInput<'_>, modes: &[FittedMode]) -> Option<String> {
    let misfit = case.fit.chi2_per_freedom;
    let described = misfit <= MISFIT;
    if !described {
        return Some(format!(
            "the modes leave {misfit:.1} times the power of the noise: the stage is not the sum of modes that was fitted; \
             excite less, so that its geometry stays linear, or look at the plot where they differ"
        ));
    }
    let expected = case.expected_modes.unwrap_or(0);
    if modes.len() < expected {
        return Some(format!(
            "{} of the {expected} modes that the model has up to {:.0} Hz are seen; excite more there, or for longer",
            modes.len(),
            case.up_to_rad_s / (2.0 * std::f64::consts::PI)
        ));
    }
    let signed = |mode: &FittedMode| mode.sign_error_probability() <= UNKNOWN_SIGN;
    let unsigned = modes.iter().find(|mode| !signed(mode))?;
    Some(format!(
        "the sign of the residue at {:.2} Hz is not known; excite more there, or for longer",
        unsigned.frequency_hz().value
    ))
}

/// A zero of which nobody can say on which side of the imaginary axis it is.
fn unclear(zeros: &[UncertainZero]) -> Option<String> {
    let near = |zero: &&UncertainZero| zero.s.re.abs() < TRUEST * zero.s.norm();
    let sure =
        |zero: &&UncertainZero| zero.rhp_probability <= SURE || zero.rhp_probability >= 1.0 - SURE;
    let zero = zeros.iter().find(|zero| near(zero) || !sure(zero))?;
    Some(format!(
        "the zero {:.3} +- {:.3} at {:.2} Hz may lie on either side of the imaginary axis (right: {:.1} %); excite more there, \
         or for longer",
        zero.s.re,
        SIGMAS_95 * zero.covariance[0][0].sqrt(),
        zero.s.norm() / (2.0 * std::f64::consts::PI),
        100.0 * zero.rhp_probability
    ))
}

/// The verdict of zeros that are all on a known side: the other two witnesses must agree.
fn weigh(
    zeros: &[UncertainZero],
    modes: &[FittedMode],
    phase: Option<PhaseDrop>,
) -> (Cnmp, String) {
    let right = |zero: &&UncertainZero| zero.s.re > 0.0;
    let pairs = zeros
        .iter()
        .filter(right)
        .filter(|zero| zero.kind == ZeroKind::Cnmp)
        .count();
    let real = zeros.iter().filter(right).count() - pairs;
    let Some(phase) = phase else {
        return (
            Cnmp::Undecided,
            "fewer than two modes are seen: there is no valley to look at".into(),
        );
    };
    let turns = (2 * pairs + real) as i32;
    let agree = phase.off_deg <= CLEAR_DEG && phase.half_turns == turns;
    if !agree {
        return (Cnmp::Undecided, contradiction(turns, phase));
    }
    if pairs == 0 {
        let words = "all zeros of the fit lie left of the imaginary axis, and the phase falls by no more than the magnitude asks for";
        return (Cnmp::Excluded, words.into());
    }
    if !alternate(modes) {
        let words = "the fit has CNMP zeros, but no two neighbouring modes of opposite residues, without which there are none; \
                     look at the plot, and excite more";
        return (Cnmp::Undecided, words.into());
    }
    (
        Cnmp::Detected,
        format!(
            "{pairs} pair{} of CNMP zeros, residues of opposite signs ({}), and the phase falls by {:.0} degrees more than the \
             magnitude asks for",
            if pairs == 1 { "" } else { "s" },
            signs(modes),
            -phase.excess_phase_deg
        ),
    )
}

fn contradiction(turns: i32, phase: PhaseDrop) -> String {
    format!(
        "by the fit's zeros the phase falls by {} degrees beyond what the magnitude asks for, as measured by {:.0}; excite more \
         in the valley, or for longer",
        180 * turns,
        -phase.excess_phase_deg
    )
}

fn alternate(modes: &[FittedMode]) -> bool {
    modes
        .windows(2)
        .any(|pair| pair[0].residue_per_kg.value * pair[1].residue_per_kg.value < 0.0)
}

/// Signs of the residues, slowest mode first.
fn signs(modes: &[FittedMode]) -> String {
    modes.iter().map(FittedMode::sign).collect()
}

/// The phase from well below the first of the band's modes to its end.
///
/// Beyond the end the magnitude is believed for as long as it stands out of the noise.
fn fall(case: &VerdictInput<'_>, modes: &[FittedMode]) -> Option<PhaseDrop> {
    let [first, .., _] = modes else { return None };
    let low = 0.5 * first.omega_rad_s.value;
    let from = case.frf_data.iter().position(|block| omega(block) >= low)?;
    let to = case
        .frf_data
        .iter()
        .rposition(|block| omega(block) <= case.up_to_rad_s)?;
    let clear = |block: &&FrfDatum| block.response.norm_sqr() > CLEAR_POWER * block.variance;
    let reach = to + 1 + case.frf_data[to + 1..].iter().take_while(clear).count();
    let omega_rad_s: Vec<f64> = case.frf_data[..reach].iter().map(omega).collect();
    let mechanics = case
        .view
        .mechanics(&case.frf_data[..reach], case.fit.parameters.delay_s);
    (from < to).then(|| phase_drop(&omega_rad_s, &mechanics, from, to))
}

fn omega(block: &FrfDatum) -> f64 {
    2.0 * std::f64::consts::PI * block.frequency_hz
}

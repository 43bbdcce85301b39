//! Verdict on complex non-minimum phase (CNMP) zeros of a stage: "detected", "excluded" or "undecided", with the
//! reasons.
//!
//! Three criteria must agree:
//!
//! 1. the zeros of the fit, each with its probability of lying in the right half plane;
//! 2. the signs of the residues: two close modes of opposite signs, and a remainder, are necessary for CNMP zeros between
//!    them (sections 3.2.2 and 3.2.4);
//! 3. the phase drop beyond Bode's relation, independent of the modes: each CNMP pair adds one turn of lag ([`phase_drop()`]).
//!
//! A verdict needs sufficient data: as many modes as the model has, and residuals that are noise. It covers the band up to a
//! given frequency. All comparisons state what must hold, so that a number that is not finite (a singular covariance, a bin
//! without response) makes the verdict undecided.

mod phase_drop;
mod zeros;

pub use phase_drop::{PhaseDrop, phase_drop};
pub use zeros::{UncertainZero, zeros};

use serde::{Deserialize, Serialize};

use crate::identify::FrfDatum;
use crate::identify::modal::{FittedMode, MeasurementChain, ModalFit};
use crate::model::plant::PlantError;
use crate::model::zeros::ZeroKind;

/// A zero is certain to lie on one side if the probability of the other side is below this.
const WRONG_SIDE_PROBABILITY: f64 = 1e-3;
/// Relative accuracy of a fit: a zero closer to the imaginary axis is on neither side.
const FIT_ACCURACY: f64 = 1e-4;
/// With a larger reduced chi-square the fit does not describe the stage.
pub(crate) const MAX_CHI2_PER_FREEDOM: f64 = 4.0;
/// Largest deviation of the phase drop from a number of half turns, in degrees.
const MAX_PHASE_DEVIATION_DEG: f64 = 60.0;
/// A response is significant above this multiple of the power of its noise.
const SIGNIFICANT_POWER: f64 = 20.0;
/// A residue with a larger probability of the opposite sign has no certain sign.
const WRONG_SIGN_PROBABILITY: f64 = 1e-3;

const NO_PHASE_DROP: &str = "fewer than two modes are found, and the phase check needs two modes; increase the amplitude or the duration of the excitation";
const NO_CNMP: &str = "all zeros of the fit lie left of the imaginary axis, and the phase lag is that of a minimum-phase system of this magnitude";
const NO_OPPOSITE_NEIGHBOURS: &str = "the fit has CNMP zeros, but no two neighbouring modes with residues of opposite signs, which are necessary for them; compare response and fit in the Bode plot, and increase the amplitude or the duration of the excitation";

/// Whether there are CNMP zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Cnmp {
    /// There are CNMP zeros.
    Detected,
    /// There are none.
    Excluded,
    /// The data are insufficient.
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

/// A verdict with its reasons.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// The verdict.
    pub cnmp: Cnmp,
    /// The reasons; if undecided, what to change.
    pub why: String,
    /// The zeros in the band of the verdict.
    pub zeros: Vec<UncertainZero>,
    /// The phase drop over the modes of the band, if there are two or more.
    pub phase_drop: Option<PhaseDrop>,
}

impl Verdict {
    /// An undecided verdict without any zeros.
    pub fn undecided(why: String) -> Verdict {
        Verdict {
            cnmp: Cnmp::Undecided,
            why,
            zeros: Vec::new(),
            phase_drop: None,
        }
    }

    /// The verdict with a caution added to its reasons.
    pub fn with(mut self, caution: Option<String>) -> Verdict {
        if let Some(caution) = caution {
            self.why = format!("{}; {caution}", self.why);
        }
        self
    }
}

/// Input of a verdict.
#[derive(Clone, Copy, Debug)]
pub struct VerdictInput<'a> {
    /// The fitted modes.
    pub fit: &'a ModalFit,
    /// The chain through which the mechanics were observed.
    pub chain: &'a MeasurementChain,
    /// The fitted data, frequencies rising.
    pub frf_data: &'a [FrfDatum],
    /// The verdict covers zeros and modes up to here, in rad/s.
    pub up_to_rad_s: f64,
    /// Number of modes of the model in that band with a residue between its actuator and its probe.
    pub expected_modes: Option<usize>,
}

impl VerdictInput<'_> {
    /// Whether the verdict covers an angular frequency: from the first datum to the upper limit.
    fn covers(&self, omega_rad_s: f64) -> bool {
        let low_rad_s = self.frf_data.first().map_or(0.0, FrfDatum::omega_rad_s);
        omega_rad_s <= self.up_to_rad_s && omega_rad_s >= low_rad_s
    }

    /// Indices of the first and the last datum between `low_rad_s` and the upper limit.
    fn indices_above(&self, low_rad_s: f64) -> Option<(usize, usize)> {
        let mut omega_rad_s = self.frf_data.iter().map(FrfDatum::omega_rad_s);
        let first = omega_rad_s.clone().position(|omega| omega >= low_rad_s)?;
        let last = omega_rad_s.rposition(|omega| omega <= self.up_to_rad_s)?;
        Some((first, last))
    }
}

/// Evaluates the criteria.
///
/// # Errors
/// When the zeros of the fit cannot be computed.
pub fn verdict(input: &VerdictInput<'_>) -> Result<Verdict, PlantError> {
    let mut zeros = zeros(input.fit)?;
    zeros.retain(|zero| input.covers(zero.s.norm()));
    let mut modes = input.fit.modes();
    modes.retain(|mode| input.covers(mode.omega_rad_s.value));
    let phase_drop = phase_drop_over(input, &modes);
    let insufficient = insufficient_data(input, &modes).or_else(|| uncertain_side(&zeros));
    let (cnmp, why) = match insufficient {
        Some(why) => (Cnmp::Undecided, why),
        None => evaluate(&zeros, &modes, phase_drop),
    };
    Ok(Verdict {
        cnmp,
        why,
        zeros,
        phase_drop,
    })
}

/// Why the data are insufficient for a verdict.
fn insufficient_data(input: &VerdictInput<'_>, modes: &[FittedMode]) -> Option<String> {
    poor_fit(input.fit.chi2_per_freedom)
        .or_else(|| missing_modes(input, modes.len()))
        .or_else(|| uncertain_sign(modes))
}

fn poor_fit(chi2_per_freedom: f64) -> Option<String> {
    let good = chi2_per_freedom <= MAX_CHI2_PER_FREEDOM;
    (!good).then(|| {
        format!(
            "reduced chi-square {chi2_per_freedom:.1}, above {MAX_CHI2_PER_FREEDOM}: the response is not the fitted sum of modes; lower the amplitude, so that the stage stays linear, or find in the Bode plot where response and fit differ"
        )
    })
}

fn missing_modes(input: &VerdictInput<'_>, found: usize) -> Option<String> {
    let expected = input.expected_modes.unwrap_or(0);
    (found < expected).then(|| {
        format!(
            "only {found} of the {expected} modes that the model has up to {:.0} Hz are found; increase the amplitude there, or the duration",
            hertz(input.up_to_rad_s)
        )
    })
}

fn uncertain_sign(modes: &[FittedMode]) -> Option<String> {
    let uncertain = modes.iter().find(|mode| !has_certain_sign(mode))?;
    Some(format!(
        "the sign of the residue at {:.2} Hz is uncertain; increase the amplitude there, or the duration",
        uncertain.frequency_hz().value
    ))
}

fn has_certain_sign(mode: &FittedMode) -> bool {
    mode.sign_error_probability() <= WRONG_SIGN_PROBABILITY
}

/// A zero that may lie on either side of the imaginary axis.
fn uncertain_side(zeros: &[UncertainZero]) -> Option<String> {
    let zero = zeros.iter().find(|zero| !has_certain_side(zero))?;
    let real_part = zero.real_part();
    Some(format!(
        "the zero {:.3} ± {:.3} at {:.2} Hz may lie on either side of the imaginary axis (right: {:.1} %); increase the amplitude there, or the duration",
        real_part.value,
        real_part.half_width_95(),
        hertz(zero.s.norm()),
        100.0 * zero.rhp_probability
    ))
}

fn has_certain_side(zero: &UncertainZero) -> bool {
    let off_axis = zero.s.re.abs() >= FIT_ACCURACY * zero.s.norm();
    let right = zero.rhp_probability;
    off_axis && (right <= WRONG_SIDE_PROBABILITY || right >= 1.0 - WRONG_SIDE_PROBABILITY)
}

/// The verdict from zeros that all have a certain side: the other two criteria must agree.
fn evaluate(
    zeros: &[UncertainZero],
    modes: &[FittedMode],
    phase_drop: Option<PhaseDrop>,
) -> (Cnmp, String) {
    let right = RightHalfPlane::count(zeros);
    let Some(phase_drop) = phase_drop else {
        return (Cnmp::Undecided, NO_PHASE_DROP.into());
    };
    if !right.agrees_with(phase_drop) {
        (Cnmp::Undecided, right.disagreement(phase_drop))
    } else if right.cnmp_pairs == 0 {
        (Cnmp::Excluded, NO_CNMP.into())
    } else if !has_opposite_neighbours(modes) {
        (Cnmp::Undecided, NO_OPPOSITE_NEIGHBOURS.into())
    } else {
        (Cnmp::Detected, right.detected(modes, phase_drop))
    }
}

/// Numbers of zeros in the right half plane.
struct RightHalfPlane {
    cnmp_pairs: usize,
    real: usize,
}

impl RightHalfPlane {
    fn count(zeros: &[UncertainZero]) -> Self {
        let right = zeros.iter().filter(|zero| zero.s.re > 0.0);
        let (pairs, real): (Vec<&UncertainZero>, Vec<&UncertainZero>) =
            right.partition(|zero| zero.kind == ZeroKind::Cnmp);
        Self {
            cnmp_pairs: pairs.len(),
            real: real.len(),
        }
    }

    /// The phase drop of these zeros in half turns.
    fn half_turns(&self) -> i32 {
        (2 * self.cnmp_pairs + self.real) as i32
    }

    fn agrees_with(&self, phase_drop: PhaseDrop) -> bool {
        phase_drop.deviation_deg <= MAX_PHASE_DEVIATION_DEG
            && phase_drop.half_turns == self.half_turns()
    }

    fn disagreement(&self, phase_drop: PhaseDrop) -> String {
        format!(
            "the zeros of the fit give {} degrees more phase lag than a minimum-phase system, the measured response {:.0}; increase the amplitude between the modes, or the duration",
            180 * self.half_turns(),
            phase_drop.drop_deg
        )
    }

    fn detected(&self, modes: &[FittedMode], phase_drop: PhaseDrop) -> String {
        let pairs = self.cnmp_pairs;
        let plural = if pairs == 1 { "" } else { "s" };
        let signs: String = modes.iter().map(FittedMode::sign).collect();
        format!(
            "{pairs} pair{plural} of CNMP zeros, residues of opposite signs ({signs}), and {:.0} degrees more phase lag than a minimum-phase system of this magnitude",
            phase_drop.drop_deg
        )
    }
}

fn has_opposite_neighbours(modes: &[FittedMode]) -> bool {
    modes
        .windows(2)
        .any(|pair| pair[0].residue_per_kg.value * pair[1].residue_per_kg.value < 0.0)
}

/// The phase drop from well below the first mode of the band to its end. Beyond the end the magnitude is used as far as it is
/// significant.
fn phase_drop_over(input: &VerdictInput<'_>, modes: &[FittedMode]) -> Option<PhaseDrop> {
    let [first, .., _] = modes else {
        return None;
    };
    let (from, to) = input.indices_above(0.5 * first.omega_rad_s.value)?;
    let (_, beyond) = input.frf_data.split_at(to + 1);
    let significant = beyond.iter().take_while(|datum| is_significant(datum));
    let used = &input.frf_data[..to + 1 + significant.count()];
    let omega_rad_s: Vec<f64> = used.iter().map(FrfDatum::omega_rad_s).collect();
    let mechanics = input.chain.mechanics(used, input.fit.parameters.delay_s);
    (from < to).then(|| phase_drop(&omega_rad_s, &mechanics, from, to))
}

fn is_significant(datum: &FrfDatum) -> bool {
    datum.response.norm_sqr() > SIGNIFICANT_POWER * datum.variance
}

fn hertz(omega_rad_s: f64) -> f64 {
    omega_rad_s / (2.0 * std::f64::consts::PI)
}

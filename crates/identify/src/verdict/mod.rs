//! Verdict on complex non-minimum phase (CNMP) zeros of a stage: "detected", "excluded" or "undecided", with the
//! reasons.
//!
//! Three criteria must agree:
//!
//! 1. the zeros of the fit, each with its probability of lying in the right half plane;
//! 2. the signs of the residues: two close modes of opposite signs, and a remainder, are necessary for CNMP zeros between
//!    them (sections 3.2.2 and 3.2.4);
//! 3. the phase drop of the measured response beyond Bode's relation, compared with that of the fitted zeros over the same band
//!    ([`PhaseDrop`]).
//!
//! With complex residues, of damping that is not proportional, the second one does not apply, and the zeros are computed from the complex
//! residues ([`crate::modal::Residues`]).
//!
//! Only what can change the verdict is evaluated: a residue of uncertain sign, or one more mode that is not excluded, prevents a verdict
//! only if the number of CNMP pairs depends on it, and a real zero may lie on either side.
//!
//! A verdict needs sufficient data: as many modes as the model has, and residuals that are noise. It covers the band up to a
//! given frequency. All comparisons state what must hold, so that a number that is not finite (a singular covariance, a bin
//! without response) makes the verdict undecided.

mod decisive;
mod information;
mod input;
mod longer;
mod observed_zero;
mod phase_check;
mod phase_drop;
mod sign_groups;
#[cfg(test)]
mod tests;
mod zeros;

pub use information::{DecisiveQuantity, decisive_quantities};
pub use input::{Certainty, MAX_LOOKS, VerdictInput, VerdictScope};
pub use phase_drop::PhaseDrop;
pub use zeros::{UncertainZero, zeros};

use decisive::{decisive_mode_more, decisive_uncertain_mode};
use longer::Longer;
use observed_zero::as_observed;
use phase_check::phase_drop_over;
use serde::{Deserialize, Serialize};
use sign_groups::signs_of;

use crate::FrfDatum;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::modal::{FitError, FittedMode, MeasurementChain, ModalFit, OneMoreMode};
use bench_base::decimal::Decimal;
use bench_base::units::hz_text;
use bench_plant::zeros::ZeroKind;
use bench_plant::{PlantError, Sign};

/// The phase confirms a pair that turns it by at least this angle where it is followed, half of a full turn, in degrees.
const CONFIRMED_DEG: f64 = 180.0;
/// A zero whose distance from the imaginary axis exceeds this ratio of its frequency has another one nearer to its mirror image than that.
const MIRROR_RATIO: f64 = 0.2;
/// Relative accuracy of a fit: a zero closer to the imaginary axis is on neither side.
const FIT_ACCURACY: f64 = 1e-4;
/// Largest deviation of the measured from the predicted phase drop in degrees: a sixth of the turn of a CNMP pair.
const MAX_PHASE_DEVIATION_DEG: f64 = 60.0;

/// Probability of the other sign where nothing is known of it.
const UNKNOWN_SIGN: f64 = 0.5;

const NO_PHASE: &str = "the response is not significant against its noise over the modes, so that its phase cannot be checked; increase the amplitude or the duration of the excitation";
const TOO_FEW_MODES: &str = "fewer than two modes are found, and the phase check needs two modes; increase the amplitude or the duration of the excitation, or measure at another operating point, as the other modes may have no residue at this one";
const NO_CNMP: &str = "all zeros of the fit lie left of the imaginary axis, and the phase lag is that of a minimum-phase system of this magnitude";
const COMPLEX_RESIDUES: &str = "the residues are complex: the damping is not proportional, or there is a filter or an additional lag between input and output; the zeros are computed from the complex residues, and are those of the whole response from input to output; the rule about the signs of residues does not apply";
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
    /// Whether the modes may be those of the stage. Otherwise, as with a defect of the record or another kind of output, none of their signs
    /// is certain.
    pub is_of_stage: bool,
}

impl Verdict {
    /// An undecided verdict without any zeros, because the modes are not those of the stage.
    pub fn undecided(why: String) -> Verdict {
        Verdict {
            cnmp: Cnmp::Undecided,
            why,
            zeros: Vec::new(),
            phase_drop: None,
            is_of_stage: false,
        }
    }

    /// The modes of its fit. If they are not those of the stage, each sign may as well be the other one.
    pub fn modes(&self, fit: &ModalFit) -> Vec<FittedMode> {
        let mut modes = fit.modes();
        if !self.is_of_stage {
            modes
                .iter_mut()
                .for_each(|mode| mode.turned_by_one_more = UNKNOWN_SIGN);
        }
        modes
    }

    /// The verdict with a caution added to its reasons.
    #[must_use]
    pub fn with(mut self, caution: Option<String>) -> Verdict {
        if let Some(caution) = caution {
            self.why = format!("{}; {caution}", self.why);
        }
        self
    }
}

/// The verdict of a fit, undecided if no modes could be fitted.
///
/// # Errors
/// Those of [`verdict`].
pub fn judge(
    fit: &Result<ModalFit, FitError>,
    frf_data: &[FrfDatum],
    chain: &MeasurementChain,
    scope: VerdictScope,
) -> Result<Verdict, PlantError> {
    match fit {
        Ok(fit) => verdict(&scope.input(fit, frf_data, chain)),
        Err(error) => Ok(Verdict::undecided(error.to_string())),
    }
}

/// Evaluates the criteria.
///
/// # Errors
/// When the zeros of the fit cannot be computed.
pub fn verdict(input: &VerdictInput<'_>) -> Result<Verdict, PlantError> {
    let is_complex = !input.fit.parameters.has_real_residues();
    let mut zeros = zeros(input.fit)?;
    if is_complex {
        let observed = zeros.into_iter();
        zeros = observed
            .map(|zero| as_observed(zero, input.fit, input.chain))
            .collect();
    }
    let mut modes = input.fit.modes();
    modes.retain(|mode| input.covers(mode.omega_rad_s.value));
    let phase_drop = phase_drop_over(input, &modes, &zeros)?;
    zeros.retain(|zero| input.covers(zero.s.norm()));
    let of_stage = if is_complex {
        zeros_of_the_stage(&zeros)
    } else {
        zeros.clone()
    };
    let uncertain_mode = decisive_uncertain_mode(input)?.map(|k| input.fit.modes()[k]);
    let mode_more = decisive_mode_more(input)?;
    let insufficient = insufficient_data(input, &modes)
        .or_else(|| uncertain_mode.map(|mode| uncertain_sign_reason(&mode, input)))
        .or_else(|| uncertain_side(&zeros, input))
        .or_else(|| mode_more.map(|more| uncertain_mode_reason(more, input)))
        .or_else(|| only_of_the_chain(&zeros, &of_stage));
    let (cnmp, why) = match insufficient {
        Some(why) => (Cnmp::Undecided, why),
        None => match phase_drop {
            Some(phase_drop) => evaluate(&of_stage, certain_signs(input).as_deref(), phase_drop),
            None => (Cnmp::Undecided, no_phase_drop(modes.len()).into()),
        },
    };
    let verdict = Verdict {
        cnmp,
        why,
        zeros,
        phase_drop,
        is_of_stage: true,
    };
    let verdict = verdict
        .with(is_complex.then(|| COMPLEX_RESIDUES.into()))
        .with(filter_modes(input.fit));
    Ok(verdict.with(left_out(input.fit)))
}

/// The certain signs of real residues; complex ones have none.
fn certain_signs(input: &VerdictInput<'_>) -> Option<Vec<f64>> {
    let is_real = input.fit.parameters.has_real_residues();
    is_real.then(|| signs_of(input))
}

/// The modes with complex residues that take the place of a filter, as a caution.
fn filter_modes(fit: &ModalFit) -> Option<String> {
    if fit.parameters.has_real_residues() {
        return None;
    }
    let modes: Vec<String> = fit.filter_modes().iter().map(described).collect();
    (!modes.is_empty()).then(|| {
        format!(
            "{}: a pole of a filter between input and output, or in place of a delay, unless a brake acts on the stage",
            modes.join(", ")
        )
    })
}

/// A mode by frequency and damping.
fn described(mode: &FittedMode) -> String {
    let frequency_hz = hz_text(mode.frequency_hz().value, 2);
    let damping_ratio = mode.damping_ratio.value;
    format!("{frequency_hz} Hz (damping ratio {damping_ratio:.2})")
}

/// The frequencies that are not fitted, as a caution.
fn left_out(fit: &ModalFit) -> Option<String> {
    let frequencies: Vec<String> = fit.left_out_hz.iter().map(|hz| hz_text(*hz, 2)).collect();
    (!frequencies.is_empty()).then(|| {
        format!(
            "the response at {} Hz alone differs from the modes, as by a disturbance or a mode narrower than the distance of the frequencies; it is left out, and a finer resolution (a longer period) shows which it is",
            frequencies.join(", ")
        )
    })
}

/// Why the data are insufficient for a verdict.
fn insufficient_data(input: &VerdictInput<'_>, modes: &[FittedMode]) -> Option<String> {
    poor_fit(input.fit.chi2_per_freedom)
        .or_else(|| missing_modes(input, modes.len()))
        .or_else(|| undefined_response(input.frf_data))
}

fn poor_fit(chi2_per_freedom: f64) -> Option<String> {
    let good = chi2_per_freedom <= MAX_CHI2_PER_FREEDOM;
    (!good).then(|| {
        format!(
            "reduced chi-square {chi2_per_freedom:.1}, above {MAX_CHI2_PER_FREEDOM}: the response is not the fitted sum of modes with real residues; lower the amplitude if a record with half of it has other modes, and remove or state a filter or a lag in the channel; the damping may also be not proportional, or the stage may have changed during the record; the Bode plot shows where response and fit differ: leave that out of the band"
        )
    })
}

fn missing_modes(input: &VerdictInput<'_>, found: usize) -> Option<String> {
    let expected = input.expected_modes.unwrap_or(0);
    if found >= expected {
        return None;
    }
    let (up_to_hz, (_, last_hz)) = (hertz(input.up_to_rad_s), input.fit.band_hz);
    let remedy = if last_hz < up_to_hz {
        format!("the excitation ends at {last_hz:.0} Hz: extend it to more than {up_to_hz:.0} Hz")
    } else {
        "increase the amplitude there, or the duration".into()
    };
    Some(format!(
        "only {found} of the {expected} modes that the model has up to {up_to_hz:.0} Hz are found; {remedy}"
    ))
}

/// A response of zero has neither a phase nor a logarithm of its magnitude.
fn undefined_response(data: &[FrfDatum]) -> Option<String> {
    let undefined = data
        .iter()
        .find(|datum| !datum.response.norm().is_normal())?;
    Some(format!(
        "the response at {} Hz is {}, which has no phase; check the output of the record, or exclude this frequency from the band",
        hz_text(undefined.frequency_hz, 2),
        undefined.response
    ))
}

fn uncertain_sign_reason(mode: &FittedMode, input: &VerdictInput<'_>) -> String {
    format!(
        "the sign of the residue at {} Hz is uncertain, and the number of CNMP zeros depends on it; {}",
        hz_text(mode.frequency_hz().value, 2),
        longer_for_sign(mode, input)
    )
}

/// How long a record must be for the sign of a residue, which one more mode may turn.
fn longer_for_sign(mode: &FittedMode, input: &VerdictInput<'_>) -> Longer {
    let alone = FittedMode {
        turned_by_one_more: 0.0,
        ..*mode
    };
    match &input.fit.one_more_mode {
        Some(more) if input.has_certain_sign(&alone) => Longer::for_mode(more, input.duration_s),
        _ => Longer::for_sign(mode.residue_per_kg, input.certainty, input.duration_s),
    }
}

fn uncertain_mode_reason(more: &OneMoreMode, input: &VerdictInput<'_>) -> String {
    format!(
        "it is uncertain whether there is one more mode near {} Hz (probability {:.1} %), and the number of CNMP zeros depends on it; {}",
        hz_text(hertz(more.near_rad_s), 2),
        100.0 * more.probability,
        Longer::for_mode(more, input.duration_s)
    )
}

/// How long a record must be for the side of a zero. None decides that of one closer to the axis than a fit is accurate.
fn longer_for_side(zero: &UncertainZero, input: &VerdictInput<'_>) -> String {
    if zero.is_uncertain_by_model() {
        return format!(
            "response and modes disagree about it by {:.3} rad/s, as with a filter between input and output: record signals without a filter, or state its lag",
            zero.difference.norm()
        );
    }
    if is_on_axis(zero) {
        return "increase the amplitude there, or the duration".into();
    }
    Longer::for_sign(zero.real_part(), input.certainty, input.duration_s).to_string()
}

/// A complex zero that may lie on either side of the imaginary axis. (A real zero is no CNMP zero on either side.)
fn uncertain_side(zeros: &[UncertainZero], input: &VerdictInput<'_>) -> Option<String> {
    let mut complex = zeros.iter().filter(|zero| zero.s.im != 0.0);
    let zero = complex.find(|zero| !has_certain_side(zero, input.certainty))?;
    let real_part = zero.real_part();
    if is_on_axis(zero) && real_part.half_width_95() < FIT_ACCURACY * zero.s.norm() {
        return Some(format!(
            "the zero {:.4} ± {:.4} rad/s at {} Hz lies on the imaginary axis within the accuracy of a fit, 0.01 % of its frequency; a longer record does not decide: measure at another operating point",
            Decimal(real_part.value),
            real_part.half_width_95(),
            hz_text(hertz(zero.s.norm()), 2)
        ));
    }
    Some(format!(
        "the zero {:.3} ± {:.3} at {} Hz may lie on either side of the imaginary axis (right: {:.1} %); {}",
        Decimal(real_part.value),
        real_part.half_width_95(),
        hz_text(hertz(zero.s.norm()), 2),
        100.0 * zero.rhp_probability,
        longer_for_side(zero, input)
    ))
}

fn has_certain_side(zero: &UncertainZero, certainty: Certainty) -> bool {
    let right = zero.rhp_probability;
    !is_on_axis(zero) && (certainty.allows(right) || certainty.allows(1.0 - right))
}

/// Whether a zero is closer to the imaginary axis than a fit is accurate; also with a real part that is not finite.
fn is_on_axis(zero: &UncertainZero) -> bool {
    let is_off = zero.s.re.abs() >= FIT_ACCURACY * zero.s.norm();
    !is_off
}

/// The verdict from zeros that all have a certain side: the other two criteria must agree. There are no signs of complex residues.
fn evaluate(
    zeros: &[UncertainZero],
    signs: Option<&[f64]>,
    phase_drop: PhaseDrop,
) -> (Cnmp, String) {
    let pairs = cnmp_pairs(zeros);
    let agrees = phase_drop.deviation_deg() <= MAX_PHASE_DEVIATION_DEG;
    if !agrees {
        (Cnmp::Undecided, disagreement(phase_drop, signs.is_none()))
    } else if pairs == 0 {
        (Cnmp::Excluded, excluded(zeros))
    } else if let Some(zero) = unconfirmed(zeros, phase_drop) {
        (Cnmp::Undecided, unconfirmed_reason(zero))
    } else if signs.is_some_and(|signs| !has_opposite_neighbours(signs)) {
        (Cnmp::Undecided, NO_OPPOSITE_NEIGHBOURS.into())
    } else {
        (Cnmp::Detected, detected(pairs, signs, phase_drop.drop_deg))
    }
}

/// Why there is no phase drop over this number of modes.
fn no_phase_drop(modes: usize) -> &'static str {
    if modes < 2 { TOO_FEW_MODES } else { NO_PHASE }
}

/// Why there are no CNMP zeros. A real zero right of the imaginary axis is none, but limits a controller as well.
fn excluded(zeros: &[UncertainZero]) -> String {
    match limiting_zero(zeros) {
        None => NO_CNMP.into(),
        Some(real) => format!(
            "all complex zeros of the fit lie left of the imaginary axis, and the phase lag is that which the fit predicts; a real zero {} right of it, at {} Hz: it is not a CNMP zero, but limits the bandwidth of a controller in the same way",
            if is_certain_right(real) {
                "lies".into()
            } else {
                format!("may lie ({:.0} %)", 100.0 * real.rhp_probability)
            },
            hz_text(hertz(real.s.re), 1)
        ),
    }
}

/// The lowest real zero that is certain to lie right of the axis, or else the most probable one.
fn limiting_zero(zeros: &[UncertainZero]) -> Option<&UncertainZero> {
    let real = || zeros.iter().filter(|zero| zero.kind == ZeroKind::Rnmp);
    let certain = real().filter(|zero| is_certain_right(zero));
    let lowest = certain.min_by(|a, b| a.s.re.total_cmp(&b.s.re));
    lowest.or_else(|| real().max_by(|a, b| a.rhp_probability.total_cmp(&b.rhp_probability)))
}

/// Whether the whole 95 % interval lies right of the imaginary axis.
fn is_certain_right(zero: &UncertainZero) -> bool {
    let real_part = zero.real_part();
    real_part.value > real_part.half_width_95()
}

fn cnmp_pairs(zeros: &[UncertainZero]) -> usize {
    let pairs = zeros.iter().filter(|zero| zero.kind == ZeroKind::Cnmp);
    pairs.count()
}

/// Of complex residues the phase is that of the samples, in which a digital filter has no zeros between them.
fn disagreement(phase_drop: PhaseDrop, is_complex: bool) -> String {
    let remedy = if is_complex {
        "record signals without a filter, or increase the amplitude between the modes"
    } else {
        "increase the amplitude between the modes, or the duration"
    };
    format!(
        "the zeros of the fit predict {:.0} degrees more phase lag than a minimum-phase system of this magnitude, the measured response has {:.0}; {remedy}",
        Decimal(phase_drop.predicted_deg),
        Decimal(phase_drop.drop_deg)
    )
}

/// The first CNMP zero around which the phase cannot be followed, because the response is noise. At no distance from the axis does such a
/// zero give a verdict: the fit is extrapolated to it, and what it does not describe may cause it (a cut record, a filter in the channel, the
/// steps of a coarse probe).
fn unconfirmed(zeros: &[UncertainZero], phase_drop: PhaseDrop) -> Option<&UncertainZero> {
    let mut cnmp = zeros.iter().filter(|zero| zero.kind == ZeroKind::Cnmp);
    cnmp.find(|zero| phase_drop.lag_deg(zero.s) < CONFIRMED_DEG)
}

/// The zeros that a mechanical system can have. Without damping they are symmetric about the imaginary axis, and damping moves them by
/// little: far right of it there is only one that has another one at about its mirror image. A lag or a filter, which complex residues
/// represent within the band only, may have one without it.
fn zeros_of_the_stage(zeros: &[UncertainZero]) -> Vec<UncertainZero> {
    let is_mirrored = |zero: &&UncertainZero| {
        let mirror_image = -zero.s.conj();
        let distance = |other: &UncertainZero| (other.s - mirror_image).norm();
        let limit = MIRROR_RATIO * zero.s.norm();
        zero.s.re < limit || zeros.iter().any(|other| distance(other) < limit)
    };
    let of_stage = zeros
        .iter()
        .filter(|zero| zero.s.im == 0.0 || is_mirrored(zero));
    of_stage.copied().collect()
}

/// Why CNMP zeros of the fit decide nothing: none of them is one of the stage.
fn only_of_the_chain(zeros: &[UncertainZero], of_stage: &[UncertainZero]) -> Option<String> {
    if cnmp_pairs(of_stage) > 0 {
        return None;
    }
    let mut cnmp = zeros.iter().filter(|zero| zero.kind == ZeroKind::Cnmp);
    let zero = cnmp.next()?;
    Some(format!(
        "the zero {:.1} \u{b1} {:.1}j rad/s at {} Hz lies far right of the imaginary axis without one left of it, as of a filter or a lag between input and output, and not of the stage; record unfiltered signals, or state hold and lag of the input (--hold, --input-lag)",
        zero.s.re,
        zero.s.im,
        hz_text(hertz(zero.s.norm()), 2)
    ))
}

fn unconfirmed_reason(zero: &UncertainZero) -> String {
    format!(
        "the fit has CNMP zeros at {} Hz, where the response is noise and its phase cannot confirm them; increase the amplitude there, or the duration",
        hz_text(hertz(zero.s.norm()), 2)
    )
}

fn detected(pairs: usize, signs: Option<&[f64]>, drop_deg: f64) -> String {
    let plural = if pairs == 1 { "" } else { "s" };
    let of_signs = signs.map_or_else(String::new, |signs| {
        let symbol = |residue: &f64| Sign::of(*residue).symbol();
        let signs: String = signs.iter().map(symbol).collect();
        format!(", residues of opposite signs ({signs})")
    });
    format!(
        "{pairs} pair{plural} of CNMP zeros{of_signs}, and {drop_deg:.0} degrees more phase lag than a minimum-phase system of this magnitude"
    )
}

fn has_opposite_neighbours(residues: &[f64]) -> bool {
    residues.windows(2).any(|pair| pair[0] * pair[1] < 0.0)
}

fn hertz(omega_rad_s: f64) -> f64 {
    omega_rad_s / (2.0 * std::f64::consts::PI)
}

//! Signs that the columns of an external record are not input and output of a plant that was at rest.

use bench_base::units::hz_text;
use bench_plant::OutputKind;

use crate::complex_residues::fit_complex;
use crate::external_signals::{ACTIVE_RATIO, ExternalSignals};
use crate::fitted_lag::{FitThroughLag, FittedLag, fit_through_lag};
use crate::modal::{FitError, MeasurementChain, ModalFit, ModeGroup};
use crate::observation::{Observation, describes};
use crate::other_kind::{better_kind, explained_by_kind, swapped, vanishes_at_rest};
use crate::record_check::{Ends, Resolution};
use crate::sweep_harmonics::SweepHarmonic;
use crate::verdict::{Cnmp, Verdict};
use crate::{Frf, record_check};

/// Half of the frequencies must have at least this coherence.
const MIN_COHERENCE: f64 = 0.5;
/// At the end of the band the position by a force does not grow with a higher power of frequency than this, unless the next mode
/// lies just above it; a velocity grows with one power more, an acceleration with two.
const MAX_SLOPE: f64 = 1.0;
/// The slope is measured over this fraction of the band, in ln f, at its end.
const SLOPE_PART: f64 = 0.25;
/// A mode beyond the band explains a growth at its end up to this multiple of that end ...
const MAX_BEYOND_BAND: f64 = 3.0;
/// ... if the standard deviations of its frequency and its residue lie below this ratio of them.
const DETERMINED_RATIO: f64 = 0.2;
/// An output is early if it precedes its input by more than this fraction of a sample and by more than [`CERTAIN_SIGMAS`].
const EARLY_SAMPLES: f64 = 0.5;
/// A deviation of more standard deviations is not noise.
const CERTAIN_SIGMAS: f64 = 5.0;
/// More modes than these that cannot be determined are no modes.
const MANY_MODES: usize = 8;
/// Noise that a controller feeds back to the input makes the response none of modes.
const CLOSED_LOOP: &str =
    "if the record was taken in closed loop, give the column of its reference (--reference)";

/// What to do about irregular readings.
const TRUE_TIMES: &str = "record the true time of each reading, or let the clock that samples the input also sample the output";

/// What to do about a plant that is not linear.
const HALF_AMPLITUDE: &str = "compare a record with half of the amplitude: if its harmonics are a smaller part, lower the amplitude (a limit, or a stiffness that depends on the amplitude), or else increase it (friction, play)";

/// Why modes do not describe the data, if that is known: little of the output is that of the input, or it is of another kind.
pub(super) fn known_cause(seen: &Observation<'_>) -> Option<String> {
    let of = seen.remedies;
    with_remedy(incoherent(seen.frf, seen.fit, of.excitation), of.incoherent)
        .or_else(|| explained_by_kind(seen))
}

/// The reason, if the data cannot be those of input and output of a mechanical system.
pub(super) fn implausible(seen: &Observation<'_>) -> Option<String> {
    swapped(seen)
        .or_else(|| vanishes_at_rest(seen))
        .or_else(|| grows_with_frequency(seen))
        .or_else(|| with_remedy(early(seen), seen.remedies.early))
}

/// An input that seems clipped, if modes do not describe the response. (A drive at its limit, whose input is measured, is linear.)
pub(super) fn clipped(seen: &Observation<'_>, input_limit: Option<f64>) -> Option<String> {
    let limit = input_limit.filter(|_| !seen.is_described());
    limit.map(clipped_input)
}

/// Readings at irregular times, if modes do not describe the response.
pub(super) fn irregular(seen: &Observation<'_>, jitter_s: Option<f64>) -> Option<String> {
    let jitter_s = jitter_s.filter(|_| !seen.is_described())?;
    Some(format!("{}; {TRUE_TIMES}", irregular_readings(jitter_s)))
}

/// What irregular readings are.
pub(super) fn irregular_readings(jitter_s: f64) -> String {
    format!(
        "the errors of the output grow with its speed, as those of readings whose times scatter by {:.4} ms (standard deviation), which the record does not state",
        1e3 * jitter_s
    )
}

/// Harmonics that are too large for a linear plant, if modes do not describe the response.
pub(super) fn nonlinear(seen: &Observation<'_>, harmonics: &[SweepHarmonic]) -> Option<String> {
    let are_large = harmonics.iter().any(SweepHarmonic::is_large);
    let found: Vec<String> = harmonics.iter().map(SweepHarmonic::description).collect();
    (!seen.is_described() && are_large).then(|| format!("{}; {HALF_AMPLITUDE}", found.join("; ")))
}

fn with_remedy(what: Option<String>, remedy: &str) -> Option<String> {
    what.map(|what| format!("{what}; {remedy}"))
}

/// A response that grows as that of no output of the assumed kind, with the kind that describes it, if there is one.
///
/// The response of a plant that is not linear, or of a coarse probe, may grow as well; modes do not describe it. A response with complex
/// residues may seem to grow, because real ones need another mode at the end of the band in their place.
fn grows_with_frequency(seen: &Observation<'_>) -> Option<String> {
    let is_misfit = seen.fit.as_ref().is_ok_and(|fit| !describes(fit));
    if is_misfit || seen.output_step.is_some() {
        return None;
    }
    let what = growing(seen.frf, seen.fit, seen.chain.output())?;
    if fit_complex(&seen.frf.data, seen.chain, seen.fit).is_some() {
        return None;
    }
    better_kind(seen).or_else(|| with_remedy(Some(what), seen.remedies.growing))
}

/// An undecided verdict of a record with a known cause, as one that is cut within its excitation, is due to that.
pub(super) fn due_to(verdict: Verdict, cause: &str) -> Verdict {
    match verdict.cnmp {
        Cnmp::Undecided => Verdict {
            why: format!("{cause} (it seems that {})", verdict.why),
            is_of_stage: false,
            ..verdict
        },
        _ => verdict,
    }
}

/// What describes a response that modes with real residues do not.
pub(super) struct OtherModel {
    pub(super) fit: ModalFit,
    pub(super) chain: MeasurementChain,
    /// A lag that was fitted.
    pub(super) lag: Option<FittedLag>,
}

/// Modes with a lag that is not stated, if they describe the data, and are plausible.
pub(super) fn lag_model(seen: &Observation<'_>) -> Option<OtherModel> {
    let FitThroughLag { lag, chain, fit } = fit_through_lag(seen)?;
    plausible(seen, fit, chain, Some(lag))
}

/// Modes with complex residues, if modes with real ones do not describe the data, and if they are plausible.
pub(super) fn complex_model(seen: &Observation<'_>) -> Option<OtherModel> {
    let fit = fit_complex(&seen.frf.data, seen.chain, seen.fit)?;
    with_complex_residues(seen, fit)
}

/// Modes with complex residues, if they are plausible.
pub(super) fn with_complex_residues(seen: &Observation<'_>, fit: ModalFit) -> Option<OtherModel> {
    plausible(seen, fit, seen.chain.clone(), None)
}

fn plausible(
    seen: &Observation<'_>,
    fit: ModalFit,
    chain: MeasurementChain,
    lag: Option<FittedLag>,
) -> Option<OtherModel> {
    let fitted = Ok(fit);
    let with_fit = Observation {
        fit: &fitted,
        chain: &chain,
        ..*seen
    };
    let is_plausible = implausible(&with_fit).is_none();
    let fit = fitted.ok()?;
    is_plausible.then_some(OtherModel { fit, chain, lag })
}

/// Modes that describe the response may lie in less than half of the band.
fn incoherent(frf: &Frf, fit: &Result<ModalFit, FitError>, excitation: &str) -> Option<String> {
    if fit.as_ref().is_ok_and(describes) {
        return None;
    }
    let median = frf.median_coherence()?;
    (median < MIN_COHERENCE).then(|| {
        format!(
            "the {excitation} explains {:.0} % of the output's power, or less, at half of the frequencies",
            100.0 * median
        )
    })
}

/// A displacement falls with frequency above its modes; a force as output would grow. Frequencies at which the output is noise do not
/// count. Below a mode at the end of the band a displacement grows as well.
fn growing(frf: &Frf, fit: &Result<ModalFit, FitError>, kind: OutputKind) -> Option<String> {
    let (first_hz, last_hz) = (frf.frequency_hz.first()?, frf.frequency_hz.last()?);
    let from_hz = last_hz * (first_hz / last_hz).powf(SLOPE_PART);
    if ends_with_a_mode(fit, from_hz, *last_hz) {
        return None;
    }
    let significant = (0..frf.len()).filter(|k| frf.coherence[*k] >= MIN_COHERENCE);
    let end = significant
        .filter(|k| frf.frequency_hz[*k] >= from_hz)
        .map(|k| (frf.frequency_hz[k].ln(), frf.response[k].norm().ln()));
    let slope = slope(end.filter(|(_, y)| y.is_finite()).collect())?;
    let max_slope = MAX_SLOPE + f64::from(kind.derivatives());
    (slope > max_slope).then(|| {
        format!(
            "from {from_hz:.1} to {last_hz:.1} Hz the response grows with frequency to the power of {slope:.1}"
        )
    })
}

/// Whether the highest mode of a fit that describes the data lies between two frequencies, or not far above them with a frequency and a
/// residue that the data determine. (The inverse of a response needs a mode beyond the band as well, but its frequency is undetermined.)
fn ends_with_a_mode(fit: &Result<ModalFit, FitError>, from_hz: f64, to_hz: f64) -> bool {
    let Some(fit) = fit.as_ref().ok().filter(|fit| describes(fit)) else {
        return false;
    };
    let Some(last) = fit.modes().pop() else {
        return false;
    };
    let (frequency_hz, residue) = (last.frequency_hz(), last.residue_per_kg);
    let is_determined = frequency_hz.sigma < DETERMINED_RATIO * frequency_hz.value
        && residue.sigma < DETERMINED_RATIO * residue.value.abs();
    let limit_hz = if is_determined {
        MAX_BEYOND_BAND * to_hz
    } else {
        to_hz
    };
    (from_hz..=limit_hz).contains(&frequency_hz.value)
}

/// The slope of the least-squares line.
fn slope(points: Vec<(f64, f64)>) -> Option<f64> {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
    let square: f64 = points.iter().map(|(x, _)| (x - x0) * (x - x0)).sum();
    let product: f64 = points.iter().map(|(x, y)| (x - x0) * (y - y0)).sum();
    (square > 0.0).then(|| product / square)
}

/// An output that precedes its input. The delay of modes that do not describe the response, or take the place of something else, is none of
/// the output.
fn early(seen: &Observation<'_>) -> Option<String> {
    let is_sum = |fit: &&ModalFit| describes(fit) && fit.cancelling_modes().is_none();
    let fit = seen.fit.as_ref().ok().filter(is_sum)?;
    let delay = fit.determined_delay_s()?;
    let limit_s = (EARLY_SAMPLES / seen.source.rate_hz).max(CERTAIN_SIGMAS * delay.sigma);
    (-delay.value > limit_s).then(|| {
        format!(
            "the output precedes the input by {:.3} ms",
            -delay.value * 1e3
        )
    })
}

/// What else may be the cause of an undecided verdict of a response.
pub(super) fn response_hint(verdict: &Verdict, fit: &Result<ModalFit, FitError>) -> Option<String> {
    let is_undecided = verdict.cnmp == Cnmp::Undecided;
    is_undecided.then(|| not_a_sum_of_modes(fit)).flatten()
}

/// What else may be the cause of an undecided verdict.
pub(super) fn hint(
    verdict: &Verdict,
    record: ExternalSignals<'_>,
    fit: &Result<ModalFit, FitError>,
    resolution: &Resolution,
    input_limit: Option<f64>,
) -> Option<String> {
    if verdict.cnmp != Cnmp::Undecided {
        return None;
    }
    if let Some(step) = resolution.output {
        return Some(coarse_steps(step));
    }
    let is_open = record.reference.is_none() && record.ends != Ends::Periods;
    let no_sum = not_a_sum_of_modes(fit).map(|why| {
        if is_open {
            format!("{why}; {CLOSED_LOOP}")
        } else {
            why
        }
    });
    match (no_sum, input_limit.map(clipped_input)) {
        (Some(no_sum), Some(clipped)) => Some(format!("{clipped}; {no_sum}")),
        (no_sum, clipped) => clipped.or(no_sum),
    }
}

fn clipped_input(limit: f64) -> String {
    format!(
        "the input stays at its limit of {limit:.4e} for several samples in several places, as one that is clipped; lower the amplitude, or extend the range of the sensor of the input"
    )
}

fn coarse_steps(step: f64) -> String {
    format!(
        "the output has steps of {step:.4e}, more than its noise, and their errors are no noise; increase the amplitude, or use a finer range of the probe"
    )
}

/// Why a verdict from an output with steps that no modes describe is undecided.
pub(super) fn undescribed_steps(step: f64) -> String {
    format!(
        "the output has steps of {step:.4e}, more than its noise, and no sum of modes describes all of its readings, so that modes may be due to the steps; increase the amplitude, or use a finer range of the probe"
    )
}

/// A verdict that was decided from modes that are not determined, and whose residues cancel, is undecided.
pub(super) fn unless_undetermined(verdict: Verdict, fit: &Result<ModalFit, FitError>) -> Verdict {
    let undetermined = fit.as_ref().ok().and_then(ModalFit::undetermined_modes);
    let (true, Some(group)) = (verdict.cnmp != Cnmp::Undecided, undetermined) else {
        return verdict;
    };
    Verdict {
        cnmp: Cnmp::Undecided,
        why: no_sum_of_modes(&cancelling(group)),
        is_of_stage: false,
        ..verdict
    }
}

fn cancelling(group: ModeGroup) -> String {
    let (low_hz, high_hz) = group.band_hz;
    format!(
        "the residues of {} modes from {} to {} Hz nearly cancel",
        group.count,
        hz_text(low_hz, 2),
        hz_text(high_hz, 2)
    )
}

/// Modes whose residues nearly cancel take the place of what is no sum of modes.
fn not_a_sum_of_modes(fit: &Result<ModalFit, FitError>) -> Option<String> {
    let found = match fit {
        Ok(fit) => cancelling(fit.cancelling_modes().or_else(|| fit.undetermined_pair())?),
        Err(FitError::Undetermined { modes }) if *modes > MANY_MODES => {
            format!("{modes} modes are needed")
        }
        Err(_) => return None,
    };
    Some(no_sum_of_modes(&found))
}

fn no_sum_of_modes(found: &str) -> String {
    format!(
        "{found}: the response may be no sum of modes with real residues, as with damping that is not proportional, a filter or an additional lag between input and output; record unfiltered signals, or state hold and lag of the input (--hold, --input-lag)"
    )
}

/// A record without the rest before or after its excitation, during which the plant settles. (Periods and noise that goes on need none.)
pub(super) fn cut_within_excitation(record: ExternalSignals<'_>) -> Option<String> {
    if record.ends != Ends::Rest {
        return None;
    }
    let (excited, excitation) = (record.excited(), record.remedies().excitation);
    let at_start = record_check::input_ratio_at_start(&excited);
    let at_end = record_check::input_ratio_at_end(&excited);
    if at_start > ACTIVE_RATIO {
        Some(format!(
            "at the first samples the RMS value of the {excitation} is already {:.0} % of that of the whole record; begin the record before the excitation, with the plant at rest",
            100.0 * at_start
        ))
    } else if at_end > ACTIVE_RATIO {
        Some(format!(
            "at the last samples the RMS value of the {excitation} is still {:.0} % of that of the whole record; continue the record after the excitation, until the plant rests",
            100.0 * at_end
        ))
    } else {
        None
    }
}

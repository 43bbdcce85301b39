//! Whether another kind of output, or swapped columns, describe what modes do not.
//!
//! The inverse of an acceleration over a force, 1/(s^2 G), is a sum of modes too: the zeros of G are its modes, with a free body and a
//! constant. So modes describe the columns of an acceleration when they are exchanged, and exchanged columns of a position as an
//! acceleration. An explanation with a free body, and a constant that is nearly all of the response at the end of the band, is therefore
//! not counted.

use bench_plant::OutputKind;
use nalgebra::Complex;

use crate::complex_residues::is_clearly_better;
use crate::modal::{self, FitError, ModalFit};
use crate::observation::{Observation, Source, describes};
use crate::part::{PART_MODES, Part, fit_part};
use crate::{Estimate, FrfDatum};

/// A constant above this ratio of the response at the end of the band is nearly all of it.
const CONSTANT_RATIO: f64 = 0.7;
/// A static compliance that is known to be below this ratio of the sum of its parts is zero ...
const STATIC_RATIO: f64 = 0.05;
/// ... unless it exceeds this multiple of its standard deviation.
const STATIC_SIGMAS: f64 = 5.0;
/// A kind of output describes the data better if its chi-square is smaller by this factor: that of a part of the data has some 700
/// degrees of freedom and a standard deviation of 5 %, so that noise alone never reaches it.
const CLEARLY_BETTER: f64 = 1.5;
/// Modes of another kind leave noise with so many modes less than those of the assumed kind leave more.
const SAVED_MODES: usize = 2;
/// Far better: the residual is smaller by a factor of ten.
const FAR_BETTER: f64 = 100.0;
const SWAPPED: &str =
    "modes describe the response from output to input, but not that from input to output";

/// The kind of an output that is clearly of another kind than assumed: few modes do not describe it, and half as many of that kind do, or
/// fewer to its noise, or as many far better, and complex residues of the assumed kind do not better. If few modes describe
/// the data, it is clear only if they are suspect, and fewer of that kind leave noise. `seen` with few modes of a part of the data.
pub(super) fn clear_kind(seen: &Observation<'_>) -> Option<OutputKind> {
    let few = seen.fit;
    let few_modes = match few {
        Ok(fit) => fit.parameters.modes.len(),
        Err(FitError::Undetermined { modes }) => *modes,
        Err(_) => return None,
    };
    let is_described = seen.is_described();
    if is_described && !few.as_ref().is_ok_and(|few| is_suspect(few, seen)) {
        return None;
    }
    let (kind, other) = other_kind(seen)?;
    let other_modes = other.parameters.modes.len();
    let is_far_better = |few: &ModalFit| few.chi2_per_freedom > FAR_BETTER * other.chi2_per_freedom;
    let saves_modes = other.leaves_noise() && other_modes + SAVED_MODES <= few_modes;
    let is_clear = if is_described {
        saves_modes
    } else {
        saves_modes || 2 * other_modes <= PART_MODES || few.as_ref().is_ok_and(is_far_better)
    };
    let is_simplest = is_clear && !complex_residues_are_better(seen.part, other);
    is_simplest.then_some(*kind)
}

/// Whether modes of a kind that is not stated may be those of another one: as many as are allowed, or without a static response.
fn is_suspect(few: &ModalFit, seen: &Observation<'_>) -> bool {
    let is_full = few.parameters.modes.len() == PART_MODES;
    seen.stated.is_none() && (is_full || vanishes(few))
}

/// Another kind of output that describes the data in place of that of the fit.
pub(super) fn explained_by_kind(seen: &Observation<'_>) -> Option<String> {
    let assumed = seen.chain.output();
    let described = seen.fit.as_ref().ok().filter(|fit| describes(fit));
    if let Some(kind) = seen.clear_kind {
        return Some(match described {
            Some(_) => give_kind_of_fewer_modes(assumed, kind),
            None => give_kind(assumed, kind),
        });
    }
    if let Some(fit) = described {
        let is_clear = seen.stated.is_some() || fit.leaves_noise();
        return if is_clear {
            None
        } else {
            described_better(seen)
        };
    }
    if seen.output_step.is_some() {
        return None;
    }
    let (kind, other) = other_kind(seen)?;
    // What is no sum of modes may be described a little better by those of another kind.
    let is_far_better = |fit: &ModalFit| fit.chi2_per_freedom > FAR_BETTER * other.chi2_per_freedom;
    let is_clear = other.leaves_noise() || seen.fit.as_ref().is_ok_and(is_far_better);
    let is_simplest = is_clear && !complex_residues_are_better(seen.part, other);
    is_simplest.then(|| give_kind(assumed, *kind))
}

/// Exchanged columns: modes describe the inverse of a response that they do not describe.
pub(super) fn swapped(seen: &Observation<'_>) -> Option<String> {
    let is_described = seen.is_described();
    let is_known = seen.output_step.is_none();
    (!is_described && is_known && inverse_fits(seen))
        .then(|| format!("{SWAPPED}; {}", seen.remedies.swapped))
}

/// Whether modes of the assumed kind with complex residues describe a part of the data better than those of another kind. (They can be
/// those of an acceleration as well, but need more parameters for it.)
fn complex_residues_are_better(part: &Part, other: &ModalFit) -> bool {
    part.complex().is_some_and(|fit| {
        let is_smaller = fit.number_of_parameters() < other.number_of_parameters();
        let is_better = is_smaller || is_clearly_better(fit, other, part.data.len());
        !vanishes(fit) && (is_better || !other.is_of_a_stage())
    })
}

fn give_kind(assumed: OutputKind, kind: OutputKind) -> String {
    let (assumed, kind) = (assumed.name(), kind.name());
    format!("modes describe the output as {kind}, but not as {assumed}; give --output-kind {kind}")
}

fn give_kind_of_fewer_modes(assumed: OutputKind, kind: OutputKind) -> String {
    let (assumed, kind) = (assumed.name(), kind.name());
    format!(
        "fewer modes describe the output as {kind} than as {assumed}; give --output-kind {kind}, or --output-kind {assumed} if it is one"
    )
}

/// The only other kind of output, of which as many modes describe the data to their noise, clearly better than those of the assumed kind.
fn described_better(seen: &Observation<'_>) -> Option<String> {
    let (few, assumed) = (seen.part.few().as_ref().ok()?, seen.chain.output());
    let (kind, other) = other_kind(seen)?;
    let ratio = few.chi2_per_freedom / other.chi2_per_freedom;
    let is_better = ratio > CLEARLY_BETTER
        && other.leaves_noise()
        && other.parameters.modes.len() <= few.parameters.modes.len();
    let (assumed, kind) = (assumed.name(), kind.name());
    is_better.then(|| {
        format!(
            "modes describe the output as {kind} with a {ratio:.1} times smaller chi-square than as {assumed}; give --output-kind {kind}, or --output-kind {assumed} if it is one"
        )
    })
}

/// The kind of an output that modes describe as the assumed kind only implausibly: the only other kind of which they describe it.
pub(super) fn better_kind(seen: &Observation<'_>) -> Option<String> {
    let (kind, _) = other_kind(seen)?;
    let (assumed, kind) = (seen.chain.output().name(), kind.name());
    Some(format!(
        "the response grows with frequency as that of no {assumed}, and modes describe the output as {kind}; give --output-kind {kind}"
    ))
}

/// The only other kind of output of which modes describe the data, with these modes.
fn other_kind<'a>(seen: &Observation<'a>) -> Option<&'a (OutputKind, ModalFit)> {
    let other = &seen.part.other_kind;
    other.get_or_init(|| only_other(seen)).as_ref()
}

fn only_other(seen: &Observation<'_>) -> Option<(OutputKind, ModalFit)> {
    let (data, assumed) = (&seen.frf.data, seen.chain.output());
    let others = OutputKind::ALL.into_iter().filter(|kind| *kind != assumed);
    let mut found = others.filter_map(|kind| Some((kind, modes_as(&seen.source, data, kind)?)));
    let first = found.next()?;
    found.next().is_none().then_some(first)
}

/// Modes that describe a part of the data as an output of this kind.
fn modes_as(source: &Source, data: &[FrfDatum], kind: OutputKind) -> Option<ModalFit> {
    let fit = fit_part(data, &source.chain(kind, data)).ok()?;
    let is_acceleration = kind == OutputKind::Position && vanishes(&fit);
    (describes(&fit) && !is_of_inverse(&fit) && !is_acceleration).then_some(fit)
}

/// Whether modes describe the inverse of the response.
fn inverse_fits(seen: &Observation<'_>) -> bool {
    let mut inverse: Vec<FrfDatum> = seen.frf.data.iter().map(inverse_datum).collect();
    inverse.retain(|datum| datum.variance.is_normal());
    let is_sum_of_modes = |fit: ModalFit| describes(&fit) && !is_of_inverse(&fit);
    fit_part(&inverse, seen.chain).is_ok_and(is_sum_of_modes)
        && modal::fit(&inverse, seen.chain).is_ok_and(is_sum_of_modes)
}

fn inverse_datum(datum: &FrfDatum) -> FrfDatum {
    FrfDatum {
        response: datum.response.inv(),
        variance: datum.variance / datum.response.norm_sqr().powi(2),
        ..*datum
    }
}

/// Whether modes are those of the inverse of another response: a free body, below the band, and a constant that is nearly all of the
/// response at its end.
fn is_of_inverse(fit: &ModalFit) -> bool {
    let (low_hz, high_hz) = fit.band_hz;
    let [low_rad_s, high_rad_s] = [low_hz, high_hz].map(|hz| std::f64::consts::TAU * hz);
    let parameters = &fit.parameters;
    let s = Complex::new(0.0, high_rad_s);
    let modes = parameters.modes.iter();
    let sum: Complex<f64> = modes
        .map(|mode| mode.resonance(s) * mode.residue_per_kg)
        .sum();
    let constant = parameters.remainder_m_per_n;
    let has_free_body = parameters
        .modes
        .iter()
        .any(|mode| mode.omega_rad_s < low_rad_s);
    has_free_body && constant.abs() > CONSTANT_RATIO * (sum + constant).norm()
}

/// Whether the response of a fit vanishes at rest, as that of a velocity or an acceleration, but not that of a position of a supported
/// stage. Near the modes of an acceleration s^2 is about -w^2, so that a constant, and modes with residues of the opposite signs, describe
/// it as a position.
pub(super) fn vanishes_at_rest(seen: &Observation<'_>) -> Option<String> {
    let fit = seen.fit.as_ref().ok().filter(|fit| describes(fit))?;
    if seen.stated.is_some() || !vanishes(fit) {
        return None;
    }
    Some("the static response of the modes is zero within its error, as that of a velocity or an acceleration, of which the modes would be others; give --output-kind velocity or --output-kind acceleration, or --output-kind position if it is a displacement".into())
}

fn vanishes(fit: &ModalFit) -> bool {
    let Some(compliance) = fit.static_compliance_m_per_n() else {
        return false;
    };
    let modes = fit.parameters.modes.iter();
    let parts = modes.map(|mode| (mode.residue_per_kg / mode.omega_rad_s.powi(2)).abs());
    let size = parts.sum::<f64>() + fit.parameters.remainder_m_per_n.abs();
    let Estimate { value, sigma } = compliance;
    value.abs().max(sigma) < STATIC_RATIO * size && value.abs() < STATIC_SIGMAS * sigma
}

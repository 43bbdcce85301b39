//! The analysis of signals that no bench of ours recorded: from force to displacement, or what stands in their place, and
//! without a model to compare with.

use nalgebra::Complex;

use super::AnalysisError;
use super::analysis::judge;
use crate::identify::modal::{self, FitError, MeasurementChain, ModalFit};
use crate::identify::periodic::{self, Repetition};
use crate::identify::verdict::{MAX_CHI2_PER_FREEDOM, Verdict};
use crate::identify::{
    EstimatorSettings, Frf, FrfDatum, Signals, frf_data, local, with_distortion,
};

/// Half of the frequencies must have at least this coherence.
const LEAST_COHERENCE: f64 = 0.5;
/// No mechanics answer with a magnitude that still grows with this power of frequency at the end of the band, unless the next
/// mode is right above it.
const STEEPEST: f64 = 1.0;
/// The slope at the end is taken over this part of ln f.
const END: f64 = 0.25;
/// An answer earlier than this part of a sample, and than five of its sigma, comes before its cause.
const EARLY_SAMPLES: f64 = 0.5;
/// Sigma that count as sure.
const SURE: f64 = 5.0;

/// What signals of other hands show.
#[derive(Clone, Debug)]
pub struct ExternalAnalysis {
    /// The response from input to output.
    pub frf: Frf,
    /// The modes that it shows, or why none are told.
    pub fit: Result<ModalFit, FitError>,
    /// What that says of CNMP zeros.
    pub verdict: Verdict,
    /// Modes and zeros up to here count for the verdict, in rad/s: the end of the band.
    pub judged_up_to_rad_s: f64,
    /// Periods that were averaged, of a periodic record.
    pub periods: Option<usize>,
}

/// Analyses input and output between two frequencies; with a repetition as averaged periods, without one as a record that
/// begins and ends at rest.
pub fn analyse_external(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Option<Repetition>,
) -> Result<ExternalAnalysis, AnalysisError> {
    let (frf, frf_data, periods) = response(signals, band_hz, repetition)?;
    let fit = if repetition.is_some() {
        fit_of_periods(&frf_data)
    } else {
        modal::fit(&frf_data, &MeasurementChain::Direct)
    };
    let judged_up_to_rad_s = 2.0 * std::f64::consts::PI * band_hz.1;
    let verdict = match doubt(signals.rate_hz, &frf, &frf_data, &fit) {
        Some(why) => Verdict::undecided(why),
        None => judge(
            &fit,
            &frf_data,
            &MeasurementChain::Direct,
            judged_up_to_rad_s,
            None,
        )?,
    };
    Ok(ExternalAnalysis {
        frf,
        fit,
        verdict,
        judged_up_to_rad_s,
        periods,
    })
}

fn response(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Option<Repetition>,
) -> Result<(Frf, Vec<FrfDatum>, Option<usize>), AnalysisError> {
    if let Some(repetition) = repetition {
        let periods = periodic::estimate(signals, band_hz, repetition)?;
        return Ok((periods.frf, periods.frf_data, Some(periods.count)));
    }
    let frf = local::estimate(signals, band_hz, &EstimatorSettings::default())?;
    Ok((
        frf,
        frf_data(signals, band_hz, &EstimatorSettings::default())?,
        None,
    ))
}

/// The modes that periods show. Where they leave more than the noise, distortion counts as well; without periods the noise is
/// taken from neighbouring frequencies, and distortion is in it.
fn fit_of_periods(frf_data: &[FrfDatum]) -> Result<ModalFit, FitError> {
    let fit = modal::fit(frf_data, &MeasurementChain::Direct);
    if fit
        .as_ref()
        .is_ok_and(|fit| fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM)
    {
        return fit;
    }
    let mut fit = modal::fit(&with_distortion(frf_data), &MeasurementChain::Direct)?;
    fit.chi2_per_freedom = chi2_per_freedom(&fit, frf_data);
    Ok(fit)
}

/// What a fit leaves over the noise alone, whatever it was weighted with.
fn chi2_per_freedom(fit: &ModalFit, frf_data: &[FrfDatum]) -> f64 {
    let frequency_hz: Vec<f64> = frf_data.iter().map(|block| block.frequency_hz).collect();
    let fitted = fit.response(&MeasurementChain::Direct, &frequency_hz);
    let left = |(block, h): (&FrfDatum, &Complex<f64>)| {
        2.0 * (block.response - h).norm_sqr() / block.variance
    };
    let freedom = (2 * frf_data.len())
        .saturating_sub(fit.covariance.nrows())
        .max(1);
    frf_data.iter().zip(&fitted).map(left).sum::<f64>() / freedom as f64
}

/// Why the data carry no verdict, whatever the fit says of them.
fn doubt(
    rate_hz: f64,
    frf: &Frf,
    frf_data: &[FrfDatum],
    fit: &Result<ModalFit, FitError>,
) -> Option<String> {
    let swapped = || grows(frf).or_else(|| explained_the_other_way(frf_data, fit));
    incoherent(frf)
        .or_else(swapped)
        .or_else(|| early(rate_hz, fit.as_ref().ok()?))
}

/// Modes that do not explain the response, but do explain its inverse.
fn explained_the_other_way(
    frf_data: &[FrfDatum],
    fit: &Result<ModalFit, FitError>,
) -> Option<String> {
    let explained = |fit: &ModalFit| fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM;
    if fit.as_ref().is_ok_and(explained) {
        return None;
    }
    let inverse = |block: &FrfDatum| FrfDatum {
        response: block.response.inv(),
        variance: block.variance / block.response.norm_sqr().powi(2),
        ..*block
    };
    let inverse: Vec<FrfDatum> = frf_data
        .iter()
        .map(inverse)
        .filter(|b| b.variance.is_normal())
        .collect();
    let other = modal::fit(&inverse, &MeasurementChain::Direct).ok()?;
    explained(&other).then(|| {
        "modes explain how the input answers the output, and not how the output answers the input: they are swapped (--input, \
         --output)"
            .into()
    })
}

fn incoherent(frf: &Frf) -> Option<String> {
    let median = frf.median_coherence()?;
    (median < LEAST_COHERENCE).then(|| {
        format!(
            "the input explains {:.0} % of the output's power at half of the frequencies or less: these are not cause and \
             answer, or most of the band was not excited; name the columns that belong together, or the band that was \
             excited (--band)",
            100.0 * median
        )
    })
}

/// A displacement falls with frequency above its modes; the force as its answer would grow.
fn grows(frf: &Frf) -> Option<String> {
    let (first_hz, last_hz) = (frf.frequency_hz.first()?, frf.frequency_hz.last()?);
    let from_hz = last_hz * (first_hz / last_hz).powf(END);
    let end = frf
        .frequency_hz
        .iter()
        .zip(&frf.response)
        .filter(|(f, _)| **f >= from_hz);
    let slope = slope(
        end.map(|(f, h)| (f.ln(), h.norm().ln()))
            .filter(|(_, y)| y.is_finite()),
    )?;
    (slope > STEEPEST).then(|| {
        format!(
            "from {from_hz:.1} to {last_hz:.1} Hz the response grows with frequency to the power of {slope:.1}: input and output \
             are swapped (--input, --output), or a mode stands right above the band (--band)"
        )
    })
}

/// The slope of the line of least squares.
fn slope(points: impl Iterator<Item = (f64, f64)>) -> Option<f64> {
    let points: Vec<_> = points.collect();
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x0, y0) = (mean(|p| p.0), mean(|p| p.1));
    let square: f64 = points.iter().map(|(x, _)| (x - x0) * (x - x0)).sum();
    (square > 0.0).then(|| points.iter().map(|(x, y)| (x - x0) * (y - y0)).sum::<f64>() / square)
}

fn early(rate_hz: f64, fit: &ModalFit) -> Option<String> {
    let delay = fit.delay_s();
    (-delay.value > (EARLY_SAMPLES / rate_hz).max(SURE * delay.sigma)).then(|| {
        format!(
            "the output comes {:.3} ms before its cause: input and output are swapped (--input, --output), or they were not \
             sampled at the same times",
            -delay.value * 1e3
        )
    })
}

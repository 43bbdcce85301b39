//! What only a periodic record shows: averaged periods, their distortion, and the modes of both.

use serde::Serialize;

use crate::frf::with_relative_error;
use crate::harmonics::{InputSignal, harmonics};
use crate::linearity::Linearity;
use crate::modal::{self, FitError, MeasurementChain, ModalFit};
use crate::observation::describes;
use crate::periodic::{self, Repetition};
use crate::{Frf, FrfDatum, IdentifyError, Signals, distortion_ratio, with_distortion};

/// Error of a line by distortion, as a ratio of the response, if neighbouring lines do not show it.
const RELATIVE_ERROR: f64 = 0.01;
/// A fit is far better if its chi-square is smaller by this factor.
const FAR_BETTER: f64 = 10.0;

/// What only a periodic record shows.
#[derive(Clone, Debug)]
pub struct PeriodicPart {
    /// Number of averaged periods.
    pub periods: usize,
    /// Number of periods at the beginning that were omitted.
    pub skipped: usize,
    /// The distortion; `None` with too few lines.
    pub distortion: Option<Distortion>,
    /// Noise, odd and even distortion, if the excitation omits lines.
    pub linearity: Option<Linearity>,
}

/// Distortion of a periodic record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Its power over that of the output, or of the response.
    pub ratio: f64,
    /// Where it was measured.
    pub source: DistortionSource,
}

/// Where distortion was measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DistortionSource {
    /// At the lines that the excitation omits: odd and even.
    OmittedLines,
    /// In the roughness of the response over frequency, as the mean over the lines.
    Roughness,
}

impl PeriodicPart {
    /// The response of averaged periods, and what only they show.
    pub(super) fn of(
        signals: &Signals,
        band_hz: (f64, f64),
        repetition: Repetition,
    ) -> Result<(Frf, PeriodicPart), IdentifyError> {
        let periods = periodic::estimate(signals, band_hz, repetition)?;
        let count = periods.count;
        let frf = periods.pooled();
        let lines = harmonics(signals, band_hz, repetition, InputSignal::Measured)?;
        let linearity = lines.map(Linearity::new);
        let part = PeriodicPart {
            periods: count,
            skipped: repetition.skip,
            distortion: Distortion::of(linearity.as_ref(), &frf.data),
            linearity,
        };
        Ok((frf, part))
    }
}

impl Distortion {
    fn of(linearity: Option<&Linearity>, data: &[FrfDatum]) -> Option<Distortion> {
        let Some(linearity) = linearity else {
            return Some(Distortion {
                ratio: distortion_ratio(data)?,
                source: DistortionSource::Roughness,
            });
        };
        let whole = &linearity.whole;
        let kinds = [whole.odd_distortion_ratio, whole.even_distortion_ratio];
        Some(Distortion {
            ratio: kinds.into_iter().flatten().sum::<f64>().max(0.0),
            source: DistortionSource::OmittedLines,
        })
    }

    /// Its amplitude as a percentage, and where it was measured.
    pub fn description(&self) -> String {
        let percent = 100.0 * self.ratio.sqrt();
        match self.source {
            DistortionSource::OmittedLines => {
                format!("{percent:.2} % of the output, at the lines that are not excited")
            }
            DistortionSource::Roughness => {
                format!("{percent:.2} % of the response, by its roughness over frequency")
            }
        }
    }
}

/// The modes of averaged periods. Odd distortion at the omitted lines counts as noise. If the modes do not describe the data, they are
/// fitted again with distortion of the roughness added to the noise.
/// (Without periods, the noise is estimated from neighbouring frequencies and already includes distortion.)
pub(super) fn fit_of_periods(
    data: &[FrfDatum],
    linearity: Option<&Linearity>,
    chain: &MeasurementChain,
) -> Result<ModalFit, FitError> {
    let measured = linearity.map(|linearity| linearity.with_odd_distortion(data));
    let fit = modal::fit(measured.as_deref().unwrap_or(data), chain);
    if fit.as_ref().is_ok_and(describes) {
        return fit;
    }
    let smooth = fit_with_errors(&with_distortion(data), data, chain);
    // Of lines farther apart than the modes, the response is not smooth and the distortion is overestimated.
    let proportional = with_relative_error(data, RELATIVE_ERROR);
    let relative = fit_with_errors(&proportional, data, chain);
    match (smooth, relative) {
        (Ok(smooth), Ok(relative))
            if relative.chi2_per_freedom * FAR_BETTER < smooth.chi2_per_freedom =>
        {
            Ok(relative)
        }
        (Err(_), Ok(relative)) => Ok(relative),
        (smooth, _) => smooth,
    }
}

/// The modes of data with increased errors; the reduced chi-square is that with the noise alone.
fn fit_with_errors(
    increased: &[FrfDatum],
    data: &[FrfDatum],
    chain: &MeasurementChain,
) -> Result<ModalFit, FitError> {
    let mut fit = modal::fit(increased, chain)?;
    (fit.chi2_per_freedom, fit.freedom) = chi2_per_freedom(&fit, data, chain);
    Ok(fit)
}

/// Reduced chi-square of the fitted data with the noise alone, and its degrees of freedom.
fn chi2_per_freedom(fit: &ModalFit, data: &[FrfDatum], chain: &MeasurementChain) -> (f64, usize) {
    let data = fit.used_data(data);
    let frequency_hz: Vec<f64> = data.iter().map(|datum| datum.frequency_hz).collect();
    let fitted = fit.response(chain, &frequency_hz);
    let squares = data
        .iter()
        .zip(&fitted)
        .map(|(datum, h)| 2.0 * (datum.response - h).norm_sqr() / datum.variance);
    let parameters = fit.covariance.nrows();
    let freedom = (2 * data.len()).saturating_sub(parameters).max(1);
    (squares.sum::<f64>() / freedom as f64, freedom)
}

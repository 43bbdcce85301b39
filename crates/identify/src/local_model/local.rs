//! The default estimator: local models of neighbouring bins of the FFT of the whole record.
//!
//! A run begins and ends at rest, so that its whole record transforms without leakage: `Y_k = H(f_k) U_k + N_k` holds bin by
//! bin, without window or segments. What remains is to average the noise where H is smooth enough, over a neighbourhood that
//! grows with frequency as the widths of lightly damped modes do.
//!
//! **Bias.** Near a mode of damping ratio zeta, H is about 1/(1 + j x) with x = (f - f0)/(zeta f0), that is 1 - j x - x^2 +
//! ... at the peak. Over a half-width h = rho f0 with the weights cos^2, a constant is low at the peak by (0.36 rho/zeta)^2, a
//! parabola by 0.027 (rho/zeta)^4: 2 % and 0.4 % at zeta = 0.004 and rho = 0.0025. The rational model contains the pole; its
//! bias is that of other modes nearby: 0.06 % for modes of 281.4, 282.0 and 283.6 Hz with zeta = 0.005.
//!
//! **Confidence.** The residual e = Y - H U contains the noise, reduced by the part that the model has fitted. With X
//! the columns of the model (linearized about its parameters), W the weights, A = X* W X and B = X* W^2 X,
//!
//! ```text
//! E sum w |e|^2 = S (sum w - tr A^-1 B),     E|error of H|^2 = S (A^-1 B A^-1)_00
//! ```
//!
//! S, the power of the noise around a bin, is the sum of w |e|^2 over the sum of these brackets, over neighbourhoods
//! one half-width apart, weighted over two half-widths to either side. These are some 20 complex degrees of freedom:
//! sigma itself has a deviation of 11 %, and +-1.96 sigma contain the true value in 94.3 % of all cases instead of
//! 95 % (Student's t of 40). The noise is only assumed to change little over that neighbourhood. A narrower line of
//! noise (floor vibration at 5 Hz in a record of ten seconds, for example) is spread over it, and sigma is too small
//! on the line; a longer record reduces this error.
//!
//! The bias of a parabola grows as h^4, so that an estimate H' with twice the half-width shows it as (H' - H)/15 (of a constant
//! as h^2: /3); its square is added to the variance. It matters at peaks only: elsewhere the noise is larger.
//!
//! **Comparison with spafdr.** Ljung's spafdr (L. Ljung, System Identification, 2nd ed., section 6.4) averages Y conj(U) and
//! |U|^2 over a width given for each frequency: here `curve = "constant"`, with `resolution`, a list of half-widths over
//! frequency, and `frequencies`, the size of a logarithmic grid. Its resolution R, the width at half height of its kernel in
//! rad/s, is that of cos^2 with the half-width h = R/(2 pi) in hertz. A parabola or rational model has the noise of a constant
//! of 0.52 h.

use core::ops::RangeInclusive;

use super::frf_data;
use super::noise_floor::NoiseFloor;
use super::record_spectra::RecordSpectra;
use super::spectra::{Place, Spectra};
use super::transient;
use crate::estimator::{hv, inverse};
use crate::{
    Estimator, EstimatorSettings, Frf, FrfPoint, IdentifyError, LocalModel, Signals, band,
};

/// The response is estimated with the pole of one mode at most.
const ONE_POLE: usize = 1;
/// Half-widths beyond the band whose bins are used: two of the noise, and twice that of a model.
const MARGIN: f64 = 4.0;

/// The FRF of a record, at the frequencies of `band_hz` that have input, with its data for a fit.
///
/// The record begins and ends at rest; or it begins or ends in motion, if `settings.transient` is set. The transient in its spectrum is
/// then subtracted first.
///
/// The coherence is the ratio of the output's power that the model explains; for a constant it is |sum w Y conj(U)|^2/(sum w
/// |U|^2 sum w |Y|^2). See the module for standard deviations and bias.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
///
/// ```
/// use bench_identify::{EstimatorSettings, Signals, local};
///
/// // An impulse through a gain of 2: H = 2 at every frequency.
/// let mut input = vec![0.0; 1000];
/// input[10] = 1.0;
/// let output = input.iter().map(|u| 2.0 * u).collect();
/// let signals = Signals { rate_hz: 1000.0, input, output };
/// let frf = local::estimate(&signals, (50.0, 400.0), &EstimatorSettings::default())?;
/// assert!(frf.response.iter().all(|h| (h - 2.0).norm() < 1e-9));
/// # Ok::<(), bench_identify::IdentifyError>(())
/// ```
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Frf, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let spectra = RecordSpectra::of_signals(signals);
    if !settings.transient {
        return of_spectra(&spectra, &bins, band_hz, settings);
    }
    let settings = EstimatorSettings {
        transient: false,
        ..settings.clone()
    };
    let first = *bins.start() as f64;
    let last = *bins.end() as f64;
    let reach = |position: f64| MARGIN * settings.half_width(position, spectra.bin_hz());
    let used = (first - reach(first), last + reach(last));
    let spectra = transient::subtracted(&spectra, used);
    of_spectra(&spectra, &bins, band_hz, &settings)
}

fn of_spectra(
    spectra: &RecordSpectra,
    bins: &RangeInclusive<usize>,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Frf, IdentifyError> {
    let positions = settings.positions(bins, band_hz, spectra.bin_hz());
    let frf = collect(estimates(spectra, &positions, settings)).excited(band_hz)?;
    Ok(Frf {
        data: frf_data::of_spectra(spectra, bins, settings),
        ..frf
    })
}

/// The response of those positions that have an estimate.
pub(super) fn collect(points: Vec<Option<FrfPoint>>) -> Frf {
    let mut frf = Frf::default();
    frf.extend(points.into_iter().flatten());
    frf
}

/// The estimate at each position with the estimator of the settings.
fn estimates(
    spectra: &RecordSpectra,
    positions: &[f64],
    settings: &EstimatorSettings,
) -> Vec<Option<FrfPoint>> {
    match settings.estimator {
        Estimator::H1 => h1(spectra, positions, settings),
        Estimator::H2 => h2(spectra, positions, settings),
        Estimator::Hv => h1(spectra, positions, settings)
            .into_iter()
            .zip(h2(spectra, positions, settings))
            .map(|(h1, h2)| Some(hv(h1?, h2?)))
            .collect(),
    }
}

/// Local models from output to input, inverted: noise on the input.
fn h2(
    spectra: &RecordSpectra,
    positions: &[f64],
    settings: &EstimatorSettings,
) -> Vec<Option<FrfPoint>> {
    let inverted = h1(&spectra.swapped(), positions, settings);
    inverted
        .into_iter()
        .map(|point| point.map(inverse))
        .collect()
}

/// Local models from input to output: noise on the output. `None` where there is no input.
pub(super) fn h1(
    spectra: &impl Spectra,
    positions: &[f64],
    settings: &EstimatorSettings,
) -> Vec<Option<FrfPoint>> {
    let (Some(low), Some(high)) = (positions.first(), positions.last()) else {
        return Vec::new();
    };
    let floor = NoiseFloor::new(spectra, (*low, *high), settings);
    positions
        .iter()
        .map(|position| point(spectra, *position, settings, &floor))
        .collect()
}

fn point(
    spectra: &impl Spectra,
    position: f64,
    settings: &EstimatorSettings,
    floor: &NoiseFloor<'_>,
) -> Option<FrfPoint> {
    let half_width = settings.half_width(position, spectra.bin_hz());
    let fit_over = |half_width| {
        let place = Place {
            position,
            half_width,
        };
        spectra.fit(place, settings, ONE_POLE)
    };
    let fit = fit_over(half_width)?;
    if !fit.encloses_input {
        return None;
    }
    let wider = fit_over(2.0 * half_width)?;
    let bias = (wider.response - fit.response) / bias_ratio(settings.curve);
    Some(FrfPoint {
        frequency_hz: position * spectra.bin_hz(),
        response: fit.response,
        coherence: fit.coherence,
        variance: floor.power(position) * fit.noise_gain + bias.norm_sqr(),
        resolution_hz: fit.bandwidth_bins * spectra.bin_hz(),
    })
}

/// Change of the estimate with twice the half-width over its bias, which grows with the square of the half-width or with its
/// fourth power.
fn bias_ratio(model: LocalModel) -> f64 {
    if model == LocalModel::Constant {
        3.0
    } else {
        15.0
    }
}

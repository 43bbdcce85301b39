//! The default estimator: smooth curves through neighbouring bins of the FFT of the whole record.
//!
//! A run begins and ends at rest, so that its whole record transforms without leakage: `Y_k = H(f_k) U_k + N_k` holds
//! bin by bin, with no window and no segments. What is left is to average noise away where H is smooth enough for it,
//! over a neighbourhood that grows with frequency as the widths of lightly damped modes do.
//!
//! **Bias.** Near a mode of damping ratio zeta, H is about 1/(1 + j x) with x = (f - f0)/(zeta f0), that is 1 - j x - x^2 +
//! ... at the peak. Over a half-width h = rho f0 with the weights cos^2, a constant is low at the peak by (0.36 rho/zeta)^2, a
//! parabola by 0.027 (rho/zeta)^4: 2 % and 0.4 % at zeta = 0.004 and rho = 0.0025. The rational curve has the pole itself, and
//! is left with what other modes do: modes of 281.4, 282.0 and 283.6 Hz with zeta = 0.005 0.06 %.
//!
//! **Confidence.** The residual e = Y - H U holds the noise, less what the curve has taken out of it. With X the columns of the
//! curve (of its linear model about its parameters), W the weights, A = X* W X and B = X* W^2 X,
//!
//! ```text
//! E sum w |e|^2 = S (sum w - tr A^-1 B),     E|error of H|^2 = S (A^-1 B A^-1)_00
//! ```
//!
//! S, the power of the noise around a bin, is the sum of w |e|^2 over the sum of these brackets, over neighbourhoods one
//! half-width apart, weighted over two half-widths to either side: some 20 complex degrees of freedom, so that sigma is itself
//! steady to 11 %, and 1.96 of it hold the truth in 94.3 % of all cases in place of 95 % (Student's t of 40). It needs no assumption on the noise but that it changes
//! little over that neighbourhood. A line of noise that is narrower (the floor at 5 Hz in a record of ten seconds, say) is
//! spread over it, and sigma comes out too small on the line: record longer.
//!
//! The bias of a parabola grows as h^4, so that an estimate H' of twice the half-width shows it as (H' - H)/15 (of a constant
//! as h^2: /3); its square is added to the variance. It tells at peaks only: elsewhere the noise hides what little there is.
//!
//! **As spafdr.** Ljung's spafdr (L. Ljung, System Identification, 2nd ed., section 6.4) averages Y conj(U) and |U|^2 over a
//! width that is given for each frequency: here `curve = "constant"`, with `resolution`, a list of half-widths over
//! frequency, and `frequencies`, so many of a logarithmic grid. Its resolution R, the width at half height of its kernel in
//! rad/s, is that of cos^2 with the half-width h = R/(2 pi) in hertz. A parabola or rational curve is of the same noise as a
//! constant of 0.52 h.

use super::bins::Bins;
use super::noise_floor::NoiseFloor;
use super::record::Record;
use crate::identify::estimator::{between, inverted};
use crate::identify::{
    Estimator, EstimatorSettings, Frf, FrfPoint, IdentifyError, LocalModel, Signals, band,
};

/// The FRF of a record that begins and ends at rest, at the frequencies of `band_hz` at which there was any input.
///
/// The share of the output's power that the curve explains is the coherence; of a constant it is |sum w Y conj(U)|^2/(sum w
/// |U|^2 sum w |Y|^2). See the module for the errors.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Frf, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let sampling = (signals.rate_hz, signals.len());
    // A band without bins is told before the transform is made.
    band::bins(band_hz, sampling.0, sampling.1)?;
    of_record(&Record::new(signals), sampling, band_hz, settings)
}

/// The FRF of a record that was sampled at a rate, with so many samples.
fn of_record(
    record: &Record,
    (rate_hz, samples): (f64, usize),
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Frf, IdentifyError> {
    let bins = band::bins(band_hz, rate_hz, samples)?;
    let places = settings.places(&bins, band_hz, record.bin_hz());
    let frf = collected(points(record, &places, settings));
    if frf.is_empty() {
        Err(IdentifyError::NotExcited {
            low_hz: band_hz.0,
            high_hz: band_hz.1,
        })
    } else {
        Ok(frf)
    }
}

pub(super) fn collected(points: Vec<Option<FrfPoint>>) -> Frf {
    let mut frf = Frf::default();
    for point in points.into_iter().flatten() {
        frf.push(point);
    }
    frf
}

/// The estimate at each place, as settings choose.
fn points(record: &Record, places: &[f64], settings: &EstimatorSettings) -> Vec<Option<FrfPoint>> {
    let h1 = || forward(record, places, settings);
    let h2 = || {
        forward(&record.swapped(), places, settings)
            .into_iter()
            .map(|point| point.map(inverted))
    };
    match settings.estimator {
        Estimator::H1 => h1(),
        Estimator::H2 => h2().collect(),
        Estimator::Hv => h1()
            .into_iter()
            .zip(h2())
            .map(|(h1, h2)| Some(between(h1?, h2?)))
            .collect(),
    }
}

/// From input to output, all noise on the output; nothing where the input is dead.
pub(super) fn forward(
    bins: &impl Bins,
    places: &[f64],
    settings: &EstimatorSettings,
) -> Vec<Option<FrfPoint>> {
    let (Some(low), Some(high)) = (places.first(), places.last()) else {
        return Vec::new();
    };
    let floor = NoiseFloor::of(bins, (*low, *high), settings);
    places
        .iter()
        .map(|place| point(bins, *place, settings, &floor))
        .collect()
}

fn point(
    bins: &impl Bins,
    place: f64,
    settings: &EstimatorSettings,
    floor: &NoiseFloor,
) -> Option<FrfPoint> {
    let half_width = settings.half_width(place, bins.bin_hz());
    let fitted = bins
        .fit(place, half_width, settings)
        .filter(|fitted| fitted.enclosed)?;
    let wider = bins.fit(place, 2.0 * half_width, settings)?;
    let bias = (wider.response - fitted.response)
        / if settings.curve == LocalModel::Constant {
            3.0
        } else {
            15.0
        };
    Some(FrfPoint {
        frequency_hz: place * bins.bin_hz(),
        response: fitted.response,
        coherence: fitted.coherence,
        variance: floor.power(place, half_width) * fitted.gain + bias.norm_sqr(),
        resolution_hz: fitted.width * bins.bin_hz(),
    })
}

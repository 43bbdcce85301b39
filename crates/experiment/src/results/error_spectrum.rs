//! The spectrum of the error of a closed loop, measured and predicted.
//!
//! ```text
//!  e = S r - S (d + n)          recorded error: reference minus reading
//!  S_ee = S_rr' + |S|^2 (S_dd + S_nn)
//!  x - r = S d - T n - S r      error of the stage itself, which no probe shows:  |S|^2 S_dd + |T|^2 S_nn
//! ```
//!
//! d is the displacement by the floor without control, n the error of the probe. S_rr' is the spectrum of the error that the model of the
//! loop has with the recorded reference; S and T are those of the whole simulated rig. Both spectra are one-sided, by Welch's method,
//! and averaged over bands of a 32nd of an octave. The prediction is averaged with the spectral window of a Hann window, as the
//! measurement is.

use std::ops::Range;

use super::closed_signals::ClosedSignals;
use bench_base::numeric::{linspace, variance_interval};
use bench_base::units::rad_s;
use bench_control::ClosedLoop;
use bench_identify::welch;
use bench_identify::{IdentifyError, Signals};
use bench_rig::simulated::DisturbanceSpectra;

/// Length of a segment in seconds, in a record that is long enough.
const SEGMENT_S: f64 = 2.0;
/// Fewest lengths of a segment in a record.
const MIN_SEGMENTS: usize = 4;
/// Fewest ticks of a segment.
const MIN_SEGMENT: usize = 256;
/// First bin: lower ones lack power, because the mean of each segment is subtracted before it is windowed.
const FIRST_BIN: usize = 2;
/// Bands per octave.
const BANDS_PER_OCTAVE: f64 = 32.0;
/// Correlation of the powers of bins one and two apart, with a Hann window: (2/3)^2 and (1/6)^2.
const NEIGHBOUR_CORRELATIONS: [f64; 2] = [4.0 / 9.0, 1.0 / 36.0];
/// Spectral window of a Hann window at distances of a quarter bin: (sin(pi x)/(pi x (1 - x^2)))^2.
const WINDOW: [f64; 8] = [1.0, 0.9222, 0.7205, 0.4705, 0.25, 0.1025, 0.0288, 0.0039];
/// Number of these values in a bin.
const STEPS_PER_BIN: usize = 4;
/// Bands with more bins are averaged without the spectral window, which is narrow beside them, at this many frequencies.
const WIDE_BAND: usize = 4;
const WIDE_BAND_POINTS: usize = 16;

/// One-sided spectra of the error, in m^2/Hz.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorSpectrum {
    /// Centre frequencies of the bands in hertz.
    pub frequency_hz: Vec<f64>,
    /// Widths of the bands in hertz.
    pub width_hz: Vec<f64>,
    /// Measured.
    pub measured: Vec<f64>,
    /// Lower and upper limit of the expected value, over the measured one: the 95 % confidence interval of chi-square.
    pub interval: Vec<[f64; 2]>,
    /// By the model of the simulated rig.
    pub predicted: Option<PredictedSpectrum>,
}

/// The spectrum of the error by the model of the simulated rig, and its parts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PredictedSpectrum {
    /// Sum of the parts.
    pub total: Vec<f64>,
    /// By the floor: |S|^2 S_dd.
    pub floor: Vec<f64>,
    /// By the probe: |S|^2 S_nn.
    pub noise: Vec<f64>,
    /// Error of the stage itself by floor and probe: |S|^2 S_dd + |T|^2 S_nn.
    pub stage: Vec<f64>,
}

/// The simulated rig, for a prediction.
pub(crate) struct SpectrumModel<'a> {
    /// The loop of the whole rig, which is stable.
    pub(super) closed_loop: &'a ClosedLoop,
    /// Floor and probe.
    pub(super) disturbance: DisturbanceSpectra,
}

/// The spectrum of the steady state, which begins at the tick `steady`; `None` if it is too short.
pub(crate) fn error_spectrum(
    signals: &ClosedSignals,
    steady: usize,
    rate_hz: f64,
    model: Option<&SpectrumModel<'_>>,
) -> Option<ErrorSpectrum> {
    let error_m = signals.error_m.get(steady..)?;
    let wanted = libm::round(SEGMENT_S * rate_hz) as usize;
    let segment = wanted.min(error_m.len() / MIN_SEGMENTS);
    if segment < MIN_SEGMENT {
        return None;
    }
    let welch = Welch { segment, rate_hz };
    let bands = welch.bands();
    let measured = welch.spectrum(error_m).ok()?;
    Some(ErrorSpectrum {
        frequency_hz: bands.iter().map(|band| welch.centre_hz(band)).collect(),
        width_hz: bands
            .iter()
            .map(|band| band.len() as f64 * welch.bin_hz())
            .collect(),
        measured: averages(&measured.output, &bands),
        interval: intervals(measured.degrees_of_freedom(), &bands),
        predicted: model.map(|model| predicted(model, signals, steady, &welch, &bands)),
    })
}

/// Segments of Welch's method.
struct Welch {
    segment: usize,
    rate_hz: f64,
}

impl Welch {
    fn spectrum(&self, values: &[f64]) -> Result<welch::PowerSpectra, IdentifyError> {
        let signals = Signals {
            rate_hz: self.rate_hz,
            input: values.to_vec(),
            output: values.to_vec(),
        };
        welch::spectra(&signals, self.segment)
    }

    fn bin_hz(&self) -> f64 {
        self.rate_hz / self.segment as f64
    }

    /// Neighbouring bins that are averaged, below half the rate.
    fn bands(&self) -> Vec<Range<usize>> {
        let end = self.segment.div_ceil(2);
        let ratio = libm::exp2(1.0 / BANDS_PER_OCTAVE);
        let mut bands = Vec::new();
        let mut start = FIRST_BIN;
        while start < end {
            let next = (libm::round(start as f64 * ratio) as usize).max(start + 1);
            bands.push(start..next.min(end));
            start = next;
        }
        bands
    }

    fn centre_hz(&self, band: &Range<usize>) -> f64 {
        0.5 * (band.start + band.end - 1) as f64 * self.bin_hz()
    }

    /// Frequencies in hertz and weights, whose sum is 1, of the mean over a band as Welch's method measures it.
    fn quadrature(&self, band: &Range<usize>) -> Vec<(f64, f64)> {
        if band.len() > WIDE_BAND {
            self.evenly(band)
        } else {
            self.windowed(band)
        }
    }

    fn evenly(&self, band: &Range<usize>) -> Vec<(f64, f64)> {
        let (first, last) = (band.start as f64, (band.end - 1) as f64);
        let bins = linspace(first, last, WIDE_BAND_POINTS);
        bins.map(|bin| (bin * self.bin_hz(), 1.0 / WIDE_BAND_POINTS as f64))
            .collect()
    }

    /// Seen through the spectral window around each bin.
    fn windowed(&self, band: &Range<usize>) -> Vec<(f64, f64)> {
        let reach = WINDOW.len() - 1;
        let (first, last) = (band.start * STEPS_PER_BIN, (band.end - 1) * STEPS_PER_BIN);
        let places = first.saturating_sub(reach)..=last + reach;
        let weight = |place: usize| -> f64 {
            let distances = band.clone().map(|bin| place.abs_diff(bin * STEPS_PER_BIN));
            distances.filter_map(|distance| WINDOW.get(distance)).sum()
        };
        let total: f64 = places.clone().map(weight).sum();
        let step_hz = self.bin_hz() / STEPS_PER_BIN as f64;
        places
            .map(|place| (place as f64 * step_hz, weight(place) / total))
            .collect()
    }
}

/// Means over bands.
fn averages(spectrum: &[f64], bands: &[Range<usize>]) -> Vec<f64> {
    let mean = |band: &Range<usize>| {
        let values = &spectrum[band.clone()];
        values.iter().sum::<f64>() / values.len() as f64
    };
    bands.iter().map(mean).collect()
}

/// Confidence intervals of the means over bands, with so many degrees of freedom for one bin.
fn intervals(freedoms: f64, bands: &[Range<usize>]) -> Vec<[f64; 2]> {
    let interval = |band: &Range<usize>| variance_interval(freedoms * independent_bins(band.len()));
    bands.iter().map(interval).collect()
}

/// Number of independent bins that `count` neighbouring bins under a Hann window are worth.
fn independent_bins(count: usize) -> f64 {
    let n = count as f64;
    let pairs = (1..).zip(NEIGHBOUR_CORRELATIONS);
    let shared = pairs
        .map(|(distance, correlation)| 2.0 * correlation * (n - f64::from(distance)).max(0.0) / n);
    n / (1.0 + shared.sum::<f64>())
}

fn predicted(
    model: &SpectrumModel<'_>,
    signals: &ClosedSignals,
    steady: usize,
    welch: &Welch,
    bands: &[Range<usize>],
) -> PredictedSpectrum {
    let reference = reference_part(model.closed_loop, signals, steady, welch, bands);
    let mut spectrum = PredictedSpectrum::default();
    for (band, reference) in bands.iter().zip(reference) {
        let parts = welch.quadrature(band).into_iter();
        let parts =
            parts.map(|(frequency_hz, weight)| model.parts(frequency_hz).map(|x| weight * x));
        let [floor, noise, stage] =
            parts.fold([0.0; 3], |sum, part| [0, 1, 2].map(|k| sum[k] + part[k]));
        spectrum.total.push(floor + noise + reference);
        spectrum.floor.push(floor);
        spectrum.noise.push(noise);
        spectrum.stage.push(stage);
    }
    spectrum
}

impl SpectrumModel<'_> {
    /// The parts by floor and probe, and the error of the stage itself, at a frequency.
    fn parts(&self, frequency_hz: f64) -> [f64; 3] {
        let loop_gain = self.closed_loop.sampled_loop(rad_s(frequency_hz));
        let sensitivity = (loop_gain + 1.0).inv().norm_sqr();
        let floor = sensitivity * self.disturbance.floor_m2_per_hz(frequency_hz);
        let noise = sensitivity * self.disturbance.noise_m2_per_hz(frequency_hz);
        [floor, noise, floor + loop_gain.norm_sqr() * noise]
    }
}

/// The spectrum of the error that the model has with the recorded reference.
fn reference_part(
    closed_loop: &ClosedLoop,
    signals: &ClosedSignals,
    steady: usize,
    welch: &Welch,
    bands: &[Range<usize>],
) -> Vec<f64> {
    let reference_m = &signals.reference_m;
    let positions_m = closed_loop.simulate(reference_m.len(), |tick| reference_m[tick]);
    let errors = reference_m.iter().zip(&positions_m).map(|(r, y)| r - y);
    let errors: Vec<f64> = errors.skip(steady).collect();
    // A constant error has no spectrum.
    match welch.spectrum(&errors) {
        Ok(spectra) => averages(&spectra.output, bands),
        Err(_) => vec![0.0; bands.len()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_all_bins_once() {
        let welch = Welch {
            segment: 10_000,
            rate_hz: 5000.0,
        };
        let bands = welch.bands();
        let bins: Vec<usize> = bands.iter().cloned().flatten().collect();
        assert_eq!(bins, (FIRST_BIN..5000).collect::<Vec<_>>());
        assert!(bands.len() < 300, "{}", bands.len());
        assert_eq!(welch.centre_hz(&(2..3)), 1.0);
    }

    #[test]
    fn window_of_the_prediction_is_that_of_hann() {
        for (k, value) in WINDOW.iter().enumerate() {
            let x = k as f64 / STEPS_PER_BIN as f64;
            let sinc = match k {
                0 => 1.0,
                _ => (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x),
            };
            // At one bin both sine and denominator are zero; the limit of the ratio is 1/2.
            let expected = if x == 1.0 {
                0.25
            } else {
                (sinc / (1.0 - x * x)).powi(2)
            };
            assert!(
                (value - expected).abs() < 1e-4,
                "{x}: {value} for {expected}"
            );
        }
    }

    #[test]
    fn quadrature_keeps_a_constant_and_a_linear_spectrum() {
        let welch = Welch {
            segment: 1000,
            rate_hz: 1000.0,
        };
        for band in [2..3, 10..12, 40..90] {
            let points = welch.quadrature(&band);
            let sum: f64 = points.iter().map(|(_, weight)| weight).sum();
            let mean_hz: f64 = points.iter().map(|(hz, weight)| hz * weight).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{band:?}: {sum}");
            assert!(
                (mean_hz - welch.centre_hz(&band)).abs() < 1e-9,
                "{band:?}: {mean_hz}"
            );
        }
    }

    #[test]
    fn single_bins_are_independent_and_neighbours_are_not() {
        assert_eq!(independent_bins(1), 1.0);
        // Many bins: 1 + 2 (4/9 + 1/36) = 1.9444.
        assert!((independent_bins(100_000) / 100_000.0 - 1.0 / 1.9444).abs() < 1e-4);
    }
}

//! Gain and phase of a closed loop at the frequency of a sine reference, by least squares.
//!
//! ```text
//!  x(t) = a cos(w t) - b sin(w t) + c     for reference and position       X = a + j b
//!  T(j w) = Y/R                           gain |T|, phase arg T, negative for a lag
//! ```
//!
//! The constant takes the rest position. The residual is the part of the position that is neither sine nor constant: disturbance, noise
//! and distortion. The standard deviations come from the scatter of the estimates of blocks of whole periods, so the noise may have
//! any spectrum.

use nalgebra::{Complex, Matrix3, Vector3};
use serde::Serialize;

use bench_base::units::rad_s;

/// Shortest block in seconds.
const MIN_BLOCK_S: f64 = 0.1;
/// Fewest blocks whose scatter gives a standard deviation.
const MIN_BLOCKS: usize = 3;
/// Fewest ticks of an estimate: three unknowns, and a residual.
const MIN_TICKS: u64 = 8;

/// The measured response to a sine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SineResponse {
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// Amplitude of the position over that of the reference.
    pub gain: f64,
    /// Its standard deviation; absent with fewer than three periods.
    pub gain_sigma: Option<f64>,
    /// Phase of the position relative to the reference in degrees, negative for a lag.
    pub phase_deg: f64,
    /// Its standard deviation.
    pub phase_sigma_deg: Option<f64>,
    /// RMS of the position without the sine and without its mean, in metres.
    pub residual_rms_m: f64,
}

/// Sums over the ticks of a sine.
pub(super) struct SineMeter {
    frequency_hz: f64,
    cycles_per_tick: f64,
    block_ticks: u64,
    whole: Sums,
    block: Sums,
    blocks: Vec<Complex<f64>>,
}

impl SineMeter {
    /// A meter for a loop of `rate_hz`.
    pub(super) fn new(frequency_hz: f64, rate_hz: f64) -> SineMeter {
        let periods = libm::ceil(MIN_BLOCK_S * frequency_hz).max(1.0);
        SineMeter {
            frequency_hz,
            cycles_per_tick: frequency_hz / rate_hz,
            block_ticks: libm::round(periods * rate_hz / frequency_hz) as u64,
            whole: Sums::default(),
            block: Sums::default(),
            blocks: Vec::new(),
        }
    }

    /// Adds reference and position in metres at a tick; the tick from which ticks are counted has no effect.
    pub(super) fn push(&mut self, tick: u64, reference_m: f64, position_m: f64) {
        let cycles = tick as f64 * self.cycles_per_tick;
        let (sine, cosine) = libm::sincos(rad_s(cycles - libm::floor(cycles)));
        let basis = Vector3::new(cosine, -sine, 1.0);
        for sums in [&mut self.whole, &mut self.block] {
            sums.push(basis, reference_m, position_m);
        }
        if self.block.ticks >= self.block_ticks {
            let block = std::mem::take(&mut self.block);
            self.blocks.extend(block.fit().map(|fit| fit.response()));
        }
    }

    /// The response; `None` with too few ticks, or without a sine in the reference.
    pub(super) fn response(&self) -> Option<SineResponse> {
        let fit = self.whole.fit()?;
        let response = fit.response();
        if !(response.re.is_finite() && response.im.is_finite()) {
            return None;
        }
        let sigma = self.relative_sigma(response);
        let gain = libm::hypot(response.re, response.im);
        Some(SineResponse {
            frequency_hz: self.frequency_hz,
            gain,
            gain_sigma: sigma.map(|sigma| gain * sigma.re),
            phase_deg: libm::atan2(response.im, response.re).to_degrees(),
            phase_sigma_deg: sigma.map(|sigma| sigma.im.to_degrees()),
            residual_rms_m: self.whole.residual_rms_m(&fit),
        })
    }

    /// Standard deviations of the mean of all blocks, relative to the response: real part for the gain, imaginary part for the phase
    /// in radians.
    fn relative_sigma(&self, response: Complex<f64>) -> Option<Complex<f64>> {
        let count = self.blocks.len();
        if count < MIN_BLOCKS {
            return None;
        }
        let relative: Vec<Complex<f64>> =
            self.blocks.iter().map(|block| block / response).collect();
        let mean = relative.iter().sum::<Complex<f64>>() / count as f64;
        let squares = relative.iter().map(|ratio| ratio - mean);
        let (re, im) = squares.fold((0.0, 0.0), |(re, im), d| {
            (re + d.re * d.re, im + d.im * d.im)
        });
        let freedoms = (count * (count - 1)) as f64;
        Some(Complex::new(
            libm::sqrt(re / freedoms),
            libm::sqrt(im / freedoms),
        ))
    }
}

/// Sums of the normal equations of reference and position.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    ticks: u64,
    normal: Matrix3<f64>,
    reference: Vector3<f64>,
    position: Vector3<f64>,
    position_square_m2: f64,
    /// Subtracted from each position, so that the squares have no large constant part.
    origin_m: f64,
}

/// Coefficients a, b and c of reference and position.
struct Fit {
    reference: Vector3<f64>,
    position: Vector3<f64>,
}

impl Sums {
    fn push(&mut self, basis: Vector3<f64>, reference_m: f64, position_m: f64) {
        if !(reference_m.is_finite() && position_m.is_finite()) {
            return;
        }
        if self.ticks == 0 {
            self.origin_m = reference_m;
        }
        let (reference_m, position_m) = (reference_m - self.origin_m, position_m - self.origin_m);
        self.ticks += 1;
        self.normal += basis * basis.transpose();
        self.reference += basis * reference_m;
        self.position += basis * position_m;
        self.position_square_m2 += position_m * position_m;
    }

    fn fit(&self) -> Option<Fit> {
        if self.ticks < MIN_TICKS {
            return None;
        }
        let decomposed = self.normal.lu();
        Some(Fit {
            reference: decomposed.solve(&self.reference)?,
            position: decomposed.solve(&self.position)?,
        })
    }

    /// The sum of squares that the fit leaves, over the degrees of freedom.
    fn residual_rms_m(&self, fit: &Fit) -> f64 {
        let square_m2 = self.position_square_m2 - fit.position.dot(&self.position);
        libm::sqrt(square_m2.max(0.0) / (self.ticks - 3) as f64)
    }
}

impl Fit {
    /// Y/R.
    fn response(&self) -> Complex<f64> {
        let sine = |x: &Vector3<f64>| Complex::new(x[0], x[1]);
        sine(&self.position) / sine(&self.reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const RATE_HZ: f64 = 5000.0;

    fn measured(frequency_hz: f64, ticks: u64, position_m: impl Fn(f64) -> f64) -> SineResponse {
        let mut meter = SineMeter::new(frequency_hz, RATE_HZ);
        for tick in 0..ticks {
            let time_s = tick as f64 / RATE_HZ;
            let reference_m = 3e-4 + 2e-5 * (TAU * frequency_hz * time_s).sin();
            meter.push(tick, reference_m, position_m(time_s));
        }
        meter.response().unwrap()
    }

    #[test]
    fn finds_gain_and_phase_of_a_sine_with_an_offset() {
        // 2.345 periods of 1.17 Hz: the constant must not disturb the sine.
        let position = |t: f64| 3.1e-4 + 0.8 * 2e-5 * (TAU * 1.17 * t - 0.3).sin();
        let found = measured(1.17, 10_021, position);
        // Squares of 2e-5 m over 1e4 ticks, rounded at 1e-16: residuals below sqrt(1e-16) 2e-5 = 2e-13 m.
        assert!((found.gain - 0.8).abs() < 1e-9, "{found:?}");
        assert!(
            (found.phase_deg + 0.3f64.to_degrees()).abs() < 1e-7,
            "{found:?}"
        );
        assert!(found.residual_rms_m < 1e-12, "{found:?}");
        assert_eq!(found.gain_sigma, None);
    }

    #[test]
    fn residual_is_the_part_at_other_frequencies() {
        // A harmonic of 1e-7 m over whole periods is orthogonal to the sine: its RMS is 1e-7/sqrt(2).
        let position = |t: f64| 2e-5 * (TAU * 5.0 * t).sin() + 1e-7 * (TAU * 15.0 * t).cos();
        let found = measured(5.0, 20_000, position);
        assert!(
            (found.residual_rms_m / (1e-7 * 0.5f64.sqrt()) - 1.0).abs() < 1e-3,
            "{found:?}"
        );
        assert!((found.gain - 1.0).abs() < 1e-9, "{found:?}");
        // Every block has the same harmonic.
        assert!(found.gain_sigma.unwrap() < 1e-9, "{found:?}");
    }

    #[test]
    fn scatter_of_the_blocks_gives_the_standard_deviation() {
        // Gains 0.9 and 1.1 in alternating periods of 50 Hz in blocks of five: the deviation of each is 0.1, and that of the mean
        // of n blocks 0.1/sqrt(n - 1).
        let position = |t: f64| {
            let block = (t / 0.1 + 1e-9).floor();
            let gain = if block % 2.0 == 0.0 { 0.9 } else { 1.1 };
            gain * 2e-5 * (TAU * 50.0 * t).sin()
        };
        let found = measured(50.0, 500 * 20, position);
        let expected = 0.1 / 19f64.sqrt();
        assert!(
            (found.gain_sigma.unwrap() / expected - 1.0).abs() < 1e-6,
            "{found:?}"
        );
        assert!(found.phase_sigma_deg.unwrap() < 1e-6, "{found:?}");
    }
}

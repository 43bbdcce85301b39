//! The spectra of what moves the reading of the simulated rig without a command: floor and probe.
//!
//! ```text
//!  floor line:  S_a(f) = 2 a^2/(zeta w0) |B(j w)|^2,     B = 2 zeta w0 s/(s^2 + 2 zeta w0 s + w0^2)      in (m/s^2)^2/Hz
//!  floor:       S_d(f) = |G(j w)|^2 sinc^2(f T) sum of S_a,    G = -sum over modes of c g/(s^2 + 2 zeta w s + w^2)
//!  probe:       S_n(f) = 2 (sigma^2 + q^2/12)/rate
//! ```
//!
//! All are one-sided: the integral over f from 0 is the variance. a is the RMS of the line, because the integral of |B|^2 over f is
//! zeta w0/2; c and g are the gains of a mode from its coordinate to the probe and from the acceleration of the floor. The acceleration is held
//! over a tick T. The error of quantisation with the step q is uniform and white if the noise sigma is at least half of q (B. Widrow,
//! I. Kollar, Quantization Noise, 2008). A probe that is slower than the loop holds its readings, which multiplies S_n by
//! sinc^2(f/rate).

use std::f64::consts::PI;

use nalgebra::Complex;

use super::modes;
use bench_base::units::rad_s;
use bench_config::Config;
use bench_plant::FloorLine;
use bench_plant::{Mode, PlantError};

/// One-sided spectra of the simulated rig at rest, in m^2/Hz at the probe.
#[derive(Clone, Debug)]
pub struct DisturbanceSpectra {
    modes: Vec<Mode>,
    floor: Vec<FloorLine>,
    noise_m2: f64,
    /// Rate of independent readings in hertz.
    reading_hz: f64,
    rate_hz: f64,
}

impl DisturbanceSpectra {
    /// The spectra of the configured rig.
    ///
    /// # Errors
    /// When the plant has no modes.
    pub fn of(config: &Config) -> Result<DisturbanceSpectra, PlantError> {
        let (sim, rate_hz) = (&config.sim, config.servo.rate_hz);
        let quantum_m = sim.probe_quantisation_m;
        let probe_hz = config.probe.rate_hz.unwrap_or(rate_hz);
        Ok(DisturbanceSpectra {
            modes: modes(&config.plant, sim)?,
            floor: sim.floor.clone(),
            noise_m2: sim.probe_noise_rms_m * sim.probe_noise_rms_m + quantum_m * quantum_m / 12.0,
            reading_hz: probe_hz.min(rate_hz),
            rate_hz,
        })
    }

    /// The displacement that the floor causes without control, at a frequency above 0.
    pub fn floor_m2_per_hz(&self, frequency_hz: f64) -> f64 {
        let lines = self.floor.iter();
        let acceleration: f64 = lines.map(|line| line_spectrum(line, frequency_hz)).sum();
        let s = Complex::new(0.0, rad_s(frequency_hz));
        let modes = self.modes.iter();
        let response: Complex<f64> = modes
            .map(|mode| mode.resonance(s) * (mode.sensor_gain * mode.floor_gain))
            .sum();
        acceleration * response.norm_sqr() * squared(sinc(frequency_hz / self.rate_hz))
    }

    /// The error of a reading, below half the rate of the loop.
    pub fn noise_m2_per_hz(&self, frequency_hz: f64) -> f64 {
        let white = 2.0 * self.noise_m2 / self.reading_hz;
        if self.reading_hz < self.rate_hz {
            white * squared(sinc(frequency_hz / self.reading_hz))
        } else {
            white
        }
    }
}

fn squared(x: f64) -> f64 {
    x * x
}

/// Spectrum of the acceleration of a line in (m/s^2)^2/Hz.
fn line_spectrum(line: &FloorLine, frequency_hz: f64) -> f64 {
    let (w0, w) = (rad_s(line.frequency_hz), rad_s(frequency_hz));
    let (zeta, rms) = (line.damping_ratio, line.acceleration_rms_m_per_s2);
    let damping = 2.0 * zeta * w0 * w;
    let stiffness = w0 * w0 - w * w;
    let band_pass = damping * damping / (stiffness * stiffness + damping * damping);
    2.0 * rms * rms / (zeta * w0) * band_pass
}

/// sin(pi x)/(pi x).
fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        libm::sin(PI * x) / (PI * x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Source, load};

    #[test]
    fn integral_of_a_line_is_its_mean_square() {
        let line = FloorLine {
            frequency_hz: 70.0,
            damping_ratio: 0.02,
            acceleration_rms_m_per_s2: 1.79e-3,
        };
        let step_hz = 0.05;
        let frequencies = (0..2_000_000).map(|k| (f64::from(k) + 0.5) * step_hz);
        let variance: f64 = frequencies.map(|f| line_spectrum(&line, f) * step_hz).sum();
        // Above 100 kHz are 2/pi 2 zeta f0/100 kHz = 2e-5 of the integral; the midpoint rule in a line 2.8 Hz wide is exact to 1e-6.
        assert!(
            (variance / 1.79e-3f64.powi(2) - 1.0).abs() < 1e-4,
            "{variance}"
        );
    }

    #[test]
    fn integral_of_the_noise_up_to_half_the_rate_is_its_variance() {
        let mut config = load(&Source::default()).unwrap();
        config.sim.probe_noise_rms_m = 40e-9;
        config.sim.probe_quantisation_m = 30e-9;
        let spectra = DisturbanceSpectra::of(&config).unwrap();
        let variance = spectra.noise_m2_per_hz(100.0) * config.servo.rate_hz / 2.0;
        let expected = 40e-9f64.powi(2) + 30e-9f64.powi(2) / 12.0;
        assert!((variance / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_quasi_static_floor_moves_the_stage_by_mass_over_stiffness() {
        // Far below the modes G = -sum of c g/w^2, which is the static displacement per acceleration.
        let config = load(&Source::default()).unwrap();
        let spectra = DisturbanceSpectra::of(&config).unwrap();
        let modes = spectra.modes.iter().filter(|mode| mode.omega_rad_s > 0.0);
        let compliance: f64 = modes
            .map(|mode| mode.sensor_gain * mode.floor_gain / mode.omega_rad_s.powi(2))
            .sum();
        let lines = spectra.floor.iter();
        let acceleration: f64 = lines.map(|line| line_spectrum(line, 0.05)).sum();
        let ratio = spectra.floor_m2_per_hz(0.05) / (acceleration * compliance * compliance);
        // (f/f1)^2 = (0.05/23)^2 = 5e-6, twice in the square.
        assert!((ratio - 1.0).abs() < 3e-5, "{ratio}");
    }
}

//! What disturbs the position: lines of the floor's acceleration, and noise of the probe.
//!
//! ```text
//!  Phi_d = |G_f|^2 sum of a_i^2/(pi zeta_i w_i) |2 zeta_i w_i s/(s^2 + 2 zeta_i w_i s + w_i^2)|^2
//!  Phi_n = sigma_n^2 T/pi
//! ```
//!
//! G_f is the response of the position to the acceleration of the floor; a_i, w_i and zeta_i are those of the lines of the floor.
//! The integral of a band-pass |2 zeta w s/(s^2 + 2 zeta w s + w^2)|^2 over w from 0 on is pi zeta w.

use nalgebra::Complex;

use super::disturbance_spectrum::DisturbanceSpectrum;
use bench_base::units::rad_s;
use bench_plant::FloorLine;
use bench_plant::Mode;

/// Variances in m^2 that belong to one frequency of a grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Variances {
    /// Of the position in open loop.
    pub disturbance_m2: f64,
    /// Of the reading.
    pub noise_m2: f64,
}

/// What moves the stage.
#[derive(Clone, Debug, PartialEq)]
pub enum PositionDisturbance {
    /// Lines of the acceleration of the floor.
    Floor(Vec<FloorLine>),
    /// A measured spectrum of the position, the same for every plant.
    Measured(DisturbanceSpectrum),
}

impl Default for PositionDisturbance {
    fn default() -> PositionDisturbance {
        PositionDisturbance::Floor(Vec::new())
    }
}

/// What disturbs the position and its reading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// What moves the stage.
    pub position: PositionDisturbance,
    /// RMS of the noise of a reading in metres.
    pub noise_rms_m: f64,
}

impl Disturbance {
    /// Frequency in rad/s and damping ratio of each line.
    pub fn features(&self) -> Vec<(f64, f64)> {
        match &self.position {
            PositionDisturbance::Floor(lines) => lines
                .iter()
                .map(|line| (rad_s(line.frequency_hz), line.damping_ratio))
                .collect(),
            PositionDisturbance::Measured(_) => Vec::new(),
        }
    }

    /// The variances at each frequency of a rising grid, for a loop of `period_s`.
    pub fn variances(&self, modes: &[Mode], omega_rad_s: &[f64], period_s: f64) -> Vec<Variances> {
        let noise_density = self.noise_rms_m * self.noise_rms_m * period_s / std::f64::consts::PI;
        let cells = cells(omega_rad_s);
        let points = omega_rad_s.iter().zip(cells);
        points
            .map(|(w, (from, to))| Variances {
                disturbance_m2: match &self.position {
                    PositionDisturbance::Floor(lines) => density_m2(lines, modes, *w) * (to - from),
                    PositionDisturbance::Measured(spectrum) => spectrum.variance_m2(from, to),
                },
                noise_m2: noise_density * (to - from),
            })
            .collect()
    }
}

/// Phi_d of the lines of the floor in m^2 s/rad.
fn density_m2(lines: &[FloorLine], modes: &[Mode], omega_rad_s: f64) -> f64 {
    let s = Complex::new(0.0, omega_rad_s);
    let moved: Complex<f64> = modes
        .iter()
        .map(|mode| mode.resonance(s) * (mode.sensor_gain * mode.floor_gain))
        .sum();
    let acceleration: f64 = lines.iter().map(|line| line_density(line, s)).sum();
    moved.norm_sqr() * acceleration
}

/// Density of a line's acceleration in (m/s^2)^2 s/rad.
fn line_density(line: &FloorLine, s: Complex<f64>) -> f64 {
    let (w, zeta) = (rad_s(line.frequency_hz), line.damping_ratio);
    let linear = s * (2.0 * zeta * w);
    let band_pass = linear / (s * s + linear + w * w);
    let rms = line.acceleration_rms_m_per_s2;
    rms * rms / (std::f64::consts::PI * zeta * w) * band_pass.norm_sqr()
}

/// The range of frequencies that belongs to each point by the trapezoidal rule: up to the middle between neighbours.
fn cells(grid: &[f64]) -> Vec<(f64, f64)> {
    let last = grid.len().saturating_sub(1);
    let cell = |i: usize| {
        let (before, after) = (grid[i.saturating_sub(1)], grid[(i + 1).min(last)]);
        (0.5 * (before + grid[i]), 0.5 * (grid[i] + after))
    };
    (0..grid.len()).map(cell).collect()
}

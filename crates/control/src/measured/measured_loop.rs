//! The loop of a measured plant and a control law.

use nalgebra::Complex;

use super::error::MeasuredLoopError;
use super::point::ResponsePoint;
use super::smoothing::SmoothResponse;
use crate::landmarks::lowest;
use bench_base::units::hz;

/// Step of a numerical derivative as a ratio of frequency; measured points are about ten times farther apart.
const STEP_RATIO: f64 = 1e-4;

/// L = P C with a measured P.
pub struct MeasuredLoop<'a> {
    plant: SmoothResponse,
    law: &'a dyn Fn(f64) -> Complex<f64>,
    /// Rising frequencies at which every crossing and extremum shows.
    grid_rad_s: Vec<f64>,
}

impl<'a> MeasuredLoop<'a> {
    /// The loop of a plant, measured at rising frequencies, and a control law C(w) in amperes per metre. `further_rad_s` are more
    /// frequencies at which the loop is evaluated: the law may have resonances between those of the measurement.
    ///
    /// # Errors
    /// Less than three points, or points that are not finite numbers of rising frequency.
    pub fn new(
        points: &[ResponsePoint],
        law: &'a dyn Fn(f64) -> Complex<f64>,
        further_rad_s: &[f64],
    ) -> Result<MeasuredLoop<'a>, MeasuredLoopError> {
        check(points)?;
        let few = MeasuredLoopError::TooFew(points.len());
        let plant = SmoothResponse::new(points).ok_or(few)?;
        let (low, high) = plant.band_rad_s();
        let further = further_rad_s.iter().copied();
        let inside = further.filter(|w| (low..=high).contains(w));
        let mut grid_rad_s: Vec<f64> = plant.frequencies().chain(inside).collect();
        grid_rad_s.sort_by(f64::total_cmp);
        grid_rad_s.dedup();
        Ok(MeasuredLoop {
            plant,
            law,
            grid_rad_s,
        })
    }

    /// The first and the last measured frequency in rad/s.
    pub fn band_rad_s(&self) -> (f64, f64) {
        self.plant.band_rad_s()
    }

    /// Rising frequencies in rad/s at which every crossing and extremum shows.
    pub(super) fn grid_rad_s(&self) -> &[f64] {
        &self.grid_rad_s
    }

    /// P.
    pub fn plant(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant.at(omega_rad_s)
    }

    /// Standard deviation of the real and of the imaginary part of P.
    pub fn plant_sigma(&self, omega_rad_s: f64) -> f64 {
        (0.5 * self.plant.variance(omega_rad_s)).sqrt()
    }

    /// The smallest |1 + L| - `sigmas` sigma |C| over the band, with sigma the standard deviation of one component of P, and its
    /// frequency in rad/s. An error that is not a number makes the distance minus infinity.
    pub fn least_distance(&self, sigmas: f64) -> (f64, f64) {
        let distance = |w: f64| {
            let radius = sigmas * self.plant_sigma(w) * self.law(w).norm();
            (self.loop_gain(w) + 1.0).norm() - radius
        };
        let least = lowest(&distance, &self.grid_rad_s);
        (least.value, least.rad_s)
    }

    /// C.
    pub(super) fn law(&self, omega_rad_s: f64) -> Complex<f64> {
        (self.law)(omega_rad_s)
    }

    /// L = P C.
    pub fn loop_gain(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant(omega_rad_s) * self.law(omega_rad_s)
    }

    /// Standard deviation of the real and of the imaginary part of dL/L.
    pub(super) fn relative_sigma(&self, omega_rad_s: f64) -> f64 {
        let variance = self.plant.variance(omega_rad_s);
        (0.5 * variance).sqrt() / self.plant(omega_rad_s).norm()
    }

    /// d ln L/dw: the real part is that of ln |L|, the imaginary part that of arg L.
    pub(super) fn log_slope(&self, omega_rad_s: f64) -> Complex<f64> {
        let (low, high) = self.band_rad_s();
        let from = (omega_rad_s * (1.0 - STEP_RATIO)).max(low);
        let to = (omega_rad_s * (1.0 + STEP_RATIO)).min(high);
        (self.loop_gain(to) / self.loop_gain(from)).ln() / (to - from)
    }
}

/// Refuses points that are not finite or do not rise in frequency.
fn check(points: &[ResponsePoint]) -> Result<(), MeasuredLoopError> {
    let mut before = 0.0;
    for point in points {
        let is_finite = point.response.norm().is_finite()
            && point.variance.is_finite()
            && point.resolution_rad_s.is_finite();
        let rises = point.omega_rad_s > before && point.omega_rad_s.is_finite();
        if !(is_finite && rises && point.variance >= 0.0) {
            return Err(MeasuredLoopError::Point(hz(point.omega_rad_s)));
        }
        before = point.omega_rad_s;
    }
    Ok(())
}

//! Margins and peaks of a measured loop with their standard deviations: formulas in the module's documentation.

use std::ops::Deref;

use nalgebra::Complex;
use serde::Serialize;

use super::measured_loop::MeasuredLoop;
use crate::landmarks::{Landmarks, Peak, landmarks, peak, phase_margin_deg};
use crate::loop_margins::{Crossing, LoopMargins};
use bench_base::estimate::Estimate;

/// Decibels of a natural logarithm.
const DB_PER_NEPER: f64 = 20.0 / std::f64::consts::LN_10;

/// A frequency at which the measured |L| passes through 1.
pub type MeasuredCrossing = Crossing<Estimate>;

/// Margins of a measured loop within the measured band. In JSON each is an object of `value`, `low` and `high`, the limits of its
/// 95 % confidence interval, and `null` where there is no such crossing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeasuredMargins {
    /// The figures that a model has as well.
    #[serde(flatten)]
    pub loop_margins: LoopMargins<Estimate>,
    /// All crossings of |L| = 1.
    pub crossings: Vec<MeasuredCrossing>,
}

/// The largest magnitudes of the closed loop within the measured band.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LoopPeaks {
    /// max |T|, T = L/(1 + L), from reference to position.
    pub complementary_peak: Estimate,
    /// max |C S| in amperes per metre, from noise or reference to current.
    pub control_peak_a_per_m: Estimate,
    /// max |P S| in metres per ampere, from a disturbance in amperes at the plant's input to the position.
    pub disturbance_peak_m_per_a: Estimate,
}

/// The figures of the loop are read as if they were fields of the margins.
impl Deref for MeasuredMargins {
    type Target = LoopMargins<Estimate>;

    fn deref(&self) -> &LoopMargins<Estimate> {
        &self.loop_margins
    }
}

impl MeasuredMargins {
    /// The margins of a loop.
    pub fn of(measured: &MeasuredLoop<'_>) -> MeasuredMargins {
        let response = |w: f64| measured.loop_gain(w);
        let places = landmarks(&response, measured.grid_rad_s(), &[]);
        let crossings = crossings(measured, &places);
        let phase_margin = crossings
            .iter()
            .map(|crossing| (crossing.rad_s.value, crossing.phase_margin_deg));
        let phase_margin = smallest(phase_margin);
        let gain_margins = places.phase_crossings_rad_s.iter();
        let gain_margins = gain_margins.map(|w| (*w, gain_margin_db(measured, *w)));
        let gain_margins: Vec<(f64, Estimate)> = gain_margins.collect();
        let gain_margin = smallest(gain_margins.iter().copied());
        let upper = smallest(
            gain_margins
                .iter()
                .copied()
                .filter(|(_, db)| db.value > 0.0),
        );
        let lower = smallest(
            gain_margins
                .iter()
                .copied()
                .filter(|(_, db)| db.value < 0.0),
        );
        let delay_margin = smallest(crossings.iter().map(delay_margin_s));
        let crossover = at(&crossings, places.crossover_rad_s);
        let modulus_margin = modulus_margin(measured, places.sensitivity_peak);
        let loop_margins = LoopMargins {
            crossover_rad_s: crossover.map(|crossing| crossing.rad_s),
            phase_margin_deg: phase_margin.map(|(_, deg)| deg),
            phase_margin_rad_s: phase_margin.map(|(rad_s, _)| rad_s),
            gain_margin_db: gain_margin.map(|(_, db)| db),
            gain_margin_rad_s: gain_margin.map(|(rad_s, _)| rad_s),
            upper_gain_margin_db: upper.map(|(_, db)| db),
            upper_gain_margin_rad_s: upper.map(|(rad_s, _)| rad_s),
            lower_gain_margin_db: lower.map(|(_, db)| db),
            lower_gain_margin_rad_s: lower.map(|(rad_s, _)| rad_s),
            delay_margin_s: delay_margin.map(|(_, delay_s)| delay_s),
            delay_margin_rad_s: delay_margin.map(|(rad_s, _)| rad_s),
            modulus_margin,
            sensitivity_peak_db: Estimate {
                value: -DB_PER_NEPER * libm::log(modulus_margin.value),
                sigma: DB_PER_NEPER * modulus_margin.sigma / modulus_margin.value,
            },
            sensitivity_peak_rad_s: places.sensitivity_peak.rad_s,
            sensitivity_bandwidth_rad_s: places
                .sensitivity_bandwidth_rad_s
                .map(|w| sensitivity_bandwidth(measured, w)),
        };
        MeasuredMargins {
            loop_margins,
            crossings,
        }
    }

    /// The crossing of |L| = 1 at the crossover.
    pub fn crossover(&self) -> Option<&MeasuredCrossing> {
        at(&self.crossings, self.crossover_rad_s.map(|w| w.value))
    }
}

/// The crossing at a frequency.
fn at(crossings: &[MeasuredCrossing], omega_rad_s: Option<f64>) -> Option<&MeasuredCrossing> {
    let mut crossings = crossings.iter();
    crossings.find(|crossing| Some(crossing.rad_s.value) == omega_rad_s)
}

impl LoopPeaks {
    /// The peaks of a loop.
    pub fn of(measured: &MeasuredLoop<'_>) -> LoopPeaks {
        let sensitivity = |w: f64| (measured.loop_gain(w) + 1.0).inv();
        let by_s = |w: f64| sensitivity(w).norm();
        let by_t = |w: f64| (Complex::new(1.0, 0.0) - sensitivity(w)).norm();
        let complementary = |w: f64| measured.loop_gain(w) * sensitivity(w);
        let control = |w: f64| measured.law(w) * sensitivity(w);
        let disturbance = |w: f64| measured.plant(w) * sensitivity(w);
        LoopPeaks {
            complementary_peak: magnitude_peak(measured, &complementary, &by_s),
            control_peak_a_per_m: magnitude_peak(measured, &control, &by_t),
            disturbance_peak_m_per_a: magnitude_peak(measured, &disturbance, &by_s),
        }
    }
}

/// The largest |X| with d ln X = e times a factor of the magnitude `factor`.
fn magnitude_peak(
    measured: &MeasuredLoop<'_>,
    response: &dyn Fn(f64) -> Complex<f64>,
    factor: &dyn Fn(f64) -> f64,
) -> Estimate {
    let Peak { rad_s, value } = peak(&|w| response(w).norm(), measured.grid_rad_s());
    Estimate {
        value,
        sigma: value * factor(rad_s) * measured.relative_sigma(rad_s),
    }
}

fn crossings(measured: &MeasuredLoop<'_>, places: &Landmarks) -> Vec<MeasuredCrossing> {
    let rad_s = places.crossings_rad_s.iter();
    rad_s.map(|w| crossing(measured, *w)).collect()
}

/// The crossing of |L| = 1 at a frequency.
fn crossing(measured: &MeasuredLoop<'_>, omega_rad_s: f64) -> MeasuredCrossing {
    let (slope, sigma) = slope_and_sigma(measured, omega_rad_s);
    MeasuredCrossing {
        rad_s: Estimate {
            value: omega_rad_s,
            sigma: sigma / slope.re.abs(),
        },
        phase_margin_deg: Estimate {
            value: phase_margin_deg(measured.loop_gain(omega_rad_s)),
            sigma: (sigma * libm::hypot(1.0, slope.im / slope.re)).to_degrees(),
        },
    }
}

/// -20 log10 |L| where arg L = -pi.
fn gain_margin_db(measured: &MeasuredLoop<'_>, omega_rad_s: f64) -> Estimate {
    let (slope, sigma) = slope_and_sigma(measured, omega_rad_s);
    Estimate {
        value: -DB_PER_NEPER * libm::log(measured.loop_gain(omega_rad_s).norm()),
        sigma: DB_PER_NEPER * sigma * libm::hypot(1.0, slope.re / slope.im),
    }
}

/// |1 + L| at the peak of |S|.
fn modulus_margin(measured: &MeasuredLoop<'_>, peak: Peak) -> Estimate {
    let loop_gain = measured.loop_gain(peak.rad_s).norm();
    Estimate {
        value: 1.0 / peak.value,
        sigma: loop_gain * measured.relative_sigma(peak.rad_s),
    }
}

/// A frequency at which |S| = 1/sqrt(2). d ln S/dw = -T d ln L/dw.
fn sensitivity_bandwidth(measured: &MeasuredLoop<'_>, omega_rad_s: f64) -> Estimate {
    let (slope, sigma) = slope_and_sigma(measured, omega_rad_s);
    let loop_gain = measured.loop_gain(omega_rad_s);
    let complementary = loop_gain / (loop_gain + 1.0);
    Estimate {
        value: omega_rad_s,
        sigma: sigma * complementary.norm() / (complementary * slope).re.abs(),
    }
}

/// d ln L/dw, and the standard deviation of either part of dL/L.
fn slope_and_sigma(measured: &MeasuredLoop<'_>, omega_rad_s: f64) -> (Complex<f64>, f64) {
    let slope = measured.log_slope(omega_rad_s);
    (slope, measured.relative_sigma(omega_rad_s))
}

/// The frequency of a crossing and the additional delay with which L is -1 there: phi/w with the phase margin phi from 0 to 360 deg.
/// The errors of phase margin and frequency have a correlation that is not known; their sum bounds the standard deviation.
fn delay_margin_s(crossing: &MeasuredCrossing) -> (f64, Estimate) {
    let (margin_deg, rad_s) = (crossing.phase_margin_deg, crossing.rad_s);
    let delay_s = margin_deg.value.rem_euclid(360.0).to_radians() / rad_s.value;
    let sigma = margin_deg.sigma.to_radians() / rad_s.value + delay_s * rad_s.sigma / rad_s.value;
    let delay = Estimate {
        value: delay_s,
        sigma,
    };
    (rad_s.value, delay)
}

/// The frequency and the estimate of smallest magnitude.
fn smallest(estimates: impl Iterator<Item = (f64, Estimate)>) -> Option<(f64, Estimate)> {
    estimates.min_by(|a, b| a.1.value.abs().total_cmp(&b.1.value.abs()))
}

#[cfg(test)]
mod tests;

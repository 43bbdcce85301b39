//! Stability margins of a loop L(jw) = P C.
//!
//! Crossover is the lowest frequency at which |L| falls through 1; the phase margin, 180 deg + arg L, is the one of
//! smallest magnitude over all crossings; the gain margin is the smallest |20 log10 |L|| over all crossings of the
//! negative real axis; the modulus margin is 1/max |S| with S = 1/(1 + L); the sensitivity bandwidth is the lowest frequency
//! at which |S| rises through 1/sqrt(2).

use nalgebra::Complex;
use serde::Serialize;

use super::landmarks::{landmarks, phase_margin_deg};
use crate::util::numeric::is_within;

/// A frequency at which |L| passes through 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Crossing {
    /// Frequency in rad/s.
    pub rad_s: f64,
    /// 180 deg + arg L there, within +-180 deg.
    pub phase_margin_deg: f64,
}

/// Margins of a loop. `null` in JSON where there is no such crossing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Margins {
    /// Lowest frequency at which |L| falls through 1.
    pub crossover_rad_s: Option<f64>,
    /// Phase margin of smallest magnitude over all crossings of |L| = 1, in degrees.
    pub phase_margin_deg: Option<f64>,
    /// Smallest gain margin over all phase crossover frequencies, in dB.
    pub gain_margin_db: Option<f64>,
    /// Frequency of this gain margin in rad/s.
    pub gain_margin_rad_s: Option<f64>,
    /// 1/max |S|: the distance of L from -1.
    pub modulus_margin: f64,
    /// 20 log10 max |S|.
    pub sensitivity_peak_db: f64,
    /// Frequency of this peak in rad/s.
    pub sensitivity_peak_rad_s: f64,
    /// Lowest frequency at which |S| rises through 1/sqrt(2).
    pub sensitivity_bandwidth_rad_s: Option<f64>,
    /// Whether all poles of the closed loop are stable.
    pub stable: bool,
    /// All crossings of |L| = 1.
    pub crossings: Vec<Crossing>,
    /// Whether sampling, delay and amplifier are neglected.
    pub continuous: bool,
}

impl Margins {
    /// Whether the modulus margin is at least `least`. One that is not a finite number is not: |S| was not found.
    pub fn has_modulus_margin(&self, least: f64) -> bool {
        self.modulus_margin.is_finite() && is_within(least, self.modulus_margin)
    }
}

/// Margins of `response`, from a rising grid that is fine enough to show every crossing. Each crossing and the peak of |S|
/// are then refined on the function itself.
pub(super) fn margins(
    response: &dyn Fn(f64) -> Complex<f64>,
    grid_rad_s: &[f64],
    stable: bool,
    continuous: bool,
) -> Margins {
    let places = landmarks(response, grid_rad_s);
    let crossings: Vec<Crossing> = places
        .crossings_rad_s
        .iter()
        .map(|&rad_s| Crossing {
            rad_s,
            phase_margin_deg: phase_margin_deg(response(rad_s)),
        })
        .collect();
    let gain_margin_db = |w: &f64| -20.0 * libm::log10(response(*w).norm());
    let gain_margins = places.phase_crossings_rad_s.iter();
    let gain_margin = gain_margins
        .map(|w| (*w, gain_margin_db(w)))
        .min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let peak = places.sensitivity_peak.value;
    Margins {
        crossover_rad_s: places.crossover_rad_s,
        phase_margin_deg: smallest(crossings.iter().map(|c| c.phase_margin_deg)),
        gain_margin_db: gain_margin.map(|(_, db)| db),
        gain_margin_rad_s: gain_margin.map(|(rad_s, _)| rad_s),
        modulus_margin: 1.0 / peak,
        sensitivity_peak_db: 20.0 * libm::log10(peak),
        sensitivity_peak_rad_s: places.sensitivity_peak.rad_s,
        sensitivity_bandwidth_rad_s: places.sensitivity_bandwidth_rad_s,
        stable,
        crossings,
        continuous,
    }
}

/// The value of smallest magnitude.
fn smallest(values: impl Iterator<Item = f64>) -> Option<f64> {
    values.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

/// A logarithmic grid, with additional points w (1 + zeta sinh x) around each resonance or antiresonance (w, zeta): they are
/// evenly spaced along its circle in the Nyquist plot.
pub fn grid(low_rad_s: f64, high_rad_s: f64, features: &[(f64, f64)]) -> Vec<f64> {
    const PER_DECADE: f64 = 400.0;
    let decades = libm::log10(high_rad_s / low_rad_s);
    let count = libm::ceil(decades * PER_DECADE) as usize;
    let mut grid: Vec<f64> = (0..=count)
        .map(|i| low_rad_s * libm::pow(10.0, decades * i as f64 / count as f64))
        .collect();
    grid.extend(features.iter().copied().flat_map(around));
    grid.retain(|w| (low_rad_s..=high_rad_s).contains(w));
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

/// Frequencies around a resonance or antiresonance.
fn around((w, zeta): (f64, f64)) -> impl Iterator<Item = f64> {
    (-240..=240).map(move |i| w * (1.0 + zeta.max(1e-6) * libm::sinh(f64::from(i) / 40.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_integrator_with_delay_has_the_margins_of_its_closed_form() {
        // L = k exp(-j w d)/(j w): crossover k, phase margin 90 deg - k d, phase crossing at pi/(2 d), gain margin
        // pi/(2 k d).
        let (k, d): (f64, f64) = (100.0, 4e-3);
        let l =
            move |w: f64| Complex::new((-w * d).cos(), (-w * d).sin()) * k / Complex::new(0.0, w);
        let found = margins(&l, &grid(0.1, 700.0, &[]), true, true);
        assert!((found.crossover_rad_s.unwrap() - k).abs() < 1e-9);
        assert!((found.phase_margin_deg.unwrap() - (90.0 - (k * d).to_degrees())).abs() < 1e-9);
        let gain_margin = 20.0 * (std::f64::consts::PI / (2.0 * k * d)).log10();
        assert!((found.gain_margin_db.unwrap() - gain_margin).abs() < 1e-9);
        let at = found.gain_margin_rad_s.unwrap();
        assert!((at - std::f64::consts::FRAC_PI_2 / d).abs() < 1e-9);
        // The peak of |S| against a brute force search in steps of 7 mrad/s.
        let (place, brute) = (1..100_000)
            .map(|i| f64::from(i) * 7e-3)
            .map(|w| (w, (l(w) + 1.0).inv().norm()))
            .fold((0.0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        assert!((found.sensitivity_peak_rad_s - place).abs() < 7e-3);
        assert!((found.modulus_margin * brute - 1.0).abs() < 1e-7);
    }

    #[test]
    fn a_loop_that_is_not_a_number_has_no_modulus_margin() {
        let unknown = |_: f64| Complex::new(f64::NAN, f64::NAN);
        let found = margins(&unknown, &grid(1.0, 100.0, &[]), true, true);
        assert!(!found.has_modulus_margin(0.0), "{found:?}");
        // L = 1 at all frequencies: S = 1/2, so the modulus margin is 2.
        let known = margins(
            &|_| Complex::new(1.0, 0.0),
            &grid(1.0, 100.0, &[]),
            true,
            true,
        );
        assert!(known.has_modulus_margin(2.0) && !known.has_modulus_margin(2.1));
    }

    #[test]
    fn a_lightly_damped_peak_between_grid_points_is_not_missed() {
        // A resonance of damping 1e-5 crosses |L| = 1 twice within 0.1 rad/s.
        let (w0, zeta) = (517.0, 1e-5);
        let l = move |w: f64| {
            Complex::new(0.01 * w0 * w0, 0.0) / Complex::new(w0 * w0 - w * w, 2.0 * zeta * w0 * w)
        };
        let found = margins(&l, &grid(1.0, 1e4, &[(w0, zeta)]), true, true);
        assert_eq!(found.crossings.len(), 2, "{:?}", found.crossings);
        // |L| = 1 at w^2 = w0^2 (1 +- 0.01), except for the effect of the damping.
        assert!((found.crossings[0].rad_s - w0 * 0.99f64.sqrt()).abs() < 1e-3);
        assert!((found.crossings[1].rad_s - w0 * 1.01f64.sqrt()).abs() < 1e-3);
    }
}

//! Stability margins of a loop L(jw) = P C.
//!
//! Crossover is the lowest frequency at which |L| falls through 1; the phase margin, 180 deg + arg L, is the one of
//! smallest magnitude over all crossings; the gain margin is the smallest |20 log10 |L|| over all crossings of the
//! negative real axis; the upper one is the smallest factor above 1, the lower one the largest factor below 1, by which L can be
//! multiplied before it reaches -1; the delay margin is the smallest phase margin over frequency, with phase margins from 0 to 360 deg;
//! the modulus margin is 1/max |S| with S = 1/(1 + L); the sensitivity bandwidth is the lowest frequency
//! at which |S| rises through 1/sqrt(2).

use std::ops::Deref;

use nalgebra::Complex;
use serde::Serialize;

use super::landmarks::{Landmarks, landmarks, phase_margin_deg};
use super::loop_margins::{Crossing, LoopMargins};
use bench_base::numeric::is_within;

/// A frequency at which L crosses the negative real axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PhaseCrossing {
    /// Frequency in rad/s.
    pub rad_s: f64,
    /// -20 log10 |L| there.
    pub gain_margin_db: f64,
}

/// The delay that L tolerates at one of its crossings of |L| = 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DelayMargin {
    /// Frequency of the crossing in rad/s.
    pub rad_s: f64,
    /// Additional delay in seconds with which L is -1 there.
    pub delay_s: f64,
}

/// Margins of a loop by its model. `null` in JSON where there is no such crossing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Margins {
    /// The figures that measured margins have as well.
    #[serde(flatten)]
    pub loop_margins: LoopMargins<f64>,
    /// Whether all poles of the closed loop are stable.
    pub stable: bool,
    /// All crossings of |L| = 1.
    pub crossings: Vec<Crossing>,
    /// All crossings of the negative real axis.
    pub phase_crossings: Vec<PhaseCrossing>,
    /// Whether sampling, delay and amplifier are neglected.
    pub continuous: bool,
}

/// The figures of the loop are read as if they were fields of the margins.
impl Deref for Margins {
    type Target = LoopMargins<f64>;

    fn deref(&self) -> &LoopMargins<f64> {
        &self.loop_margins
    }
}

impl Margins {
    /// Whether the modulus margin is at least `least`. One that is not a finite number is not: |S| was not found.
    pub fn has_modulus_margin(&self, least: f64) -> bool {
        self.modulus_margin.is_finite() && is_within(least, self.modulus_margin)
    }
}

/// What is known of a loop beside its response.
pub(super) struct Known<'a> {
    /// Rising frequencies in rad/s, fine enough to show every crossing.
    pub grid_rad_s: &'a [f64],
    /// Frequencies below and above the grid at which L is real.
    pub ends_rad_s: &'a [f64],
    /// Whether all poles of the closed loop are stable.
    pub stable: bool,
    /// Whether sampling, delay and amplifier are neglected.
    pub continuous: bool,
}

/// |L| below which its sign is that of rounding, as at half the rate if L has a zero there: no gain in use reaches -1 from there
/// (180 dB).
const NO_RESPONSE: f64 = 1e-9;

/// Margins of `response`. Each crossing and the peak of |S| are found on the grid and then refined on the function itself.
pub(super) fn margins(response: &dyn Fn(f64) -> Complex<f64>, known: &Known<'_>) -> Margins {
    let places = landmarks(response, known.grid_rad_s, known.ends_rad_s);
    let crossings = crossings(response, &places);
    let phase_crossings = phase_crossings(response, &places);
    let phase_margin = smallest(crossings.iter(), |crossing| crossing.phase_margin_deg);
    let gain_db = |crossing: &PhaseCrossing| crossing.gain_margin_db;
    let gain_margin = smallest(phase_crossings.iter(), gain_db);
    let upper = smallest(
        phase_crossings.iter().filter(|c| c.gain_margin_db > 0.0),
        gain_db,
    );
    let lower = smallest(
        phase_crossings.iter().filter(|c| c.gain_margin_db < 0.0),
        gain_db,
    );
    let delay = delay_margin(&crossings);
    let peak = places.sensitivity_peak;
    let loop_margins = LoopMargins {
        crossover_rad_s: places.crossover_rad_s,
        phase_margin_deg: phase_margin.map(|crossing| crossing.phase_margin_deg),
        phase_margin_rad_s: phase_margin.map(|crossing| crossing.rad_s),
        gain_margin_db: gain_margin.map(|crossing| crossing.gain_margin_db),
        gain_margin_rad_s: gain_margin.map(|crossing| crossing.rad_s),
        upper_gain_margin_db: upper.map(|crossing| crossing.gain_margin_db),
        upper_gain_margin_rad_s: upper.map(|crossing| crossing.rad_s),
        lower_gain_margin_db: lower.map(|crossing| crossing.gain_margin_db),
        lower_gain_margin_rad_s: lower.map(|crossing| crossing.rad_s),
        delay_margin_s: delay.map(|margin| margin.delay_s),
        delay_margin_rad_s: delay.map(|margin| margin.rad_s),
        modulus_margin: 1.0 / peak.value,
        sensitivity_peak_db: 20.0 * libm::log10(peak.value),
        sensitivity_peak_rad_s: peak.rad_s,
        sensitivity_bandwidth_rad_s: places.sensitivity_bandwidth_rad_s,
    };
    Margins {
        loop_margins,
        stable: known.stable,
        crossings,
        phase_crossings,
        continuous: known.continuous,
    }
}

fn crossings(response: &dyn Fn(f64) -> Complex<f64>, places: &Landmarks) -> Vec<Crossing> {
    let places = places.crossings_rad_s.iter();
    places
        .map(|&rad_s| Crossing {
            rad_s,
            phase_margin_deg: phase_margin_deg(response(rad_s)),
        })
        .collect()
}

fn phase_crossings(
    response: &dyn Fn(f64) -> Complex<f64>,
    places: &Landmarks,
) -> Vec<PhaseCrossing> {
    let places = places.phase_crossings_rad_s.iter();
    places
        .map(|&rad_s| (rad_s, response(rad_s).norm()))
        .filter(|(_, gain)| *gain > NO_RESPONSE)
        .map(|(rad_s, gain)| PhaseCrossing {
            rad_s,
            gain_margin_db: -20.0 * libm::log10(gain),
        })
        .collect()
}

/// The crossing at which the least additional delay turns L to -1.
fn delay_margin(crossings: &[Crossing]) -> Option<DelayMargin> {
    let moving = crossings.iter().filter(|crossing| crossing.rad_s > 0.0);
    let margins = moving.map(|crossing| DelayMargin {
        rad_s: crossing.rad_s,
        delay_s: crossing.phase_margin_deg.rem_euclid(360.0).to_radians() / crossing.rad_s,
    });
    margins.min_by(|a, b| a.delay_s.total_cmp(&b.delay_s))
}

/// The item with the value of smallest magnitude.
fn smallest<'a, T>(items: impl Iterator<Item = &'a T>, value: impl Fn(&T) -> f64) -> Option<&'a T> {
    items.min_by(|a, b| value(a).abs().total_cmp(&value(b).abs()))
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

/// Points for each increase of the distance from a resonance by a factor of e: their distance is at most 1/40 of that to the resonance.
const PER_E_FOLD: f64 = 40.0;
/// Distance from a resonance, relative to its frequency, beyond which the logarithmic grid is denser.
const NEAR: f64 = 0.25;

/// Frequencies around a resonance or antiresonance.
fn around((w, zeta): (f64, f64)) -> impl Iterator<Item = f64> {
    let zeta = zeta.max(1e-6);
    let reach = NEAR.max(zeta);
    let folds = libm::asinh(reach / zeta);
    let count = libm::ceil(PER_E_FOLD * folds) as i32;
    (-count..=count).map(move |i| w * (1.0 + zeta * libm::sinh(f64::from(i) / PER_E_FOLD)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(response: &dyn Fn(f64) -> Complex<f64>, grid_rad_s: &[f64]) -> Margins {
        let known = Known {
            grid_rad_s,
            ends_rad_s: &[],
            stable: true,
            continuous: true,
        };
        margins(response, &known)
    }

    #[test]
    fn an_integrator_with_delay_has_the_margins_of_its_closed_form() {
        // L = k exp(-j w d)/(j w): crossover k, phase margin 90 deg - k d, phase crossing at pi/(2 d), gain margin
        // pi/(2 k d).
        let (k, d): (f64, f64) = (100.0, 4e-3);
        let l =
            move |w: f64| Complex::new((-w * d).cos(), (-w * d).sin()) * k / Complex::new(0.0, w);
        let found = of(&l, &grid(0.1, 700.0, &[]));
        assert!((found.crossover_rad_s.unwrap() - k).abs() < 1e-9);
        assert!((found.phase_margin_deg.unwrap() - (90.0 - (k * d).to_degrees())).abs() < 1e-9);
        let gain_margin = 20.0 * (std::f64::consts::PI / (2.0 * k * d)).log10();
        assert!((found.gain_margin_db.unwrap() - gain_margin).abs() < 1e-9);
        let at = found.gain_margin_rad_s.unwrap();
        assert!((at - std::f64::consts::FRAC_PI_2 / d).abs() < 1e-9);
        // The same delay margin at the only crossing, and no lower gain margin.
        let delay_margin_s = (std::f64::consts::FRAC_PI_2 - k * d) / k;
        assert!((found.delay_margin_s.unwrap() - delay_margin_s).abs() < 1e-12);
        assert!((found.delay_margin_rad_s.unwrap() - k).abs() < 1e-9);
        assert!((found.phase_margin_rad_s.unwrap() - k).abs() < 1e-9);
        assert_eq!(found.upper_gain_margin_db, found.gain_margin_db);
        assert_eq!(found.lower_gain_margin_db, None);
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
        let found = of(&unknown, &grid(1.0, 100.0, &[]));
        assert!(!found.has_modulus_margin(0.0), "{found:?}");
        // L = 1 at all frequencies: S = 1/2, so the modulus margin is 2.
        let known = of(&|_| Complex::new(1.0, 0.0), &grid(1.0, 100.0, &[]));
        assert!(known.has_modulus_margin(2.0) && !known.has_modulus_margin(2.1));
    }

    #[test]
    fn conditionally_stable_loop_has_an_upper_and_a_lower_gain_margin() {
        // L = k (s + 1)^2/s^3: arg L = -270 deg + 2 atan w is -180 deg at w = 1, where |L| = 2 k. The loop is stable for k > 1/2, so
        // k = 1 allows a fall by 20 log10 2 and any rise.
        let l = |w: f64| {
            let s = Complex::new(0.0, w);
            (s + 1.0) * (s + 1.0) / (s * s * s)
        };
        let found = of(&l, &grid(1e-3, 1e3, &[]));
        let lower_db = -20.0 * libm::log10(2.0);
        assert!((found.lower_gain_margin_db.unwrap() - lower_db).abs() < 1e-9);
        assert!((found.lower_gain_margin_rad_s.unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(found.upper_gain_margin_db, None);
    }

    #[test]
    fn two_crossings_between_two_points_of_the_grid_are_found() {
        // Im L = (ln w - a)^2 - 1e-7 with a between two points of the grid, and Re L = -1/2.
        let a = 3.5 * std::f64::consts::LN_10 / 400.0;
        let l = move |w: f64| Complex::new(-0.5, (libm::log(w) - a).powi(2) - 1e-7);
        let found = of(&l, &grid(1e-2, 1e2, &[]));
        let places: Vec<f64> = found.phase_crossings.iter().map(|c| c.rad_s).collect();
        assert_eq!(places.len(), 2, "{places:?}");
        for (place, sign) in places.iter().zip([-1.0, 1.0]) {
            let expected = libm::exp(a + sign * 1e-7_f64.sqrt());
            assert!((place / expected - 1.0).abs() < 1e-9, "{place} {expected}");
        }
    }

    #[test]
    fn a_lightly_damped_peak_between_grid_points_is_not_missed() {
        // A resonance of damping 1e-5 crosses |L| = 1 twice within 0.1 rad/s.
        let (w0, zeta) = (517.0, 1e-5);
        let l = move |w: f64| {
            Complex::new(0.01 * w0 * w0, 0.0) / Complex::new(w0 * w0 - w * w, 2.0 * zeta * w0 * w)
        };
        let found = of(&l, &grid(1.0, 1e4, &[(w0, zeta)]));
        assert_eq!(found.crossings.len(), 2, "{:?}", found.crossings);
        // |L| = 1 at w^2 = w0^2 (1 +- 0.01), except for the effect of the damping.
        assert!((found.crossings[0].rad_s - w0 * 0.99f64.sqrt()).abs() < 1e-3);
        assert!((found.crossings[1].rad_s - w0 * 1.01f64.sqrt()).abs() < 1e-3);
    }

    #[test]
    fn gain_margin_is_that_of_smallest_magnitude_whether_the_gain_may_rise_or_fall_by_it() {
        // L = k (s + 1)^2/(s^3 (s/6 + 1)^2): arg L = -270 deg + 2 (atan w - atan w/6) is -180 deg where w (1 - 1/6) = 1 + w^2/6, at w = 2
        // and w = 3. There |L| = k (1 + w^2)/(w^3 (1 + w^2/36)) is 9/16 k and 8/27 k.
        for (k, nearest_rad_s, nearest) in [(3.0, 3.0, 24.0 / 27.0), (2.0, 2.0, 18.0 / 16.0)] {
            let l = |w: f64| {
                let s = Complex::new(0.0, w);
                let pole = s / 6.0 + 1.0;
                (s + 1.0) * (s + 1.0) / (s * s * s * pole * pole) * k
            };
            let found = of(&l, &grid(1e-2, 1e3, &[]));
            let gain_margin_db = -20.0 * libm::log10(nearest);
            // The crossings are refined to some 1e-10 of their frequency.
            assert!((found.gain_margin_db.unwrap() - gain_margin_db).abs() < 1e-8);
            assert!((found.gain_margin_rad_s.unwrap() - nearest_rad_s).abs() < 1e-8);
            let lower_db = -20.0 * libm::log10(9.0 / 16.0 * k);
            let upper_db = -20.0 * libm::log10(8.0 / 27.0 * k);
            assert!(lower_db < 0.0 && upper_db > 0.0);
            assert!((found.lower_gain_margin_db.unwrap() - lower_db).abs() < 1e-8);
            assert!((found.upper_gain_margin_db.unwrap() - upper_db).abs() < 1e-8);
        }
    }

    #[test]
    fn gain_margin_of_a_loop_through_minus_one_is_neither_upper_nor_lower() {
        // L = -1 + j ln w is -1 at w = 1.
        let found = of(&|w| Complex::new(-1.0, libm::log(w)), &grid(0.3, 5.0, &[]));
        assert_eq!(found.phase_crossings.len(), 1);
        // An error of 1e-16 in w leaves |L| = 1.
        assert_eq!(found.gain_margin_db.map(f64::abs), Some(0.0));
        assert_eq!(found.upper_gain_margin_db, None);
        assert_eq!(found.lower_gain_margin_db, None);
        assert!(found.modulus_margin < 1e-9);
    }

    #[test]
    fn crossing_of_the_negative_axis_without_response_has_no_gain_margin() {
        // L = g (-1 + j ln w): the sign of L below 1e-9 is that of rounding.
        for (gain, count) in [(0.9e-9, 0), (1.1e-9, 1)] {
            let l = |w: f64| Complex::new(-1.0, libm::log(w)) * gain;
            let found = of(&l, &grid(0.3, 5.0, &[]));
            assert_eq!(found.phase_crossings.len(), count, "{gain}");
        }
    }

    fn crossing(rad_s: f64, phase_margin_deg: f64) -> Crossing {
        Crossing {
            rad_s,
            phase_margin_deg,
        }
    }

    #[test]
    fn delay_margin_is_the_least_of_all_crossings_with_margins_of_a_whole_turn() {
        // 90 deg at 10 rad/s: 157 ms; -90 deg at 100 rad/s, 270 deg of delay: 47 ms; 180 deg at 50 rad/s: 63 ms.
        let crossings = [
            crossing(10.0, 90.0),
            crossing(100.0, -90.0),
            crossing(50.0, 180.0),
        ];
        let found = delay_margin(&crossings).expect("a delay margin");
        assert_eq!(found.rad_s, 100.0);
        let expected = 1.5 * std::f64::consts::PI / 100.0;
        assert!((found.delay_s / expected - 1.0).abs() < 1e-14, "{found:?}");
    }

    #[test]
    fn delay_has_no_effect_on_a_crossing_at_rest() {
        assert_eq!(delay_margin(&[crossing(0.0, 30.0)]), None);
        let found = delay_margin(&[crossing(0.0, 0.0), crossing(2.0, 90.0)]);
        assert_eq!(found.map(|margin| margin.rad_s), Some(2.0));
    }

    #[test]
    fn grid_has_four_hundred_points_per_decade_in_equal_ratios() {
        let grid = grid(0.5, 50.0, &[]);
        assert_eq!(grid.len(), 801);
        for (k, w) in grid.iter().enumerate() {
            let expected = 0.5 * 10_f64.powf(k as f64 / 400.0);
            assert!((w / expected - 1.0).abs() < 1e-13, "{k}: {w}");
        }
    }

    #[test]
    fn points_around_a_resonance_are_a_fortieth_of_their_distance_from_it_apart() {
        // w (1 + zeta sinh x) in steps of 1/40 of x has the slope w zeta cosh x, the distance from the pole at w (j - zeta).
        for (w, zeta) in [(517.0, 1e-3), (3.0, 0.1), (40.0, 0.4)] {
            let points: Vec<f64> = around((w, zeta)).collect();
            let distance = |at: f64| libm::hypot(at - w, zeta * w);
            for pair in points.windows(2) {
                let (near, far) = (distance(pair[0]), distance(pair[1]));
                let spacing = 40.0 * (pair[1] - pair[0]);
                // Between the distances of both, except next to the resonance, where the distance is least between them.
                let (least, largest) = (near.min(far), near.max(far));
                assert!(
                    spacing > 0.999 * least && spacing < 1.001 * largest,
                    "{pair:?}"
                );
            }
            // To a quarter of its frequency, or to its width, and at most one step of e^(1/40) beyond.
            let reach = w * zeta.max(0.25);
            for end in [w - points[0], points[points.len() - 1] - w] {
                assert!(end > 0.9999 * reach && end < 1.04 * reach, "{end} {reach}");
            }
            assert_eq!(points[points.len() / 2], w);
        }
    }

    #[test]
    fn grid_has_the_points_around_its_resonances_within_its_limits() {
        let (w, zeta) = (100.0, 1e-4);
        let grid = grid(99.0, 1e3, &[(w, zeta), (5e3, 1e-3)]);
        assert!(grid.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(grid[0] == 99.0 && grid[grid.len() - 1] <= 1e3);
        let inside = around((w, zeta)).filter(|at| *at >= 99.0);
        assert!(inside.into_iter().all(|at| grid.contains(&at)));
        // 400 for the decade, and 40 for each of the e-folds of 1 % and of 25 % over 1e-4, on either side of it.
        let logarithmic = 400.0 * (1e3_f64 / 99.0).log10();
        let folds = (0.01 / zeta).asinh() + (0.25 / zeta).asinh();
        let expected = logarithmic + 40.0 * folds;
        assert!(
            (grid.len() as f64 - expected).abs() < 4.0,
            "{} {expected}",
            grid.len()
        );
    }

    #[test]
    fn undamped_resonance_has_points_down_to_a_millionth_of_its_frequency() {
        let points: Vec<f64> = around((10.0, 0.0)).collect();
        let middle = points.len() / 2;
        let spacing = points[middle + 1] - points[middle];
        assert!(
            (spacing / (10.0 * 1e-6 / 40.0) - 1.0).abs() < 1e-3,
            "{spacing}"
        );
    }
}

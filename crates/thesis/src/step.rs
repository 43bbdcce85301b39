//! The response to a step of 1 N in closed form, and the features of its beginning (sections 3.2.2 to 3.2.4).
//!
//! y(t) = R + sum of r/w^2 (1 - exp(-zeta w t) (cos wd t + zeta w sin(wd t)/wd)), r t^2/2 for a double integrator.
//!
//! Predictions from the zeros in the right half plane: the response begins against its final direction exactly where the
//! number of real ones is odd. It crosses zero at least once for each real one, as each makes the Laplace transform of y
//! vanish. A complex pair may or may not add two crossings (Fig 3-12d). That there are not more crossings than zeros in the
//! right half plane holds for the thesis's examples, but not in general: fast modes that outweigh a slow one cross zero many
//! times, whatever their zeros.

use std::f64::consts::{PI, TAU};

use serde::Serialize;

use bench_base::numeric::bisect;
use bench_base::units::hz;
use bench_plant::zeros::{ModalSum, ModalTerm, ZeroCounts};

/// Samples in the shortest period.
const SAMPLES_PER_PERIOD: f64 = 64.0;
/// Number of times the first sampling step is halved, to resolve features at the beginning of the response.
const EARLY_HALVINGS: i32 = 24;

/// The response of a plant to a step of 1 N.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse<'a> {
    sum: &'a ModalSum,
}

/// Features of the beginning of a step response.
#[derive(Clone, Debug, PartialEq)]
pub struct StepFeatures {
    /// Whether it starts in the positive direction.
    pub starts_positive: bool,
    /// Whether it ends (or, with a double integrator, continues) in the positive direction.
    pub ends_positive: bool,
    /// Its largest excursion against its final direction up to the last zero crossing, in m/N.
    pub undershoot_m: f64,
    /// Times of its zero crossings in seconds, within `window_s`.
    pub zero_crossings_s: Vec<f64>,
    /// Times of its reversals of direction in seconds, within `initial_s`.
    pub reversals_s: Vec<f64>,
    /// End of the search for zero crossings: half a period of the slowest mode, or with a double integrator until it
    /// outweighs all other modes.
    pub window_s: f64,
    /// End of the search for reversals: one period of the second mode.
    pub initial_s: f64,
}

impl StepFeatures {
    /// Initial undershoot: it starts against its final direction.
    pub fn has_undershoot(&self) -> bool {
        self.starts_positive != self.ends_positive
    }
}

/// Prediction of the features from the number of zeros in the right half plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StepPrediction {
    /// Whether initial undershoot is predicted: the number of RNMP zeros is odd.
    pub initial_undershoot: bool,
    /// Smallest number of zero crossings: one for each RNMP zero.
    pub least_zero_crossings: usize,
    /// Number of zero crossings in the examples of the thesis: one for each zero in the right half plane. Not true in
    /// general.
    pub usual_zero_crossings: usize,
    /// Whether the features have the predicted undershoot and at least the predicted number of crossings.
    pub agrees: bool,
}

impl StepPrediction {
    /// The prediction from the zeros without damping, compared with the features.
    pub fn of(counts: &ZeroCounts, features: &StepFeatures) -> StepPrediction {
        let (initial_undershoot, least) = (counts.real % 2 == 1, counts.real);
        StepPrediction {
            initial_undershoot,
            least_zero_crossings: least,
            usual_zero_crossings: counts.in_right_half_plane(),
            agrees: initial_undershoot == features.has_undershoot()
                && features.zero_crossings_s.len() >= least,
        }
    }
}

impl<'a> StepResponse<'a> {
    /// The response of a sum.
    pub fn new(sum: &'a ModalSum) -> Self {
        StepResponse { sum }
    }

    /// y in m/N, `time_s` after the step.
    pub fn position_m(&self, time_s: f64) -> f64 {
        let parts = self.sum.terms().iter().map(|term| position(term, time_s));
        self.sum.constant_m_per_n() + parts.sum::<f64>()
    }

    /// The undamped natural frequency of each mode in hertz; 0 for the rigid body.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        let terms = self.sum.terms().iter();
        terms.map(|term| hz(term.omega_rad_s)).collect()
    }

    /// The contribution of each mode to it, in m/N.
    pub fn parts_m(&self, time_s: f64) -> Vec<f64> {
        let terms = self.sum.terms().iter();
        terms.map(|term| position(term, time_s)).collect()
    }

    /// dy/dt in m/s per newton.
    pub fn velocity_m_per_s(&self, time_s: f64) -> f64 {
        let terms = self.sum.terms().iter();
        terms.map(|term| velocity(term, time_s)).sum()
    }

    /// The final y in m/N: G(0); infinite with a double integrator.
    pub fn end_m(&self) -> f64 {
        let terms = self.sum.terms().iter();
        self.sum.constant_m_per_n() + terms.map(|term| term.part(0.0)).sum::<f64>()
    }

    /// Directions, zero crossings and reversals.
    pub fn initial(&self) -> StepFeatures {
        let window_s = self.window_s();
        let second_s = self.sum.terms().get(1).map_or(window_s, period_s);
        let initial_s = second_s.min(window_s);
        let mut extrema_s = self.extrema_s(window_s);
        let zero_crossings_s = self.zero_crossings_s(&extrema_s, window_s);
        let last_s = zero_crossings_s.last().copied().unwrap_or(0.0);
        let undershoot_m = self.undershoot_m(&extrema_s, last_s);
        extrema_s.retain(|t| *t <= initial_s);
        StepFeatures {
            starts_positive: self.starts_positive(window_s),
            ends_positive: self.ends_positive(),
            undershoot_m,
            reversals_s: extrema_s,
            zero_crossings_s,
            window_s,
            initial_s,
        }
    }

    /// The largest excursion against the final direction, at the start or at an extremum before `last_s`.
    fn undershoot_m(&self, extrema_s: &[f64], last_s: f64) -> f64 {
        let sign = if self.ends_positive() { -1.0 } else { 1.0 };
        let start_m = (sign * self.sum.constant_m_per_n()).max(0.0);
        let before = extrema_s.iter().filter(|t| **t < last_s);
        before
            .map(|t| sign * self.position_m(*t))
            .fold(start_m, f64::max)
    }

    /// The sign of y at first: that of the constant, or of the sum of residues (y = sum r t^2/2 + ...), or, where both
    /// vanish, that of y early on.
    fn starts_positive(&self, window_s: f64) -> bool {
        let residues = || self.sum.terms().iter().map(|term| term.residue_per_kg);
        let total: f64 = residues().sum();
        let size: f64 = residues().map(f64::abs).sum();
        if self.sum.has_constant() {
            self.sum.constant_m_per_n() > 0.0
        } else if total.abs() > 1e-12 * size {
            total > 0.0
        } else {
            self.position_m(1e-4 * self.shortest_s().min(window_s)) > 0.0
        }
    }

    fn ends_positive(&self) -> bool {
        match self.sum.terms().first() {
            Some(first) if first.omega_rad_s == 0.0 => first.residue_per_kg > 0.0,
            _ => self.end_m() > 0.0,
        }
    }

    /// Period of the fastest mode.
    fn shortest_s(&self) -> f64 {
        self.sum.terms().last().map_or(1.0, period_s)
    }

    fn window_s(&self) -> f64 {
        match self.sum.terms() {
            [] => 1.0,
            [slowest, ..] if slowest.omega_rad_s > 0.0 => PI / slowest.omega_rad_s,
            [free, others @ ..] => {
                // The contribution of a mode is at most 2 |r|/w^2.
                let parts: f64 = others.iter().map(|t| 2.0 * t.part(0.0).abs()).sum();
                let most = parts + self.sum.constant_m_per_n().abs();
                let longest_s = others.first().map_or(1.0, period_s);
                (2.0 * most / free.residue_per_kg.abs())
                    .sqrt()
                    .max(longest_s)
            }
        }
    }

    /// Sampling instants: fractions of the shortest period, and shorter ones below the first of them.
    fn instants_s(&self, window_s: f64) -> Vec<f64> {
        let fraction_s = self.shortest_s() / SAMPLES_PER_PERIOD;
        let step_s = fraction_s
            .min(window_s / SAMPLES_PER_PERIOD)
            .max(window_s / 1e6);
        let early = (0..EARLY_HALVINGS).rev();
        let count = (window_s / step_s).ceil() as usize;
        early
            .map(|k| step_s * 0.5f64.powi(k + 1))
            .chain((1..=count).map(|k| (k as f64 * step_s).min(window_s)))
            .collect()
    }

    /// Zeros of dy/dt.
    fn extrema_s(&self, window_s: f64) -> Vec<f64> {
        sign_changes(&self.instants_s(window_s), |t| self.velocity_m_per_s(t))
    }

    /// Zeros of y: one at most between two extrema.
    fn zero_crossings_s(&self, extrema_s: &[f64], window_s: f64) -> Vec<f64> {
        let mut knots = vec![self.instants_s(window_s)[0]];
        knots.extend(extrema_s);
        knots.push(window_s);
        sign_changes(&knots, |t| self.position_m(t))
    }
}

fn period_s(term: &ModalTerm) -> f64 {
    TAU / term.omega_rad_s
}

/// The places where a function changes its sign between neighbouring knots.
fn sign_changes(knots: &[f64], function: impl Fn(f64) -> f64) -> Vec<f64> {
    let values: Vec<f64> = knots.iter().map(|t| function(*t)).collect();
    let changes = (1..knots.len()).filter(|k| values[k - 1] * values[*k] < 0.0);
    changes
        .map(|k| bisect(&function, knots[k - 1], knots[k]))
        .collect()
}

/// exp(-zeta w t) cos(wd t) and exp(-zeta w t) sin(wd t)/wd; hyperbolic above critical damping.
fn oscillation(term: &ModalTerm, time_s: f64) -> (f64, f64) {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    let (decay, square) = (zeta * w, w * w * (1.0 - zeta) * (1.0 + zeta));
    let rate = square.abs().sqrt();
    let (envelope, angle) = ((-decay * time_s).exp(), rate * time_s);
    if angle < 1e-8 {
        (envelope, envelope * time_s)
    } else if square > 0.0 {
        (envelope * angle.cos(), envelope * angle.sin() / rate)
    } else if angle < 1.0 {
        (envelope * angle.cosh(), envelope * angle.sinh() / rate)
    } else {
        let slow = ((rate - decay) * time_s).exp();
        let fast = (-(rate + decay) * time_s).exp();
        // The sums of exponentials: the hyperbolic functions alone may overflow.
        (0.5 * (slow + fast), 0.5 * (slow - fast) / rate)
    }
}

fn velocity(term: &ModalTerm, time_s: f64) -> f64 {
    if term.omega_rad_s == 0.0 {
        return term.residue_per_kg * time_s;
    }
    term.residue_per_kg * oscillation(term, time_s).1
}

fn position(term: &ModalTerm, time_s: f64) -> f64 {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    if w == 0.0 {
        return 0.5 * term.residue_per_kg * time_s * time_s;
    }
    let (cosine, sine) = oscillation(term, time_s);
    let risen = if zeta < 1.0 {
        one_less_cosine(term, time_s) - zeta * w * sine
    } else {
        1.0 - cosine - zeta * w * sine
    };
    term.part(0.0) * risen
}

/// 1 - exp(-zeta w t) cos(wd t) without cancellation at small times: 1 - cos x = 2 sin^2(x/2).
fn one_less_cosine(term: &ModalTerm, time_s: f64) -> f64 {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    let half = (0.5 * w * ((1.0 - zeta) * (1.0 + zeta)).sqrt() * time_s).sin();
    let envelope = (-zeta * w * time_s).exp();
    -(-zeta * w * time_s).exp_m1() + envelope * 2.0 * half * half
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_plant::zeros::ZeroCounts;

    fn sum(parts: &[(f64, f64, f64)]) -> ModalSum {
        let term = |&(omega_rad_s, damping_ratio, residue_per_kg): &_| ModalTerm {
            omega_rad_s,
            damping_ratio,
            residue_per_kg,
        };
        ModalSum::new(parts.iter().map(term).collect(), 0.0).unwrap()
    }

    /// Eq. (3-9) with a_u = -a0.
    fn eq_3_9(a0: f64) -> ModalSum {
        sum(&[(1.0, 0.0005, 1.0), (10.0, 0.001, -a0), (11.0, 0.001, a0)])
    }

    #[test]
    fn eq_3_4_undershoots_with_real_zeros_only() {
        // Fig 3-5: av = -0.5 and -5.
        for (av, undershoot, crossings) in [(-0.5, false, 0), (-5.0, true, 1)] {
            let plant = sum(&[(1.0, 0.001, 1.0), (10.0, 0.001, av)]);
            let initial = StepResponse::new(&plant).initial();
            assert_eq!(initial.has_undershoot(), undershoot, "av = {av}");
            assert_eq!(initial.zero_crossings_s.len(), crossings);
            assert_eq!(initial.reversals_s.len(), crossings);
            assert_eq!(initial.undershoot_m > 0.0, undershoot);
        }
    }

    #[test]
    fn eq_3_9_crosses_zero_once_for_each_real_zero() {
        // Section 3.2.4: none for dual MMP, two for dual RMP-RNMP, from none to two on the way (Fig 3-12d).
        let (mut with, mut without, mut reversing_only) = (0, 0, 0);
        for a0 in [
            0.01, 0.04, 0.06, 0.5, 2.0, 5.0, 8.0, 10.0, 12.0, 15.0, 18.0, 20.9, 21.1, 25.0, 40.0,
        ] {
            let plant = eq_3_9(a0);
            let kinds = ZeroCounts::of(
                &ModalSum::new(
                    plant
                        .terms()
                        .iter()
                        .map(|t| ModalTerm {
                            damping_ratio: 0.0,
                            ..*t
                        })
                        .collect(),
                    0.0,
                )
                .unwrap()
                .undamped_zeros()
                .unwrap(),
            );
            let initial = StepResponse::new(&plant).initial();
            let (crossings, reversals) =
                (initial.zero_crossings_s.len(), initial.reversals_s.len());
            assert!(!initial.has_undershoot(), "a0 = {a0}");
            match (kinds.mmp, kinds.real, kinds.quartets) {
                (2, 0, 0) => assert_eq!((crossings, reversals), (0, 0), "a0 = {a0}"),
                (0, 2, 0) => assert_eq!((crossings, reversals), (2, 2), "a0 = {a0}"),
                (0, 0, 1) => {
                    assert!(
                        [0, 2].contains(&crossings) && [0, 2].contains(&reversals),
                        "a0 = {a0}: {initial:?}"
                    );
                    with += usize::from(crossings == 2);
                    reversing_only += usize::from(crossings == 0 && reversals == 2);
                    without += usize::from(reversals == 0);
                }
                _ => panic!("a0 = {a0}: {kinds}"),
            }
        }
        assert!(
            with > 0 && without > 0 && reversing_only > 0,
            "{with} {without} {reversing_only}"
        );
    }

    #[test]
    fn step_of_a_damped_mode_solves_its_equation_of_motion() {
        for zeta in [0.0, 0.2, 0.999_999_999, 1.0, 1.000_000_001, 3.0] {
            let plant = sum(&[(2.0, zeta, 4.0)]);
            let response = StepResponse::new(&plant);
            // y'' + 2 zeta w y' + w^2 y = r, by central differences of the closed form: h^2 of the fourth derivative, 1e-7.
            for t in [0.1, 1.0, 2.5] {
                let h = 1e-4;
                let (low, here, high) = (
                    response.position_m(t - h),
                    response.position_m(t),
                    response.position_m(t + h),
                );
                let slope = (high - low) / (2.0 * h);
                let bend = (high - 2.0 * here + low) / (h * h);
                assert!(
                    (bend + 4.0 * zeta * slope + 4.0 * here - 4.0).abs() < 1e-5,
                    "zeta = {zeta} at {t}"
                );
                assert!((response.velocity_m_per_s(t) - slope).abs() < 1e-6);
            }
        }
    }
}

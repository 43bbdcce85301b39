//! The response to a step of 1 N in closed form, and what its beginning shows (sections 3.2.2 to 3.2.4).
//!
//! y(t) = R + sum of r/w^2 (1 - exp(-zeta w t) (cos wd t + zeta w sin(wd t)/wd)), r t^2/2 for a double integrator.
//!
//! What zeros in the right half plane foretell: the response begins against its end exactly where the number of real ones
//! is odd, and it passes through zero at least as often as there are real ones (each makes the Laplace transform of y
//! vanish, so y must change its sign once more). A complex pair may or may not add two (Fig 3-12d). That there are not more
//! crossings than zeros in the right half plane holds for the thesis's examples and is no law: fast modes that outweigh a
//! slow one swing through zero many times, whatever their zeros.

use super::{ModalSum, ModalTerm};

/// The response of a plant to a step of 1 N.
#[derive(Clone, Debug, PartialEq)]
pub struct StepResponse<'a> {
    sum: &'a ModalSum,
}

/// What the beginning of a step response shows.
#[derive(Clone, Debug, PartialEq)]
pub struct StepFeatures {
    /// Whether it sets out in the positive direction.
    pub starts_positive: bool,
    /// Whether it ends (or, with a double integrator, goes off) in the positive direction.
    pub ends_positive: bool,
    /// Its largest excursion against its end up to the last zero crossing, in m/N.
    pub undershoot_m: f64,
    /// When it passes through zero, in seconds, within `window_s`.
    pub zero_crossings_s: Vec<f64>,
    /// When it reverses its direction, in seconds, within `initial_s`.
    pub reversals_s: Vec<f64>,
    /// Zero crossings are looked for up to here: half a period of the slowest mode, or with a double integrator until it
    /// outweighs all others for good.
    pub window_s: f64,
    /// Reversals are looked for up to here: one period of the second mode.
    pub initial_s: f64,
}

impl StepFeatures {
    /// Initial undershoot: it sets out against its end.
    pub fn has_undershoot(&self) -> bool {
        self.starts_positive != self.ends_positive
    }
}

impl<'a> StepResponse<'a> {
    /// The response of a sum.
    pub fn new(sum: &'a ModalSum) -> Self {
        StepResponse { sum }
    }

    /// y in m/N, `time_s` after the step.
    pub fn position_m(&self, time_s: f64) -> f64 {
        self.sum.constant_m_per_n()
            + self
                .sum
                .terms()
                .iter()
                .map(|term| position(term, time_s))
                .sum::<f64>()
    }

    /// What each mode adds to it, in m/N.
    pub fn parts_m(&self, time_s: f64) -> Vec<f64> {
        self.sum
            .terms()
            .iter()
            .map(|term| position(term, time_s))
            .collect()
    }

    /// dy/dt in m/s per newton.
    pub fn velocity_m_per_s(&self, time_s: f64) -> f64 {
        self.sum
            .terms()
            .iter()
            .map(|term| velocity(term, time_s))
            .sum()
    }

    /// y at the end in m/N: G(0); infinite with a double integrator.
    pub fn end_m(&self) -> f64 {
        self.sum.constant_m_per_n()
            + self
                .sum
                .terms()
                .iter()
                .map(|term| term.part(0.0))
                .sum::<f64>()
    }

    /// Directions, zero crossings and reversals.
    pub fn initial(&self) -> StepFeatures {
        let window_s = self.window_s();
        let period = |term: &ModalTerm| 2.0 * std::f64::consts::PI / term.omega_rad_s;
        let initial_s = self
            .sum
            .terms()
            .get(1)
            .map_or(window_s, |second| period(second).min(window_s));
        let extrema_s = self.extrema_s(window_s);
        let zero_crossings_s = self.zero_crossings_s(&extrema_s, window_s);
        let ends_positive = self.ends_positive();
        let last_s = zero_crossings_s.last().copied().unwrap_or(0.0);
        let against = |y: f64| if ends_positive { -y } else { y };
        let before = extrema_s
            .iter()
            .filter(|t| **t < last_s)
            .map(|t| against(self.position_m(*t)));
        StepFeatures {
            starts_positive: self.starts_positive(window_s),
            ends_positive,
            undershoot_m: before.fold(against(self.sum.constant_m_per_n()).max(0.0), f64::max),
            zero_crossings_s,
            reversals_s: extrema_s
                .iter()
                .copied()
                .filter(|t| *t <= initial_s)
                .collect(),
            window_s,
            initial_s,
        }
    }

    /// The sign of y at first: that of the constant, of the sum of residues (y = sum r t^2/2 + ...), or, where the two are
    /// nothing, that of y early on.
    fn starts_positive(&self, window_s: f64) -> bool {
        let residues = || self.sum.terms().iter().map(|term| term.residue_per_kg);
        let (total, size) = (
            residues().sum::<f64>(),
            residues().map(f64::abs).sum::<f64>(),
        );
        match self.sum.constant_m_per_n() {
            constant if constant != 0.0 => constant > 0.0,
            _ if total.abs() > 1e-12 * size => total > 0.0,
            _ => self.position_m(1e-4 * self.shortest_s().min(window_s)) > 0.0,
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
        self.sum
            .terms()
            .last()
            .map_or(1.0, |term| 2.0 * std::f64::consts::PI / term.omega_rad_s)
    }

    fn window_s(&self) -> f64 {
        match self.sum.terms().split_first() {
            None => 1.0,
            Some((slowest, _)) if slowest.omega_rad_s > 0.0 => {
                std::f64::consts::PI / slowest.omega_rad_s
            }
            Some((free, others)) => {
                // The part of a mode is never beyond 2 |r|/w^2.
                let most = others.iter().map(|t| 2.0 * t.part(0.0).abs()).sum::<f64>()
                    + self.sum.constant_m_per_n().abs();
                let longest = others
                    .first()
                    .map_or(1.0, |t| 2.0 * std::f64::consts::PI / t.omega_rad_s);
                (2.0 * most / free.residue_per_kg.abs()).sqrt().max(longest)
            }
        }
    }

    /// Instants to look at: fractions of the shortest period, and below the first of them smaller ones, for what lasts
    /// shortly only.
    fn instants_s(&self, window_s: f64) -> Vec<f64> {
        let step_s = (self.shortest_s() / 64.0)
            .min(window_s / 64.0)
            .max(window_s / 1e6);
        let early = (0..24).rev().map(|k| step_s * 0.5f64.powi(k + 1));
        let count = (window_s / step_s).ceil() as usize;
        early
            .chain((1..=count).map(|k| (k as f64 * step_s).min(window_s)))
            .collect()
    }

    /// Where dy/dt changes its sign.
    fn extrema_s(&self, window_s: f64) -> Vec<f64> {
        let instants = self.instants_s(window_s);
        let velocities: Vec<f64> = instants.iter().map(|t| self.velocity_m_per_s(*t)).collect();
        let changes = (1..instants.len()).filter(|k| velocities[k - 1] * velocities[*k] < 0.0);
        changes
            .map(|k| bisected(|t| self.velocity_m_per_s(t), instants[k - 1], instants[k]))
            .collect()
    }

    /// Where y changes its sign: between two extrema at most once.
    fn zero_crossings_s(&self, extrema_s: &[f64], window_s: f64) -> Vec<f64> {
        let first = self.instants_s(window_s)[0];
        let knots: Vec<f64> = [first]
            .into_iter()
            .chain(extrema_s.iter().copied())
            .chain([window_s])
            .collect();
        let pairs = knots
            .windows(2)
            .filter(|pair| self.position_m(pair[0]) * self.position_m(pair[1]) < 0.0);
        pairs
            .map(|pair| bisected(|t| self.position_m(t), pair[0], pair[1]))
            .collect()
    }
}

/// Where a function changes its sign between two places with different signs.
fn bisected(of: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let negative = of(low) < 0.0;
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if (of(middle) < 0.0) == negative {
            low = middle
        } else {
            high = middle
        }
    }
    0.5 * (low + high)
}

/// exp(-zeta w t) cos(wd t) and exp(-zeta w t) sin(wd t)/wd; hyperbolic above critical damping.
fn swing(term: &ModalTerm, time_s: f64) -> (f64, f64) {
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
        // Apart, as one of the two exponentials alone may be beyond all numbers.
        let (slow, fast) = (
            ((rate - decay) * time_s).exp(),
            (-(rate + decay) * time_s).exp(),
        );
        (0.5 * (slow + fast), 0.5 * (slow - fast) / rate)
    }
}

fn velocity(term: &ModalTerm, time_s: f64) -> f64 {
    if term.omega_rad_s == 0.0 {
        return term.residue_per_kg * time_s;
    }
    term.residue_per_kg * swing(term, time_s).1
}

fn position(term: &ModalTerm, time_s: f64) -> f64 {
    let (w, zeta) = (term.omega_rad_s, term.damping_ratio);
    if w == 0.0 {
        return 0.5 * term.residue_per_kg * time_s * time_s;
    }
    let (cosine, sine) = swing(term, time_s);
    let risen = if zeta < 1.0 {
        // 1 - exp(-a)(cos + ...) without cancellation at small times: 1 - cos x = 2 sin^2(x/2).
        let half = (0.5 * w * ((1.0 - zeta) * (1.0 + zeta)).sqrt() * time_s).sin();
        let envelope = (-zeta * w * time_s).exp();
        -(-zeta * w * time_s).exp_m1() + envelope * 2.0 * half * half - zeta * w * sine
    } else {
        1.0 - cosine - zeta * w * sine
    };
    term.part(0.0) * risen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::zeros::ZeroCounts;

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
    fn eq_3_4_undershoots_with_real_zeros_and_not_with_mmp_zeros() {
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
    fn eq_3_9_crosses_zero_as_often_as_it_has_real_zeros_and_its_complex_ones_are_a_transition() {
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
    fn a_damped_mode_steps_as_in_closed_form_above_and_below_critical_damping() {
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

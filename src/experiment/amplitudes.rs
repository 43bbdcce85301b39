//! The same modes at several amplitudes: whether they are where they were.

use crate::identify::modal::{Estimate, FittedMode};

/// Two modes are one if they are no farther apart than this part of their frequency, and than half of the way to the next.
const SAME: f64 = 0.05;
/// Figures are said to shift where chance makes any of them differ as much with less than this probability.
const CHANCE: f64 = 0.01;
/// Figures of a mode.
const FIGURES: usize = 3;

/// A mode of the first run through all runs.
#[derive(Clone, Debug)]
pub struct ModeOverAmplitude {
    /// What each run shows of it, if it does.
    pub by_run: Vec<Option<FittedMode>>,
    /// Whether its frequency differs from that of the first run by more than both errors explain.
    pub frequency_shifts: bool,
    /// The same of its damping ratio.
    pub damping_shifts: bool,
    /// The same of its residue.
    pub residue_shifts: bool,
}

impl ModeOverAmplitude {
    /// Whether all runs show it.
    pub fn is_seen_throughout(&self) -> bool {
        self.by_run.iter().all(Option::is_some)
    }

    /// Whether anything of it shifts.
    pub fn shifts(&self) -> bool {
        self.frequency_shifts || self.damping_shifts || self.residue_shifts
    }
}

/// The modes of the first run in the others. Of z = (x - x_1)/sqrt(sigma^2 + sigma_1^2), |z| is beyond chance where
/// erfc(|z|/sqrt 2) < 1 %/(all figures that are compared): so all figures of a linear stage together are said to shift once in a hundred
/// campaigns at most (Bonferroni).
pub fn modes_over_amplitude(runs: &[Vec<FittedMode>]) -> Vec<ModeOverAmplitude> {
    let Some((first, others)) = runs.split_first() else {
        return Vec::new();
    };
    let through = |k: usize| {
        let same = |modes: &Vec<FittedMode>| nearest(first, k, modes);
        std::iter::once(Some(first[k]))
            .chain(others.iter().map(same))
            .collect::<Vec<_>>()
    };
    let all: Vec<Vec<Option<FittedMode>>> = (0..first.len()).map(through).collect();
    let compared = FIGURES
        * all
            .iter()
            .map(|runs| runs.iter().flatten().count() - 1)
            .sum::<usize>();
    let shifts = |runs: &[Option<FittedMode>], of: fn(&FittedMode) -> Estimate| {
        let mut figures = runs.iter().flatten().map(of);
        figures.next().is_some_and(|base| {
            figures.any(|other| by_chance(base, other) * (compared as f64) < CHANCE)
        })
    };
    let mode = |by_run: Vec<Option<FittedMode>>| ModeOverAmplitude {
        frequency_shifts: shifts(&by_run, |mode| mode.omega_rad_s),
        damping_shifts: shifts(&by_run, |mode| mode.damping_ratio),
        residue_shifts: shifts(&by_run, |mode| mode.residue_per_kg),
        by_run,
    };
    all.into_iter().map(mode).collect()
}

/// The probability that two estimates of the same differ as much.
fn by_chance(a: Estimate, b: Estimate) -> f64 {
    let z = (a.value - b.value).abs() / libm::hypot(a.sigma, b.sigma);
    // 0/0: both without error, and equal.
    if z.is_nan() {
        1.0
    } else {
        libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
    }
}

/// The mode of another run that is mode `k` of the first.
fn nearest(first: &[FittedMode], k: usize, modes: &[FittedMode]) -> Option<FittedMode> {
    let at = |mode: &FittedMode| mode.omega_rad_s.value;
    let here = at(&first[k]);
    let apart = |mode: &FittedMode| (at(mode) - here).abs();
    let to_next = first
        .iter()
        .map(apart)
        .filter(|distance| *distance > 0.0)
        .fold(f64::INFINITY, f64::min);
    let found = modes.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))?;
    // A free body is at 0 in each run.
    (apart(found) <= (0.5 * to_next).min(SAME * here)).then_some(*found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(omega_rad_s: f64, damping_ratio: f64) -> FittedMode {
        let known = |value: f64| Estimate {
            value,
            sigma: 1e-3 * value.abs(),
        };
        FittedMode {
            omega_rad_s: known(omega_rad_s),
            damping_ratio: known(damping_ratio),
            residue_per_kg: known(-0.5),
        }
    }

    #[test]
    fn what_differs_by_more_than_the_errors_shifts_and_nothing_else_does() {
        let runs = [
            vec![mode(180.0, 0.01), mode(500.0, 0.004)],
            vec![mode(180.3, 0.01), mode(500.0, 0.00403)],
            vec![mode(180.0, 0.01), mode(504.0, 0.004), mode(530.0, 0.004)],
        ];
        let modes = modes_over_amplitude(&runs);
        assert_eq!(modes.len(), 2);
        // sigma of a difference is 1.41e-3; twelve figures are compared, |z| < 3.34 is chance: 4.7e-3.
        assert!(!modes[0].shifts(), "1.7e-3: {:?}", modes[0]);
        assert!(modes[1].frequency_shifts, "8e-3");
        assert!(modes[1].damping_shifts, "7.5e-3");
        assert!(!modes[1].residue_shifts);
        assert!(
            modes
                .iter()
                .all(|mode| mode.by_run.iter().all(Option::is_some))
        );
    }

    #[test]
    fn a_mode_is_no_other_one_that_happens_to_be_near() {
        // 510 is nearer to 504 than half of the way from 500; 540 is farther than 5 % from 510.
        let modes = modes_over_amplitude(&[
            vec![mode(500.0, 0.01), mode(510.0, 0.01)],
            vec![mode(508.0, 0.01)],
            Vec::new(),
        ]);
        let found = modes
            .iter()
            .map(|mode| mode.by_run.iter().flatten().count())
            .collect::<Vec<_>>();
        assert_eq!(found, [1, 2]);
        let far = modes_over_amplitude(&[vec![mode(510.0, 0.01)], vec![mode(540.0, 0.01)]]);
        assert!(far[0].by_run[1].is_none() && !far[0].shifts());
        assert!(modes_over_amplitude(&[]).is_empty());
        let free = modes_over_amplitude(&[
            vec![mode(0.0, 0.0), mode(180.0, 0.01)],
            vec![mode(0.0, 0.0)],
        ]);
        assert!(
            free[0].by_run[1].is_some() && free[1].by_run[1].is_none(),
            "{free:?}"
        );
    }

    #[test]
    fn chance_shifts_the_modes_of_a_linear_stage_once_in_a_hundred_campaigns() {
        use rand_core::{Rng, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let mut uniform = || ((random.next_u64() >> 11) as f64 + 0.5) / (1u64 << 53) as f64;
        let mut normal =
            || (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
        let mut chance = |value: f64| Estimate {
            value: value * (1.0 + 1e-3 * normal()),
            sigma: 1e-3 * value,
        };
        let mut run = || {
            let mut mode = |omega: f64| FittedMode {
                omega_rad_s: chance(omega),
                damping_ratio: chance(0.01),
                residue_per_kg: chance(0.5),
            };
            vec![mode(180.0), mode(500.0), mode(530.0)]
        };
        let shifted = (0..2000)
            .filter(|_| {
                modes_over_amplitude(&[run(), run(), run()])
                    .iter()
                    .any(|mode| mode.shifts())
            })
            .count();
        // At most 20, somewhat less as figures share the first run; a sigma of 4.5, of which three. Half of it at least.
        assert!((4..=33).contains(&shifted), "{shifted} of 2000");
    }
}

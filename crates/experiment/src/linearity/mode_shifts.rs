//! The modes of a stage at several amplitudes, and whether they shift.

use serde::Serialize;

use crate::run_comparison::{probability_of_difference, same_mode};
use bench_identify::modal::{Estimate, FittedMode};

/// Probability that noise alone makes any of the compared parameters shift.
const FALSE_ALARM: f64 = 0.01;
/// Compared parameters of a mode.
const PARAMETERS: usize = 3;

/// A mode of the first run in all runs.
#[derive(Clone, Debug, Serialize)]
pub struct ModeOverAmplitude {
    /// The mode in each run; none if the run does not show it.
    pub by_run: Vec<Option<FittedMode>>,
    /// Whether its frequency differs from that of the first run by more than both errors explain.
    pub frequency_shifts: bool,
    /// The same for its damping ratio.
    pub damping_shifts: bool,
    /// The same for its residue.
    pub residue_shifts: bool,
}

impl ModeOverAmplitude {
    /// Whether every run shows the mode.
    pub fn is_in_every_run(&self) -> bool {
        self.by_run.iter().all(Option::is_some)
    }

    /// Whether a parameter shifts.
    pub fn shifts(&self) -> bool {
        self.frequency_shifts || self.damping_shifts || self.residue_shifts
    }

    /// Frequency in the first run that shows the mode, in hertz.
    pub fn frequency_hz(&self) -> f64 {
        let mut shown = self.by_run.iter().flatten();
        shown
            .next()
            .map_or(f64::NAN, |mode| mode.frequency_hz().value)
    }

    /// The names of the parameters that shift.
    pub fn shifting(&self) -> Vec<&'static str> {
        let parameters = [
            ("frequency", self.frequency_shifts),
            ("damping", self.damping_shifts),
            ("residue", self.residue_shifts),
        ];
        let shifting = parameters.into_iter().filter(|(_, shifts)| *shifts);
        shifting.map(|(name, _)| name).collect()
    }
}

/// Whether the half-power band of a mode, omega (1 -+ zeta), lies within the excited band. A mode beyond it stands for what the band
/// does not show, such as a mode above it, and changes with the noise. A free mass has no such band.
pub fn is_within(mode: &FittedMode, (low_hz, high_hz): (f64, f64)) -> bool {
    let frequency_hz = mode.frequency_hz().value;
    let half_width_hz = mode.damping_ratio.value * frequency_hz;
    let is_free = frequency_hz == 0.0;
    is_free || (frequency_hz - half_width_hz >= low_hz && frequency_hz + half_width_hz <= high_hz)
}

/// The modes of the first run in all runs. With z = (x - x_1)/sqrt(sigma^2 + sigma_1^2), a parameter shifts where
/// erfc(|z|/sqrt 2) < 1 %/(number of compared parameters): a linear stage shows any shift in at most one of a hundred campaigns
/// (Bonferroni).
pub fn modes_over_amplitude(runs: &[Vec<FittedMode>]) -> Vec<ModeOverAmplitude> {
    let Some((first, others)) = runs.split_first() else {
        return Vec::new();
    };
    let modes = 0..first.len();
    let matched: Vec<Vec<Option<FittedMode>>> = modes.map(|k| in_runs(first, k, others)).collect();
    let limit = FALSE_ALARM / compared(&matched) as f64;
    let modes = matched.into_iter().map(|by_run| ModeOverAmplitude {
        frequency_shifts: shifts(&by_run, limit, |mode| mode.omega_rad_s),
        damping_shifts: shifts(&by_run, limit, |mode| mode.damping_ratio),
        residue_shifts: shifts(&by_run, limit, |mode| mode.residue_per_kg),
        by_run,
    });
    modes.collect()
}

/// Mode `k` of the first run in all runs.
fn in_runs(first: &[FittedMode], k: usize, others: &[Vec<FittedMode>]) -> Vec<Option<FittedMode>> {
    let others = others.iter().map(|modes| {
        let found = same_mode(first, k, modes)?;
        modes.get(found).copied()
    });
    std::iter::once(Some(first[k])).chain(others).collect()
}

/// The number of comparisons with the first run.
fn compared(matched: &[Vec<Option<FittedMode>>]) -> usize {
    let per_mode = matched
        .iter()
        .map(|by_run| by_run.iter().flatten().count() - 1);
    PARAMETERS * per_mode.sum::<usize>()
}

fn shifts(by_run: &[Option<FittedMode>], limit: f64, of: fn(&FittedMode) -> Estimate) -> bool {
    let mut estimates = by_run.iter().flatten().map(of);
    let Some(first) = estimates.next() else {
        return false;
    };
    estimates.any(|other| probability_of_difference(first, other) < limit)
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
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        }
    }

    #[test]
    fn only_differences_beyond_the_errors_are_shifts() {
        let runs = [
            vec![mode(180.0, 0.01), mode(500.0, 0.004)],
            vec![mode(180.3, 0.01), mode(500.0, 0.00403)],
            vec![mode(180.0, 0.01), mode(504.0, 0.004), mode(530.0, 0.004)],
        ];
        let modes = modes_over_amplitude(&runs);
        assert_eq!(modes.len(), 2);
        // Relative sigma of a difference: sqrt(2) 1e-3 = 1.41e-3. With 12 comparisons the threshold is |z| = 3.34,
        // that is 4.7e-3.
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
    fn mode_beyond_the_excited_band_is_not_compared() {
        let at = |hz: f64, damping_ratio: f64| {
            is_within(
                &mode(hz * std::f64::consts::TAU, damping_ratio),
                (5.0, 200.0),
            )
        };
        assert!(at(29.0, 0.01) && at(198.0, 0.01) && at(5.1, 0.01) && at(0.0, 0.0));
        assert!(!at(199.0, 0.01) && !at(160.0, 0.5) && !at(5.1, 0.03) && !at(208.0, 0.01));
    }

    #[test]
    fn does_not_match_a_different_mode_nearby() {
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
    fn noise_shifts_modes_in_at_most_one_of_a_hundred_campaigns() {
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
                residue_imaginary_per_kg: None,
                turned_by_one_more: 0.0,
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
        // Expected: at most 20 (1 %), slightly fewer because all comparisons share the first run. Sigma is 4.5: the
        // upper bound is 20 + 3 sigma; the lower bound is 4.
        assert!((4..=33).contains(&shifted), "{shifted} of 2000");
    }
}

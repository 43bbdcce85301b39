//! Set-points that came at irregular times, as those of regular times that do the same.
//!
//! A held current is a sum of steps, one at each set-point, and a step is the integral of an impulse. So the steps are moved
//! as impulses are resampled: with D_k the step of tick k, which came l_k periods later than the others do,
//!
//! ```text
//! d_j = sum over k of D_k h(j - k - l_k)        u_j = sum over i <= j of d_i        h: sinc under a Kaiser window
//! ```
//!
//! u_j, held at the regular times, has the spectrum of what was held at the irregular ones, up to 0.8 of half the rate.
//! Taken as they were set, currents whose times differ by a tenth of a period blur a response by several percent.

use super::kernel::weights_at;

/// The regular set-points in place of `set_a`, each of which came `late` periods after its regular time, from rest. Of equal
/// length.
pub fn at_regular_times(set_a: &[f64], late: &[f64]) -> Vec<f64> {
    let mut steps_a = vec![0.0; set_a.len()];
    let before_a = std::iter::once(&0.0).chain(set_a);
    for (k, ((set_a, before_a), late)) in set_a.iter().zip(before_a).zip(late).enumerate() {
        take(&mut steps_a, set_a - before_a, k as f64 + late);
    }
    let mut sum_a = 0.0;
    let held = |step_a: f64| {
        sum_a += step_a;
        sum_a
    };
    steps_a.into_iter().map(held).collect()
}

/// Spreads a step at `place`; what lies before the first tick is taken there, what lies beyond the last is not seen.
fn take(steps_a: &mut [f64], step_a: f64, place: f64) {
    if step_a == 0.0 {
        return;
    }
    for (place, weight) in weights_at(place) {
        if let Some(step) = steps_a.get_mut(place.max(0) as usize) {
            *step += weight * step_a;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// Integral of the held current times exp(-j w t), times j w: the sum of its steps at their times.
    fn spectrum(set_a: &[f64], late: &[f64], omega: f64) -> Complex<f64> {
        let before = std::iter::once(&0.0).chain(set_a);
        let step = |(k, ((set, before), late)): (usize, ((&f64, &f64), &f64))| {
            Complex::from_polar(1.0, -omega * (k as f64 + late)) * (set - before)
        };
        set_a
            .iter()
            .zip(before)
            .zip(late)
            .enumerate()
            .map(step)
            .sum()
    }

    #[test]
    fn the_spectrum_of_irregular_steps_is_kept_up_to_four_fifths_of_half_the_rate() {
        let random = |k: usize| ((k as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0);
        let n = 4000;
        let fade = |k: usize| (std::f64::consts::PI * k as f64 / n as f64).sin().powi(4);
        let set_a: Vec<f64> = (0..n).map(|k| fade(k) * (2.0 * random(k) - 1.0)).collect();
        let late: Vec<f64> = (0..n).map(|k| 0.6 * random(k + 7) - 0.3).collect();
        let regular = at_regular_times(&set_a, &late);
        // White steps of 0.5 A: a spectrum of 20 or so; the kernel is flat to 1e-4, its table to 1e-7.
        for omega in [0.01, 0.1, 0.5, 1.0, 1.8, 2.4] {
            let (truth, ours) = (
                spectrum(&set_a, &late, omega),
                spectrum(&regular, &vec![0.0; n], omega),
            );
            let untouched = spectrum(&set_a, &vec![0.0; n], omega);
            assert!((truth - ours).norm() < 0.02, "{omega}: {truth} {ours}");
            assert!(
                omega < 0.4 || (truth - untouched).norm() > 0.5,
                "the times matter: {truth} {untouched}"
            );
        }
    }

    #[test]
    fn regular_times_change_nothing_and_a_shift_by_whole_periods_is_a_shift() {
        let set_a: Vec<f64> = (0..200)
            .map(|k| {
                if k < 150 {
                    (0.3 * f64::from(k)).sin()
                } else {
                    0.0
                }
            })
            .collect();
        let same = at_regular_times(&set_a, &[0.0; 200]);
        let later = at_regular_times(&set_a, &[2.0; 200]);
        // A sum of 200 steps, each exact to a rounding.
        assert!(set_a.iter().zip(&same).all(|(a, b)| (a - b).abs() < 1e-13));
        assert!(
            set_a
                .iter()
                .zip(&later[2..])
                .all(|(a, b)| (a - b).abs() < 1e-13)
        );
    }
}

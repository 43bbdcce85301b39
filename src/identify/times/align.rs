//! Readings of irregular times on the regular times of a loop.
//!
//! A probe with a clock of its own is read at ages that change from tick to tick. Taken as of one age, its readings carry an
//! error of w (age - mean) times the signal: a probe of 650 Hz under a loop of 1 kHz blurs a response at 150 Hz by a third.
//! The ages are recorded, so the error can be undone:
//!
//! ```text
//! g    values on a regular grid, as many as there are readings
//! I    band-limited interpolation of g (sinc, Kaiser window, 2 x 16 values)
//! g <- g + (reading - I g at the time of the reading)          repeated: contracts where w |time - grid| < 1
//! ```
//!
//! and I g at any time is the position then, as long as the signal stays below some 0.8 of half the probe's rate.

use super::kernel::weights_at;

/// Repetitions: the error falls by w |time - grid| in each.
const REPETITIONS: usize = 24;

/// Readings, each with the time of its measurement in seconds; times rise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// When each was measured, in seconds.
    pub time_s: Vec<f64>,
    /// What was measured, in metres.
    pub position_m: Vec<f64>,
}

impl Readings {
    /// Takes a reading; one that is not newer than the last is the same again.
    pub fn push(&mut self, time_s: f64, position_m: f64) {
        if self.time_s.last().is_none_or(|last| time_s > *last) {
            self.time_s.push(time_s);
            self.position_m.push(position_m);
        }
    }

    /// The positions at `start_s + k period_s`, k from 0 to `count` - 1. With fewer than two readings there is nothing to
    /// interpolate, and the answer is empty.
    pub fn at_regular_times(&self, start_s: f64, period_s: f64, count: usize) -> Vec<f64> {
        let (Some(first_s), Some(last_s)) = (self.time_s.first(), self.time_s.last()) else {
            return Vec::new();
        };
        let spacing_s = (last_s - first_s) / (self.time_s.len().saturating_sub(1)) as f64;
        if !(spacing_s > 0.0 && spacing_s.is_finite()) {
            return Vec::new();
        }
        // A grid finer than the loop would have cells without readings; one coarser loses none.
        let step_s = if spacing_s < 1.05 * period_s {
            period_s
        } else {
            spacing_s
        };
        let from_s = if step_s == period_s {
            start_s
        } else {
            *first_s
        };
        let cells = ((last_s - from_s) / step_s).round().max(0.0) as usize + 1;
        let grid = Grid::through(self, from_s, step_s, cells);
        (0..count)
            .map(|k| grid.at(start_s + k as f64 * period_s))
            .collect()
    }
}

/// Values at `from_s + j step_s`.
struct Grid {
    from_s: f64,
    step_s: f64,
    values: Vec<f64>,
}

impl Grid {
    /// The grid whose interpolation passes through the reading nearest to each of its times.
    fn through(readings: &Readings, from_s: f64, step_s: f64, cells: usize) -> Grid {
        let nearest = nearest(readings, from_s, step_s, cells);
        let values = nearest.iter().map(|(_, position_m)| *position_m).collect();
        let mut grid = Grid {
            from_s,
            step_s,
            values,
        };
        for _ in 0..REPETITIONS {
            let missed: Vec<f64> = nearest
                .iter()
                .map(|(time_s, position_m)| position_m - grid.at(*time_s))
                .collect();
            grid.values
                .iter_mut()
                .zip(&missed)
                .for_each(|(value, missed)| *value += missed);
        }
        grid
    }

    /// The interpolation at a time; beyond the ends the outermost values go on.
    fn at(&self, time_s: f64) -> f64 {
        let last = self.values.len() as i64 - 1;
        let value = |place: i64| self.values[place.clamp(0, last) as usize];
        weights_at((time_s - self.from_s) / self.step_s)
            .map(|(place, weight)| weight * value(place))
            .sum()
    }
}

/// Time and value of the reading nearest to each time of the grid.
fn nearest(readings: &Readings, from_s: f64, step_s: f64, cells: usize) -> Vec<(f64, f64)> {
    let mut index = 0;
    let times = &readings.time_s;
    let of = |cell: usize| {
        let at_s = from_s + cell as f64 * step_s;
        while index + 1 < times.len()
            && (times[index + 1] - at_s).abs() <= (times[index] - at_s).abs()
        {
            index += 1;
        }
        (times[index], readings.position_m[index])
    };
    (0..cells).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three tones, at rest at both ends.
    fn signal(time_s: f64) -> f64 {
        let fade = if (0.0..=4.0).contains(&time_s) {
            (std::f64::consts::PI * time_s / 4.0).sin().powi(2)
        } else {
            0.0
        };
        fade * [(3.0, 1.0), (31.0, 0.4), (170.0, 0.2)]
            .map(|(hz, a): (f64, f64)| a * (std::f64::consts::TAU * hz * time_s).sin())
            .iter()
            .sum::<f64>()
    }

    fn random() -> impl FnMut() -> f64 {
        let mut seed = 7u64;
        move || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    fn largest_error(readings: &Readings, offset_s: f64) -> f64 {
        let regular = readings.at_regular_times(offset_s, 1e-3, 4000);
        let error = |(k, y): (usize, &f64)| (y - signal(offset_s + k as f64 * 1e-3)).abs();
        regular
            .iter()
            .enumerate()
            .skip(20)
            .take(3960)
            .map(error)
            .fold(0.0, f64::max)
    }

    #[test]
    fn a_slow_probe_of_its_own_clock_is_undone_to_a_thousandth() {
        let mut readings = Readings::default();
        (0..2620).for_each(|j| {
            let time_s = f64::from(j) / 650.0 * 1.0007;
            readings.push(time_s, signal(time_s));
        });
        // 170 Hz is 0.52 of half the probe's rate, deep inside the pass band of the window: 1e-4, and the table's 1e-7.
        assert!(
            largest_error(&readings, -0.0017) < 1e-3,
            "{}",
            largest_error(&readings, -0.0017)
        );
    }

    #[test]
    fn a_fast_probe_read_at_the_loops_ticks_is_undone_to_a_thousandth() {
        let (mut readings, mut random) = (Readings::default(), random());
        (0..4100).for_each(|k| {
            let time_s = f64::from(k) * 1e-3 - 0.0002 - 0.00025 * random();
            readings.push(time_s, signal(time_s));
        });
        // Taken as they are, the readings err by 0.2 x 2 pi 170 Hz x 125 us = 2.7 %.
        assert!(
            largest_error(&readings, -0.000325) < 1e-3,
            "{}",
            largest_error(&readings, -0.000325)
        );
    }

    #[test]
    fn the_same_reading_again_counts_once_and_lost_ones_leave_no_hole() {
        let mut readings = Readings::default();
        (0..4100).filter(|k| k % 97 != 0).for_each(|k| {
            let time_s = f64::from(k) * 1e-3;
            readings.push(time_s, signal(time_s));
            readings.push(time_s, 99.0);
        });
        assert!(readings.position_m.iter().all(|y| *y < 2.0));
        // A lost reading is filled by its neighbour's, and the iteration finds what is consistent: 10 % at 170 Hz.
        assert!(largest_error(&readings, 0.0) < 0.25);
        assert!(
            Readings::default()
                .at_regular_times(0.0, 1e-3, 5)
                .is_empty()
        );
    }
}

//! Readings at irregular times, resampled to the regular ticks of a loop.
//!
//! A probe with its own clock is read at ages that change from tick to tick. If one age is assumed for all, the readings
//! have an error of w (age - mean) times the signal: with a probe of 650 Hz in a loop of 1 kHz the response at 150 Hz is a
//! third too small. The ages are recorded, so the error can be corrected:
//!
//! ```text
//! g    values on a regular grid, as many as there are readings
//! I    band-limited interpolation of g (sinc, Kaiser window, 2 x 24 values) at the times of the readings
//! |reading - I g|^2 -> min         conjugate gradients; I is nearly a shift, which has condition 1: a few steps suffice
//! ```
//!
//! I g at any time is then the position, if the signal stays below some 0.8 of half the probe's rate. (Richardson's iteration,
//! g + reading - I g, converges with w |time - grid| only: at 0.3 times the rate it leaves half a per cent after 24 steps.)

use super::kernel::Place;

/// Largest number of iterations. More of them amplify noise near half the rate, where the interpolation has little response.
const ITERATIONS: usize = 16;
/// The iteration ends when the RMS error is below this ratio of the largest value of the grid: some hundred roundings.
const CONVERGED_RATIO: f64 = 1e-13;
/// Grids up to this ratio wider than the loop's period use the period itself.
const SAME_SPACING: f64 = 1.05;

/// Readings, each with the time of its measurement in seconds; times rise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Readings {
    /// Times of measurement in seconds.
    pub time_s: Vec<f64>,
    /// Measured positions in metres.
    pub position_m: Vec<f64>,
}

impl Readings {
    /// Appends a reading, unless it is not newer than the last one and therefore a repetition of it.
    pub fn push(&mut self, time_s: f64, position_m: f64) {
        if self.time_s.last().is_none_or(|last| time_s > *last) {
            self.time_s.push(time_s);
            self.position_m.push(position_m);
        }
    }

    /// The positions at `start_s + k period_s`, k from 0 to `count` - 1; empty with fewer than two readings.
    pub fn at_regular_times(&self, start_s: f64, period_s: f64, count: usize) -> Vec<f64> {
        let Some(grid) = self.grid(start_s, period_s) else {
            return Vec::new();
        };
        let grid = Grid::through(self, grid);
        (0..count)
            .map(|k| grid.at(start_s + k as f64 * period_s))
            .collect()
    }

    /// A grid of zeros with at most one point per reading. A grid finer than the loop's would have points without readings; a
    /// coarser one loses none.
    fn grid(&self, start_s: f64, period_s: f64) -> Option<Grid> {
        let (first_s, last_s) = (*self.time_s.first()?, *self.time_s.last()?);
        let spacing_s = (last_s - first_s) / self.time_s.len().saturating_sub(1) as f64;
        if !(spacing_s > 0.0 && spacing_s.is_finite()) {
            return None;
        }
        let (from_s, step_s) = if spacing_s < SAME_SPACING * period_s {
            (start_s, period_s)
        } else {
            (first_s, spacing_s)
        };
        let points = ((last_s - from_s) / step_s).round().max(0.0) as usize + 1;
        Some(Grid {
            from_s,
            step_s,
            values: vec![0.0; points],
        })
    }

    /// The position at each point of a grid, on straight lines between the readings.
    fn on_lines(&self, grid: &Grid) -> Vec<f64> {
        let times = &self.time_s;
        let mut after = 1;
        let points = (0..grid.values.len()).map(|point| grid.from_s + point as f64 * grid.step_s);
        points
            .map(|at_s| {
                while after + 1 < times.len() && times[after] < at_s {
                    after += 1;
                }
                let (from_s, to_s) = (times[after - 1], times[after]);
                let share = ((at_s - from_s) / (to_s - from_s)).clamp(0.0, 1.0);
                let (from_m, to_m) = (self.position_m[after - 1], self.position_m[after]);
                from_m + (to_m - from_m) * share
            })
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
    /// The grid whose interpolation is nearest to the readings, beginning with straight lines between them.
    fn through(readings: &Readings, mut grid: Grid) -> Grid {
        grid.values = readings.on_lines(&grid);
        let negligible_m2 = {
            let negligible_m = CONVERGED_RATIO * largest(&grid.values);
            negligible_m * negligible_m * grid.values.len() as f64
        };
        let times = readings.time_s.iter();
        let places: Vec<Place> = times.map(|time_s| grid.place(*time_s)).collect();
        let fitted = interpolation(&places, &grid.values);
        let readings_m = readings.position_m.iter();
        let mut errors_m: Vec<f64> = readings_m.zip(fitted).map(|(y, g)| y - g).collect();
        let count = grid.values.len();
        let mut gradient = transposed(&places, &errors_m, count);
        let mut direction = gradient.clone();
        for _ in 0..ITERATIONS {
            let slope = square(&gradient);
            if square(&errors_m) <= negligible_m2 || slope == 0.0 {
                break;
            }
            let change = interpolation(&places, &direction);
            let step = slope / square(&change);
            if !step.is_finite() {
                break;
            }
            add(&mut grid.values, step, &direction);
            add(&mut errors_m, -step, &change);
            gradient = transposed(&places, &errors_m, count);
            let beta = square(&gradient) / slope;
            for (direction, gradient) in direction.iter_mut().zip(&gradient) {
                *direction = gradient + beta * *direction;
            }
        }
        grid
    }

    fn place(&self, time_s: f64) -> Place {
        Place::at((time_s - self.from_s) / self.step_s)
    }

    /// The interpolation at a time; the outermost values continue beyond the ends.
    fn at(&self, time_s: f64) -> f64 {
        interpolated(&self.place(time_s), &self.values)
    }
}

/// The values interpolated at each place.
fn interpolation(places: &[Place], values: &[f64]) -> Vec<f64> {
    let places = places.iter();
    places.map(|place| interpolated(place, values)).collect()
}

fn interpolated(place: &Place, values: &[f64]) -> f64 {
    let inside = usize::try_from(place.first).ok();
    let inside = inside.and_then(|first| values.get(first..)?.first_chunk());
    match inside {
        Some(samples) => place.interpolate(samples),
        None => {
            let indices = place.indices_within(values.len());
            place.interpolate(&indices.map(|index| values[index]))
        }
    }
}

/// The transpose of [`interpolation`]: what each place gives to each of `count` values.
fn transposed(places: &[Place], at_places: &[f64], count: usize) -> Vec<f64> {
    let mut values = vec![0.0; count];
    for (place, value) in places.iter().zip(at_places) {
        let indices = place.indices_within(values.len());
        for (index, weight) in indices.into_iter().zip(place.weights()) {
            values[index] += weight * value;
        }
    }
    values
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

fn add(values: &mut [f64], factor: f64, others: &[f64]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value += factor * other;
    }
}

/// The largest magnitude.
fn largest(values: &[f64]) -> f64 {
    values
        .iter()
        .fold(0.0, |largest, value| value.abs().max(largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three tones, at rest at both ends.
    fn signal(time_s: f64) -> f64 {
        if !(0.0..=4.0).contains(&time_s) {
            return 0.0;
        }
        let fade = (std::f64::consts::PI * time_s / 4.0).sin().powi(2);
        let tone = |(hz, a): (f64, f64)| a * (std::f64::consts::TAU * hz * time_s).sin();
        fade * [(3.0, 1.0), (31.0, 0.4), (170.0, 0.2)]
            .map(tone)
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
    fn resamples_slow_free_running_probe_to_ten_ppm() {
        let mut readings = Readings::default();
        (0..2620).for_each(|j| {
            let time_s = f64::from(j) / 650.0 * 1.0007;
            readings.push(time_s, signal(time_s));
        });
        // 170 Hz is 0.52 of half the probe's rate, inside the pass band of the window: 1e-6, and the table's 1e-7.
        assert!(
            largest_error(&readings, -0.0017) < 1e-5,
            "{}",
            largest_error(&readings, -0.0017)
        );
    }

    #[test]
    fn resamples_fast_probe_with_varying_age_to_ten_ppm() {
        let (mut readings, mut random) = (Readings::default(), random());
        (0..4100).for_each(|k| {
            let time_s = f64::from(k) * 1e-3 - 0.0002 - 0.00025 * random();
            readings.push(time_s, signal(time_s));
        });
        // Without the correction the readings err by 0.2 x 2 pi 170 Hz x 125 us = 2.7 %.
        assert!(
            largest_error(&readings, -0.000325) < 1e-5,
            "{}",
            largest_error(&readings, -0.000325)
        );
    }

    #[test]
    fn ignores_repeated_readings_and_bridges_lost_ones() {
        let mut readings = Readings::default();
        (0..4100).filter(|k| k % 97 != 0).for_each(|k| {
            let time_s = f64::from(k) * 1e-3;
            readings.push(time_s, signal(time_s));
            readings.push(time_s, 99.0);
        });
        assert!(readings.position_m.iter().all(|y| *y < 2.0));
        // The grid between the readings beside a lost one begins with a line through them and is not determined by readings there: of the
        // 0.2 at 170 Hz a third is lost.
        assert!(largest_error(&readings, 0.0) < 0.25);
        assert!(
            Readings::default()
                .at_regular_times(0.0, 1e-3, 5)
                .is_empty()
        );
    }
}

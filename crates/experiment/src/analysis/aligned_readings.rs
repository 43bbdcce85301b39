//! Readings at irregular times, with replaceable readings in the ticks that are missing.

use bench_identify::resampling::Readings;

/// A missing tick nearer to a reading than this, in periods, has one: that of a probe with its own clock.
const NEAR_PERIODS: f64 = 0.5;

/// Readings that are resampled to the regular times `start_s + k period_s`.
pub(super) struct AlignedReadings {
    readings: Readings,
    start_s: f64,
    period_s: f64,
    /// Tick and index in the readings of each reading that stands for a missing one.
    replaced: Vec<(usize, usize)>,
}

impl AlignedReadings {
    pub(super) fn new(readings: Readings, start_s: f64, period_s: f64) -> AlignedReadings {
        AlignedReadings {
            readings,
            start_s,
            period_s,
            replaced: Vec::new(),
        }
    }

    /// With a reading on a straight line in each missing tick. The ticks rise.
    pub(super) fn with_missing(self, ticks: &[usize]) -> AlignedReadings {
        let mut all = AlignedReadings::new(Readings::default(), self.start_s, self.period_s);
        let mut next = 0;
        for tick in ticks {
            let time_s = self.start_s + *tick as f64 * self.period_s;
            let after = self.readings.time_s.partition_point(|t| *t < time_s);
            all.copy(&self.readings, next, after);
            next = after;
            if let Some(position_m) = self.on_line(after, time_s) {
                all.replaced.push((*tick, all.readings.time_s.len()));
                all.readings.push(time_s, position_m);
            }
        }
        all.copy(&self.readings, next, self.readings.time_s.len());
        all
    }

    fn copy(&mut self, readings: &Readings, from: usize, to: usize) {
        let (time_s, position_m) = (&readings.time_s[from..to], &readings.position_m[from..to]);
        self.readings.time_s.extend_from_slice(time_s);
        self.readings.position_m.extend_from_slice(position_m);
    }

    /// The position on the line between the readings before and after a time; `None` if it is too near to one, or not between two.
    fn on_line(&self, after: usize, time_s: f64) -> Option<f64> {
        let (times, positions) = (&self.readings.time_s, &self.readings.position_m);
        let before = after.checked_sub(1)?;
        let (from_s, to_s) = (times[before], *times.get(after)?);
        let near_s = NEAR_PERIODS * self.period_s;
        if time_s - from_s < near_s || to_s - time_s < near_s {
            return None;
        }
        let share = (time_s - from_s) / (to_s - from_s);
        Some(positions[before] + share * (positions[after] - positions[before]))
    }

    /// Replaces the readings of missing ticks by the positions of those ticks.
    pub(super) fn replace_missing(&mut self, position_m: &[f64]) {
        for (tick, index) in &self.replaced {
            self.readings.position_m[*index] = position_m[*tick];
        }
    }

    /// The positions at the first `count` regular times; `None` with fewer than two readings.
    pub(super) fn positions_m(&self, count: usize) -> Option<Vec<f64>> {
        let (start_s, period_s) = (self.start_s, self.period_s);
        let aligned = self.readings.at_regular_times(start_s, period_s, count);
        Some(aligned).filter(|aligned| aligned.len() == count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1e-3;
    const COUNT: usize = 2000;

    fn motion_m(time_s: f64) -> f64 {
        1e-4 * (400.0 * time_s).sin()
    }

    fn is_missing(tick: &usize) -> bool {
        tick % 100 == 50 || (1200..1210).contains(tick)
    }

    /// Readings at times that vary by 0.1 of a period, without those of missing ticks.
    fn readings() -> Readings {
        let mut readings = Readings::default();
        for tick in (0..COUNT).filter(|tick| !is_missing(tick)) {
            let shift = 0.1 * (tick as f64 * 12.9898).sin();
            let time_s = (tick as f64 + shift) * PERIOD_S;
            readings.push(time_s, motion_m(time_s));
        }
        readings
    }

    /// The largest error away from the ends, over the amplitude.
    fn largest_error(aligned: &AlignedReadings) -> f64 {
        let positions_m = aligned.positions_m(COUNT).expect("positions");
        let error = |tick: usize| (positions_m[tick] - motion_m(tick as f64 * PERIOD_S)).abs();
        (50..COUNT - 50).map(error).fold(0.0, f64::max) / 1e-4
    }

    #[test]
    fn replaced_readings_leave_no_error_beside_them() {
        let missing: Vec<usize> = (0..COUNT).filter(is_missing).collect();
        let mut aligned = AlignedReadings::new(readings(), 0.0, PERIOD_S).with_missing(&missing);
        assert_eq!(aligned.replaced.len(), missing.len());
        // Ten ticks are 4 rad of the motion, which a line does not follow.
        assert!(largest_error(&aligned) > 0.5);
        let truth_m: Vec<f64> = (0..COUNT)
            .map(|tick| motion_m(tick as f64 * PERIOD_S))
            .collect();
        aligned.replace_missing(&truth_m);
        // The kernel is flat to 1e-4.
        let error = largest_error(&aligned);
        assert!(error < 1e-3, "{error}");
    }

    #[test]
    fn tick_with_a_reading_of_a_free_running_probe_keeps_it() {
        let mut readings = Readings::default();
        for k in 0..200 {
            readings.push(f64::from(k) * 0.25 * PERIOD_S, 0.0);
        }
        let aligned = AlignedReadings::new(readings.clone(), 0.0, PERIOD_S).with_missing(&[7, 8]);
        assert!(aligned.replaced.is_empty());
        assert_eq!(aligned.readings, readings);
    }
}

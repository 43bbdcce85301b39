//! Static steps up and down: 0, +A/n, ..., +A, ..., 0, ..., -A, ..., 0, each held until the stage rests.
//!
//! ```text
//!            ___
//!         __|   |__
//!      __|         |__            __         each level: ramp (cosine), settle, average
//!                     |__      __|
//!                        |____|
//! ```

use super::waveform::{Excitation, ticks};

/// Levels and times of a staircase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaircaseSteps {
    /// Largest current in amperes, to both sides.
    pub amplitude_a: f64,
    /// Levels on either side of zero.
    pub levels: u32,
    /// Time in seconds of the ramp from one level to the next.
    pub ramp_s: f64,
    /// Time in seconds for the stage to come to rest.
    pub settle_s: f64,
    /// Time in seconds over which a level is averaged.
    pub average_s: f64,
}

/// A staircase of current.
#[derive(Clone, Debug, PartialEq)]
pub struct Staircase {
    levels_a: Vec<f64>,
    ramp_ticks: u64,
    settle_ticks: u64,
    average_ticks: u64,
}

impl Staircase {
    /// The staircase for a loop of this period.
    pub fn new(settings: &StaircaseSteps, period_s: f64) -> Staircase {
        let n = i64::from(settings.levels);
        let steps = (0..=n).chain((-n..n).rev()).chain(-n + 1..=0);
        let times_s = [settings.ramp_s, settings.settle_s, settings.average_s];
        let [ramp_ticks, settle_ticks, average_ticks] =
            times_s.map(|time_s| ticks(time_s, period_s).max(1));
        Staircase {
            levels_a: steps
                .map(|step| settings.amplitude_a * step as f64 / n as f64)
                .collect(),
            ramp_ticks,
            settle_ticks,
            average_ticks,
        }
    }

    /// The level whose average includes the tick, if there is one.
    pub fn level(&self, tick: u64) -> Option<usize> {
        let within = tick % self.level_ticks();
        let level = (tick / self.level_ticks()) as usize;
        (within >= self.ramp_ticks + self.settle_ticks && level < self.levels_a.len())
            .then_some(level)
    }

    /// Current of each level in amperes, in order.
    pub fn levels_a(&self) -> &[f64] {
        &self.levels_a
    }

    fn level_ticks(&self) -> u64 {
        self.ramp_ticks + self.settle_ticks + self.average_ticks
    }
}

impl Excitation for Staircase {
    fn current_a(&self, tick: u64) -> f64 {
        let (level, within) = (
            (tick / self.level_ticks()) as usize,
            tick % self.level_ticks(),
        );
        let Some(&to_a) = self.levels_a.get(level) else {
            return 0.0;
        };
        let from_a = level
            .checked_sub(1)
            .map_or(0.0, |before| self.levels_a[before]);
        let share = (within as f64 / self.ramp_ticks as f64).min(1.0);
        from_a + (to_a - from_a) * (0.5 - 0.5 * libm::cos(std::f64::consts::PI * share))
    }

    fn active(&self, tick: u64) -> bool {
        tick < self.ticks()
    }

    fn ticks(&self) -> u64 {
        self.level_ticks() * self.levels_a.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staircase() -> Staircase {
        let settings = StaircaseSteps {
            amplitude_a: 0.4,
            levels: 2,
            ramp_s: 0.2,
            settle_s: 1.0,
            average_s: 0.5,
        };
        Staircase::new(&settings, 1e-3)
    }

    #[test]
    fn levels_rise_and_fall_on_both_sides_and_end_at_zero() {
        let levels = staircase().levels_a().to_vec();
        assert_eq!(levels, [0.0, 0.2, 0.4, 0.2, 0.0, -0.2, -0.4, -0.2, 0.0]);
    }

    #[test]
    fn each_level_is_reached_by_a_ramp_and_averaged_after_it_settled() {
        let staircase = staircase();
        assert_eq!(staircase.ticks(), 9 * 1700);
        assert_eq!(staircase.current_a(1700), 0.0);
        assert!(
            (staircase.current_a(1800) - 0.1).abs() < 1e-12,
            "half of the ramp, half of the way"
        );
        for tick in 1900..3400 {
            assert_eq!(staircase.current_a(tick), 0.2);
            assert_eq!(staircase.level(tick), (tick >= 2900).then_some(1));
        }
        let largest = (1..staircase.ticks())
            .map(|t| (staircase.current_a(t) - staircase.current_a(t - 1)).abs());
        // The slope of the ramp at its middle, pi/2 times the mean one.
        assert!(largest.fold(0.0, f64::max) < 0.2 / 200.0 * 1.6);
        assert_eq!(
            (
                staircase.current_a(staircase.ticks()),
                staircase.level(staircase.ticks())
            ),
            (0.0, None)
        );
    }
}

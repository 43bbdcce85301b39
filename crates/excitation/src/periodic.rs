//! A table of one period, repeated.
//!
//! ```text
//!  quiet | fade in, settle | measured periods | fade out | quiet
//!        0           settle_periods     + periods
//! ```
//!
//! It fades in over half of the settling periods at most, so that transients decay in the other half. It fades out after the
//! last measured period. There is no step at either end, and all measured periods are equal.

use super::amplitude::fade;
use super::design::SharedSettings;
use super::waveform::{Excitation, Pattern};

/// A periodic excitation.
#[derive(Clone, Debug)]
pub struct Periodic {
    /// One period in amperes, one number per tick.
    table: Vec<f64>,
    start_tick: u64,
    settle_periods: u64,
    measured_periods: u64,
    fade_in_ticks: u64,
    fade_out_ticks: u64,
    quiet_after_ticks: u64,
}

impl Periodic {
    /// `table` repeated, with the zero current before and after and the fades of `[chirp]`.
    pub(super) fn new(
        shared: &SharedSettings<'_>,
        table: Vec<f64>,
        settle_periods: u32,
        measured_periods: u32,
    ) -> Periodic {
        let chirp = shared.chirp;
        let settle = table.len() as u64 * u64::from(settle_periods);
        Periodic {
            start_tick: shared.ticks(chirp.quiet_before_s),
            settle_periods: u64::from(settle_periods),
            measured_periods: u64::from(measured_periods),
            fade_in_ticks: shared.ticks(chirp.fade_in_s).min(settle / 2),
            fade_out_ticks: shared.ticks(chirp.fade_out_s),
            quiet_after_ticks: shared.ticks(chirp.quiet_after_s),
            table,
        }
    }

    /// One period in amperes.
    pub fn table(&self) -> &[f64] {
        &self.table
    }

    /// Length in ticks of a periodic excitation, before it is built.
    pub(super) fn length(shared: &SharedSettings<'_>, period_s: f64, periods: u32) -> f64 {
        let periods_s = period_s * f64::from(periods);
        (shared.quiet_s() + periods_s + shared.chirp.fade_out_s) * shared.rate_hz
    }

    /// Ticks of the whole periods.
    fn whole(&self) -> u64 {
        self.table.len() as u64 * (self.settle_periods + self.measured_periods)
    }
}

impl Excitation for Periodic {
    fn current_a(&self, tick: u64) -> f64 {
        if !self.active(tick) {
            return 0.0;
        }
        let at = tick - self.start_tick;
        let (begun, left) = (at as f64, (self.whole() + self.fade_out_ticks - at) as f64);
        let envelope =
            fade(begun, self.fade_in_ticks as f64) * fade(left, self.fade_out_ticks as f64);
        self.table[(at % self.table.len() as u64) as usize] * envelope
    }

    fn active(&self, tick: u64) -> bool {
        (self.start_tick..self.start_tick + self.whole() + self.fade_out_ticks).contains(&tick)
            && !self.table.is_empty()
    }

    fn ticks(&self) -> u64 {
        self.start_tick + self.whole() + self.fade_out_ticks + self.quiet_after_ticks
    }

    fn pattern(&self) -> Pattern {
        Pattern::Periodic {
            start: self.start_tick as usize,
            period: self.table.len(),
            skip: self.settle_periods as usize,
            periods: self.measured_periods as usize,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_profile::profile;

    #[test]
    fn fades_in_while_settling_repeats_and_fades_out_after_the_last_period() {
        let mut config = profile();
        let chirp = &mut config.chirp;
        (
            chirp.quiet_before_s,
            chirp.quiet_after_s,
            chirp.fade_in_s,
            chirp.fade_out_s,
        ) = (0.02, 0.04, 5.0, 0.01);
        let table: Vec<f64> = (0..200).map(|n| libm::sin(f64::from(n))).collect();
        let shared = config.chosen_excitation().shared;
        let periodic = Periodic::new(&shared, table.clone(), 2, 5);
        // At 5 kHz: 100 ticks of zero current, 7 periods, 50 ticks of fade, 200 of zero current.
        assert_eq!(periodic.ticks(), 100 + 1400 + 50 + 200);
        assert_eq!(
            periodic.pattern(),
            Pattern::Periodic {
                start: 100,
                period: 200,
                skip: 2,
                periods: 5
            }
        );
        for tick in 0..periodic.ticks() {
            let (current_a, active) = (periodic.current_a(tick), (100..1550).contains(&tick));
            assert_eq!(periodic.active(tick), active, "{tick}");
            match tick {
                0..=100 | 1550.. => assert_eq!(current_a, 0.0, "{tick}"),
                // The fade-in ends after half of the settling periods (tick 300).
                300..=1500 => assert_eq!(current_a, table[(tick as usize - 100) % 200], "{tick}"),
                _ => assert!(current_a.abs() < 1.0, "{tick}"),
            }
        }
        // The fades begin and end with (pi/2 n/N)^2, N = 200 and 50 ticks.
        assert!(periodic.current_a(101).abs() < 7e-5 && periodic.current_a(1549).abs() < 1e-3);
    }
}

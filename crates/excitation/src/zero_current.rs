//! Zero current, while the rest position of the stage is measured.

use super::waveform::{Excitation, ticks};

/// Zero current: the stage settles, and its position is then averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZeroCurrent {
    settle_ticks: u64,
    ticks: u64,
}

impl ZeroCurrent {
    /// Times in seconds to settle and to average, for a loop of this period.
    pub fn new(settle_s: f64, average_s: f64, period_s: f64) -> ZeroCurrent {
        let settle_ticks = ticks(settle_s, period_s);
        ZeroCurrent {
            settle_ticks,
            ticks: settle_ticks + ticks(average_s, period_s).max(1),
        }
    }
}

impl Excitation for ZeroCurrent {
    fn current_a(&self, _tick: u64) -> f64 {
        0.0
    }

    /// While the position is averaged.
    fn active(&self, tick: u64) -> bool {
        (self.settle_ticks..self.ticks).contains(&tick)
    }

    fn ticks(&self) -> u64 {
        self.ticks
    }
}

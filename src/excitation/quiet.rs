//! No current at all, while the place where the stage rests is looked at.

use super::Excitation;
use crate::config::CampaignSettings;

/// Zero current: the stage settles, and is then averaged over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quiet {
    settle_ticks: u64,
    ticks: u64,
}

impl Quiet {
    /// The quiet of the settings at a period of the loop.
    pub fn new(settings: &CampaignSettings, period_s: f64) -> Quiet {
        let ticks = |seconds: f64| libm::round(seconds / period_s) as u64;
        let settle_ticks = ticks(settings.settle_s);
        Quiet {
            settle_ticks,
            ticks: settle_ticks + ticks(settings.average_s).max(1),
        }
    }
}

impl Excitation for Quiet {
    fn current_a(&self, _tick: u64) -> f64 {
        0.0
    }

    /// While it is averaged over.
    fn active(&self, tick: u64) -> bool {
        (self.settle_ticks..self.ticks).contains(&tick)
    }

    fn ticks(&self) -> u64 {
        self.ticks
    }
}

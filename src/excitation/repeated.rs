//! A chirp, its quiet included, over and over.

use super::{Chirp, Excitation, Pattern};
use crate::config::ChirpSettings;

/// A chirp repeated: each repetition begins and ends at rest, so that their mean is one chirp with less noise.
#[derive(Clone, Debug)]
pub struct Repeated {
    chirp: Chirp,
    count: u64,
}

impl Repeated {
    /// As often as the settings say.
    pub fn new(chirp: Chirp, settings: &ChirpSettings) -> Repeated {
        Repeated { chirp, count: u64::from(settings.repetitions) }
    }

    /// The tick within its repetition.
    fn within(&self, tick: u64) -> Option<u64> {
        (tick < self.ticks()).then(|| tick % self.chirp.ticks())
    }
}

impl Excitation for Repeated {
    fn current_a(&self, tick: u64) -> f64 {
        self.within(tick).map_or(0.0, |tick| self.chirp.current_a(tick))
    }

    fn active(&self, tick: u64) -> bool {
        self.within(tick).is_some_and(|tick| self.chirp.active(tick))
    }

    fn ticks(&self) -> u64 {
        self.chirp.ticks() * self.count
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        self.chirp.frequency_at_hz(self.within(tick)?)
    }

    fn pattern(&self) -> Pattern {
        Pattern::Repeated { period: self.chirp.ticks() as usize, count: self.count as usize }
    }
}

//! An excitation, including its zero current before and after, several times.

use super::waveform::{Excitation, Pattern};

/// Repetitions that each begin and end at rest, so that their mean is one of them with less noise.
#[derive(Clone, Debug)]
pub(super) struct Repeated<E> {
    once: E,
    count: u64,
}

impl<E: Excitation> Repeated<E> {
    /// `count` repetitions.
    pub(super) fn new(once: E, count: u32) -> Repeated<E> {
        Repeated {
            once,
            count: u64::from(count),
        }
    }

    /// The tick within its repetition.
    fn within(&self, tick: u64) -> Option<u64> {
        (tick < self.ticks()).then(|| tick % self.once.ticks())
    }
}

impl<E: Excitation> Excitation for Repeated<E> {
    fn current_a(&self, tick: u64) -> f64 {
        self.within(tick)
            .map_or(0.0, |tick| self.once.current_a(tick))
    }

    fn active(&self, tick: u64) -> bool {
        self.within(tick).is_some_and(|tick| self.once.active(tick))
    }

    fn ticks(&self) -> u64 {
        self.once.ticks() * self.count
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        self.once.frequency_at_hz(self.within(tick)?)
    }

    fn pattern(&self) -> Pattern {
        Pattern::Repeated {
            period: self.once.ticks() as usize,
            count: self.count as usize,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Chirp;
    use crate::test_profile::profile;

    #[test]
    fn every_repetition_is_the_chirp_bit_for_bit() {
        let mut settings = profile().chirp;
        (
            settings.duration_s,
            settings.quiet_before_s,
            settings.quiet_after_s,
            settings.repetitions,
        ) = (6.0, 0.1, 0.2, 3);
        let chirp = Chirp::new(&settings, 1e-3);
        let repeated = Repeated::new(chirp.clone(), settings.repetitions);
        assert_eq!(repeated.ticks(), 3 * 6300);
        assert_eq!(
            repeated.pattern(),
            Pattern::Repeated {
                period: 6300,
                count: 3
            }
        );
        for tick in 0..20_000 {
            let once = if tick < 3 * 6300 {
                chirp.current_a(tick % 6300)
            } else {
                0.0
            };
            assert_eq!(repeated.current_a(tick).to_bits(), once.to_bits(), "{tick}");
            assert_eq!(
                repeated.active(tick),
                tick < 3 * 6300 && chirp.active(tick % 6300)
            );
        }
    }
}

//! A reference behind the filters of a command.

use super::filter::CommandFilter;
use super::source::{CommandSource, LoopCommand};
use super::taps::Taps;
use crate::waveform::Reference;

/// A reference behind the filters of a command. The reference is 0 before tick 0.
///
/// It keeps the values of the reference that its filters need in a ring: the value of tick t at the place t modulo its length. From one
/// tick to the next it evaluates the reference once.
pub struct FilteredCommand {
    reference: Box<dyn Reference>,
    filter: CommandFilter,
    /// Shortest delay of the filters, in ticks: 0 or negative.
    first: i64,
    window_m: Vec<f64>,
    tick: i64,
    now: LoopCommand,
}

impl FilteredCommand {
    /// The command of `reference` behind `filter`.
    pub fn new(reference: Box<dyn Reference>, filter: CommandFilter) -> FilteredCommand {
        let (first, last) = filter.span_ticks();
        let mut command = FilteredCommand {
            reference,
            filter,
            first,
            window_m: vec![0.0; (last - first) as usize + 1],
            tick: 0,
            now: LoopCommand::default(),
        };
        command.move_to(0);
        command
    }

    /// Fills the ring for a tick, whatever it contains.
    fn move_to(&mut self, tick: i64) {
        let newest = tick.saturating_sub(self.first);
        for back in 0..self.window_m.len() as i64 {
            self.read_reference(newest - back);
        }
        self.finish(tick);
    }

    /// Goes to the next tick: one more value of the reference.
    fn advance(&mut self) {
        let tick = self.tick.saturating_add(1);
        self.read_reference(tick.saturating_sub(self.first));
        self.finish(tick);
    }

    fn read_reference(&mut self, tick: i64) {
        let value_m = u64::try_from(tick).map_or(0.0, |tick| self.reference.at_m(tick));
        let place = self.place(tick);
        self.window_m[place] = value_m;
    }

    fn finish(&mut self, tick: i64) {
        self.tick = tick;
        self.now = LoopCommand {
            reference_m: self.filtered(self.filter.reference()),
            feedforward_a: self.filtered(self.filter.feedforward()),
        };
    }

    fn filtered(&self, taps: &Taps) -> f64 {
        let (length, now) = (self.window_m.len() as i64, self.place(self.tick) as i64);
        let terms = taps.as_slice().iter().map(|tap| {
            // A delay is shorter than the ring: one turn is enough, without a division.
            let place = match now - tap.delay_ticks {
                before if before < 0 => before + length,
                after if after >= length => after - length,
                within => within,
            };
            tap.weight * self.window_m[place as usize]
        });
        terms.sum()
    }

    /// The place of a tick in the ring, which has at least one.
    fn place(&self, tick: i64) -> usize {
        tick.rem_euclid(self.window_m.len() as i64) as usize
    }
}

impl CommandSource for FilteredCommand {
    fn at(&mut self, tick: u64) -> LoopCommand {
        // No run has 2^62 ticks: delays are added without an overflow.
        let tick = tick.min(1 << 62) as i64;
        if tick == self.tick + 1 {
            self.advance();
        } else if tick != self.tick {
            self.move_to(tick);
        }
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// r0(k) = k^2, in metres.
    struct Square;

    impl Reference for Square {
        fn at_m(&self, tick: u64) -> f64 {
            (tick * tick) as f64
        }
    }

    fn square(tick: i64) -> f64 {
        if tick < 0 { 0.0 } else { (tick * tick) as f64 }
    }

    fn command() -> FilteredCommand {
        let filter = CommandFilter::new(
            Taps::dense(0, [0.25, 0.0, 0.0, 0.75]),
            Taps::dense(-2, [2.0, 0.0, 0.0, 0.0, 8.0]),
        );
        FilteredCommand::new(Box::new(Square), filter.expect("finite"))
    }

    /// Sums of small whole numbers and powers of two: exact.
    fn expected(tick: i64) -> LoopCommand {
        LoopCommand {
            reference_m: 0.25 * square(tick) + 0.75 * square(tick - 3),
            feedforward_a: 2.0 * square(tick + 2) + 8.0 * square(tick - 2),
        }
    }

    #[test]
    fn filters_read_past_and_future_of_the_reference() {
        let mut command = command();
        for tick in 0..50 {
            assert_eq!(command.at(tick), expected(tick as i64), "tick {tick}");
        }
    }

    #[test]
    fn command_depends_on_the_tick_alone() {
        let mut command = command();
        for tick in [7, 7, 3, 4, 100, 0, 1, 1] {
            assert_eq!(command.at(tick), expected(tick as i64), "tick {tick}");
        }
    }

    #[test]
    fn identity_gives_the_reference_bit_for_bit() {
        let identity = CommandFilter::new(Taps::identity(), Taps::default());
        let mut command = FilteredCommand::new(Box::new(Square), identity.expect("finite"));
        let at_9 = LoopCommand {
            reference_m: 81.0,
            feedforward_a: 0.0,
        };
        assert_eq!(command.at(9), at_9);
    }
}

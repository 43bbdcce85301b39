//! The traits of this module: a current over time, and a reference over time.

/// A current as a function of the tick alone, so that a run can be repeated and replayed.
///
/// ```
/// use bench_excitation::Excitation;
///
/// /// A pulse of 0.1 A over the first ten ticks of a hundred.
/// struct Pulse;
///
/// impl Excitation for Pulse {
///     fn current_a(&self, tick: u64) -> f64 {
///         if tick < 10 { 0.1 } else { 0.0 }
///     }
///     fn ticks(&self) -> u64 {
///         100
///     }
/// }
///
/// assert!(Pulse.active(99) && !Pulse.active(100));
/// // `bench_rt::program::Excite`(Pulse) is the program that runs it.
/// ```
pub trait Excitation: Send {
    /// The current in amperes; `tick` counts from 0. Called in the tick: must not allocate or block.
    fn current_a(&self, tick: u64) -> f64;

    /// Length in ticks, including the zero current before and after. Called in the tick: must not allocate or block.
    fn ticks(&self) -> u64;

    /// Whether the tick belongs to the excitation itself, not to the zero current before or after. Called in the
    /// tick: must not allocate or block.
    fn active(&self, tick: u64) -> bool {
        tick < self.ticks()
    }

    /// The frequency in hertz that is excited at a tick, if there is only one.
    fn frequency_at_hz(&self, _tick: u64) -> Option<f64> {
        None
    }

    /// How it repeats.
    fn pattern(&self) -> Pattern {
        Pattern::Once
    }
}

impl<E: Excitation + ?Sized> Excitation for Box<E> {
    fn current_a(&self, tick: u64) -> f64 {
        (**self).current_a(tick)
    }

    fn ticks(&self) -> u64 {
        (**self).ticks()
    }

    fn active(&self, tick: u64) -> bool {
        (**self).active(tick)
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        (**self).frequency_at_hz(tick)
    }

    fn pattern(&self) -> Pattern {
        (**self).pattern()
    }
}

/// How an excitation repeats; lengths are in ticks.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Once, from rest to rest.
    Once,
    /// Several times, each from rest to rest.
    Repeated {
        /// Ticks of one repetition.
        period: usize,
        /// Number of repetitions.
        count: usize,
    },
    /// Periodic, without rest between the periods.
    Periodic {
        /// Start of the first period.
        start: usize,
        /// Ticks of one period.
        period: usize,
        /// Periods in which the stage settles.
        skip: usize,
        /// Periods after the settling.
        periods: usize,
    },
    /// One sine after the other, each alone in its window.
    Stepped(Vec<Window>),
}

/// The ticks in which one sine is alone and steady.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its first tick.
    pub start: usize,
    /// Ticks of a block.
    pub period: usize,
    /// Periods of the sine in a block.
    pub turns: usize,
    /// Blocks.
    pub periods: usize,
}

/// A reference over time, from the tick at which the loop closes.
pub trait Reference: Send {
    /// The reference in metres, relative to the rest position; `tick` counts from 0. Called in the tick: must not
    /// allocate or block.
    fn at_m(&self, tick: u64) -> f64;
}

/// The tick nearest to a time.
pub(super) fn ticks(seconds: f64, period_s: f64) -> u64 {
    libm::round(seconds / period_s) as u64
}

//! What drives the stage: excitations in amperes for identification, references in metres for the closed loop.
//!
//! ```text
//!  [excitation] kind -> of() -> Excitation -> check(): run through the model, refused where an interlock would trip
//!                                   |
//!                                   +-> pattern(): how an analysis may take it apart
//! ```
//!
//! All are functions of the tick number alone, made before the run, so that a run can be repeated and replayed. A new
//! excitation is one file with the trait and one arm in [`of`].

mod check;
mod chirp;
mod envelope;
mod extremes;
mod fourier;
mod multisine;
mod periodic;
mod prbs;
mod quiet;
mod reference;
mod repeated;
mod shape;
mod staircase;
mod stepped_sine;

pub use check::{ExcitationError, LARGEST_SPAN, check, within};
pub use chirp::Chirp;
pub use envelope::Amplitude;
pub use extremes::Extremes;
pub use multisine::multisine;
pub use periodic::Periodic;
pub use prbs::prbs;
pub use quiet::Quiet;
pub use reference::{Reference, ReferenceError, reference, reference_text};
pub use repeated::Repeated;
pub use shape::{CurrentLimit, MOST_POINTS, shaped_amplitude};
pub use staircase::Staircase;
pub use stepped_sine::SteppedSine;

use crate::config::{Config, ExcitationKind, Lines, Spacing, Sweep};

/// A current over time.
pub trait Excitation: Send {
    /// Amperes at a tick of the excitation, counted from 0. *In the tick.*
    fn current_a(&self, tick: u64) -> f64;

    /// Whether the tick belongs to the excitation proper, not to the quiet before or after. *In the tick.*
    fn active(&self, tick: u64) -> bool;

    /// Length in ticks, quiet included.
    fn ticks(&self) -> u64;

    /// The one frequency in hertz that is excited at a tick, if it is one.
    fn frequency_at_hz(&self, _tick: u64) -> Option<f64> {
        None
    }

    /// How it repeats.
    fn pattern(&self) -> Pattern {
        Pattern::Once
    }
}

/// How an excitation repeats; all counts in ticks of it.
#[derive(Clone, Debug, PartialEq)]
pub enum Pattern {
    /// Not at all: from rest to rest.
    Once,
    /// From rest to rest, over and over.
    Repeated {
        /// Ticks of one.
        period: usize,
        /// How many.
        count: usize,
    },
    /// Without a pause.
    Periodic {
        /// Where the first period begins.
        start: usize,
        /// Ticks of one.
        period: usize,
        /// Periods in which the stage settles.
        skip: usize,
        /// Periods after these.
        periods: usize,
    },
    /// One sine after the other, each alone in its window.
    Stepped(Vec<Window>),
}

/// Where one sine stands alone and steady.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its first tick.
    pub start: usize,
    /// Ticks of a block.
    pub period: usize,
    /// Turns of the sine in a block.
    pub turns: usize,
    /// Blocks.
    pub periods: usize,
}

impl<E: Excitation + ?Sized> Excitation for Box<E> {
    fn current_a(&self, tick: u64) -> f64 {
        (**self).current_a(tick)
    }

    fn active(&self, tick: u64) -> bool {
        (**self).active(tick)
    }

    fn ticks(&self) -> u64 {
        (**self).ticks()
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        (**self).frequency_at_hz(tick)
    }

    fn pattern(&self) -> Pattern {
        (**self).pattern()
    }
}

/// The excitation of a configuration.
pub fn of(config: &Config) -> Box<dyn Excitation> {
    let chirp = || Chirp::new(&config.chirp, config.servo.period_s());
    match config.excitation.kind {
        ExcitationKind::Chirp if config.chirp.repetitions > 1 => {
            Box::new(Repeated::new(chirp(), &config.chirp))
        }
        ExcitationKind::Chirp => Box::new(chirp()),
        ExcitationKind::Multisine => Box::new(multisine(config)),
        ExcitationKind::SteppedSine => Box::new(SteppedSine::new(config)),
        ExcitationKind::Prbs => Box::new(prbs(config)),
    }
}

/// The swept reference of a configuration in words.
pub fn swept_words(config: &Config) -> String {
    let chirp = &config.chirp;
    let controller = &config.control.controller;
    format!(
        "under the {controller} controller, reference swept {} to {} Hz in {} s",
        chirp.start_hz, chirp.stop_hz, chirp.duration_s
    )
}

/// The excitation of a configuration in words.
pub fn words(config: &Config) -> String {
    let chirp = &config.chirp;
    let band = format!("{} to {} Hz", chirp.start_hz, chirp.stop_hz);
    match config.excitation.kind {
        ExcitationKind::Chirp => {
            let sweep = match chirp.sweep {
                Sweep::Linear => "linear",
                Sweep::Logarithmic => "logarithmic",
            };
            let times = if chirp.repetitions > 1 {
                format!(", {} times", chirp.repetitions)
            } else {
                String::new()
            };
            format!("{sweep} chirp, {band} in {} s{times}", chirp.duration_s)
        }
        ExcitationKind::Multisine => {
            let m = &config.multisine;
            let lines = match m.lines {
                Lines::Full => "all",
                Lines::Odd => "odd",
                Lines::OddRandom => "three in four odd",
            };
            format!(
                "multisine, {band}, {lines} lines of 1/{} s, {} periods",
                m.period_s, m.periods
            )
        }
        ExcitationKind::SteppedSine => {
            let s = &config.stepped_sine;
            let spacing = match s.spacing {
                Spacing::Linear => "linear",
                Spacing::Logarithmic => "logarithmic",
            };
            format!("stepped sine, {} frequencies, {band}, {spacing}", s.count)
        }
        ExcitationKind::Prbs => {
            let p = &config.prbs;
            let ticks = p.clock_divider;
            format!(
                "binary sequence of order {}, steps of {ticks} ticks, {} periods, {band} analysed",
                p.order, p.periods
            )
        }
    }
}

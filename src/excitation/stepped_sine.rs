//! One sine after the other.
//!
//! ```text
//!  u(n) = A(f_j) sin(2 pi f_j (n - n_j)/rate), n_j a whole number of turns before the measured blocks
//!
//!  sine j      ____/~~~~~~~~~|======measured======|~~~\____         over half of the next settling time
//!  sine j + 1                                      \~~~/~~~~~|======measured======|
//! ```
//!
//! Six blocks of m ticks are measured, each a whole number q of turns: f = q rate/m, next to the frequency asked for. As
//! one sine goes the next one comes, by the same cosine, so that nothing jumps.

use std::f64::consts::PI;

use super::envelope::{Amplitude, fade};
use super::{Excitation, Pattern, Window};
use crate::config::{BLOCKS_PER_SINE, Config};

/// Sines one after the other, with quiet before and after.
#[derive(Clone, Debug)]
pub struct SteppedSine {
    sines: Vec<Sine>,
    rate_hz: f64,
    fade_ticks: u64,
    settle_ticks: u64,
    start_tick: u64,
    quiet_after_ticks: u64,
}

#[derive(Clone, Copy, Debug)]
struct Sine {
    amplitude_a: f64,
    /// Turns a block, and ticks.
    turns: u64,
    block: u64,
    /// Where it begins to come.
    start: u64,
}

impl Sine {
    /// Amperes at a tick from its start on; the first measured block begins with a turn.
    fn current_a(&self, tick: u64, settle_ticks: u64) -> f64 {
        // Turns since the measured blocks began, modulo one, exactly: (n q mod m)/m.
        let before = settle_ticks % self.block;
        let n = (tick - self.start) % self.block + self.block - before;
        let share = (u128::from(n) * u128::from(self.turns) % u128::from(self.block)) as f64 / self.block as f64;
        self.amplitude_a * libm::sin(2.0 * PI * share)
    }

    /// Where its measured blocks end.
    fn end(&self, settle_ticks: u64) -> u64 {
        self.start + settle_ticks + BLOCKS_PER_SINE as u64 * self.block
    }
}

impl SteppedSine {
    /// The sines of a configuration.
    pub fn new(config: &Config) -> SteppedSine {
        let (chirp, settings, rate_hz) = (&config.chirp, &config.stepped_sine, config.servo.rate_hz);
        let ticks = |seconds: f64| libm::round(seconds * rate_hz) as u64;
        let (start_tick, settle_ticks) = (ticks(chirp.quiet_before_s), ticks(settings.settle_s).max(2));
        let amplitude = Amplitude::new(&chirp.amplitude);
        let mut sines: Vec<Sine> = Vec::new();
        for frequency_hz in settings.frequencies_hz(chirp.start_hz, chirp.stop_hz) {
            let (turns, block) = block(frequency_hz, settings.measure_s / BLOCKS_PER_SINE, rate_hz);
            let amplitude_a = amplitude.at(libm::log(frequency_hz));
            let start = sines.last().map_or(start_tick, |before| before.end(settle_ticks));
            sines.push(Sine { amplitude_a, turns, block, start });
        }
        let quiet_after_ticks = ticks(chirp.quiet_after_s);
        SteppedSine { sines, rate_hz, fade_ticks: settle_ticks / 2, settle_ticks, start_tick, quiet_after_ticks }
    }

    /// Where the last sine is gone.
    fn end(&self) -> u64 {
        self.sines.last().map_or(self.start_tick, |last| last.end(self.settle_ticks) + self.fade_ticks)
    }

    /// The sine that runs or comes at a tick, with the one before it.
    fn at(&self, tick: u64) -> (Option<&Sine>, Option<&Sine>) {
        let after = self.sines.partition_point(|sine| sine.start <= tick);
        let sine = |back: usize| after.checked_sub(back).and_then(|i| self.sines.get(i));
        match sine(1) {
            Some(last) if tick >= last.end(self.settle_ticks) => (None, Some(last)),
            now => (now, sine(2)),
        }
    }
}

/// Whole turns q and ticks m of a block of `least_s` at least, whose frequency q rate/m is next to the one asked for.
fn block(frequency_hz: f64, least_s: f64, rate_hz: f64) -> (u64, u64) {
    let turns = libm::ceil(frequency_hz * least_s - 1e-9).max(1.0);
    let block = libm::round(turns * rate_hz / frequency_hz).max(1.0);
    (turns as u64, (block as u64).max(8))
}

impl Excitation for SteppedSine {
    fn current_a(&self, tick: u64) -> f64 {
        let (now, before) = self.at(tick);
        let begun = now.map_or_else(|| before.map_or(0, |b| b.end(self.settle_ticks)), |sine| sine.start);
        let come = fade(tick.saturating_sub(begun) as f64, self.fade_ticks as f64);
        let of = |sine: Option<&Sine>, share: f64| {
            sine.filter(|_| share > 0.0).map_or(0.0, |sine| share * sine.current_a(tick, self.settle_ticks))
        };
        of(now, come) + of(before, 1.0 - come)
    }

    fn active(&self, tick: u64) -> bool {
        (self.start_tick..self.end()).contains(&tick)
    }

    fn ticks(&self) -> u64 {
        self.end() + self.quiet_after_ticks
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        let (now, before) = self.at(tick);
        now.or(before).map(|sine| sine.turns as f64 / sine.block as f64).map(|turns| turns * self.rate_hz)
    }

    fn pattern(&self) -> Pattern {
        let window = |sine: &Sine| Window {
            start: (sine.start + self.settle_ticks) as usize,
            period: sine.block as usize,
            turns: sine.turns as usize,
            periods: BLOCKS_PER_SINE as usize,
        };
        Pattern::Stepped(self.sines.iter().map(window).collect())
    }
}

//! One sine after the other.
//!
//! ```text
//!  u(n) = A(f_j) sin(2 pi f_j (n - n_j)/rate), n_j a whole number of turns before the measured blocks
//!
//!  sine j      ____/~~~~~~~~~|======measured======|~~~\____         over half of the next settling time
//!  sine j + 1                                      \~~~/~~~~~|======measured======|
//! ```
//!
//! Six blocks of m ticks are measured, each a whole number q of periods: f = q rate/m, close to the requested frequency. One
//! sine fades out while the next one fades in, by the same cosine, so that the sum has no step.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::amplitude::{AmplitudeCurve, fade};
use super::design::{ExcitationDesign, Length, SharedSettings};
use super::waveform::{Excitation, Pattern, Window};

/// Sines one after the other, each settled and then measured over whole periods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteppedSineSettings {
    /// How many frequencies, from `chirp.start_hz` to `chirp.stop_hz`.
    #[schemars(range(min = 2, max = 10000))]
    pub count: u32,
    /// How they are spaced.
    pub spacing: Spacing,
    /// Settling time of each sine in seconds, before it is measured. In the first half of it the previous sine fades
    /// out while this one fades in.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Smallest measuring time of each sine in seconds: six blocks of whole periods; the last block shows the drift.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub measure_s: f64,
}

/// Blocks in which a sine is measured: five that are averaged, and one that shows the drift.
const BLOCKS_PER_SINE: f64 = 6.0;

impl SteppedSineSettings {
    /// The requested frequencies in hertz; the excited ones are rounded to blocks of whole ticks.
    pub fn frequencies_hz(&self, start_hz: f64, stop_hz: f64) -> Vec<f64> {
        let last = f64::from(self.count.max(2) - 1);
        let shares = (0..self.count.max(2)).map(|k| f64::from(k) / last);
        shares
            .map(|share| self.spacing.between(start_hz, stop_hz, share))
            .collect()
    }
}

/// How frequencies are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Spacing {
    /// At equal differences.
    Linear,
    /// At equal ratios.
    Logarithmic,
}

impl Spacing {
    fn name(self) -> &'static str {
        match self {
            Spacing::Linear => "linear",
            Spacing::Logarithmic => "logarithmic",
        }
    }

    /// The frequency at a share, 0 to 1, of the way between two frequencies.
    fn between(self, start_hz: f64, stop_hz: f64, share: f64) -> f64 {
        match self {
            Spacing::Linear => start_hz + (stop_hz - start_hz) * share,
            Spacing::Logarithmic => start_hz * libm::pow(stop_hz / start_hz, share),
        }
    }
}

impl ExcitationDesign for SteppedSineSettings {
    fn describe(&self, shared: &SharedSettings<'_>) -> String {
        let (count, band, spacing) = (self.count, shared.band(), self.spacing.name());
        format!("stepped sine, {count} frequencies, {band}, {spacing}")
    }

    fn length(&self, shared: &SharedSettings<'_>) -> Length {
        let frequencies_hz = self.frequencies_hz(shared.chirp.start_hz, shared.chirp.stop_hz);
        let lengths_s = frequencies_hz
            .into_iter()
            .map(|f| self.settle_s + self.measure_s.max(BLOCKS_PER_SINE / f));
        let sines_s: f64 = lengths_s.sum();
        Length {
            ticks: (shared.quiet_s() + sines_s + self.settle_s) * shared.rate_hz,
            key: "stepped_sine.count",
            value: f64::from(self.count),
        }
    }

    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation> {
        Box::new(SteppedSine::new(self, shared))
    }

    fn is_shaped_by_default(&self) -> bool {
        true
    }
}

/// Smallest number of ticks in a block.
const MIN_BLOCK_TICKS: f64 = 16.0;

/// Sines one after the other, with zero current before and after.
#[derive(Clone, Debug)]
struct SteppedSine {
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
    /// Periods in a block.
    turns: u64,
    /// Ticks in a block.
    block: u64,
    /// Tick at which it begins to fade in.
    start: u64,
}

impl Sine {
    /// Amperes at a tick from its start on; the first measured block begins with a turn.
    fn current_a(&self, tick: u64, settle_ticks: u64) -> f64 {
        // Turns since the measured blocks began, modulo one, exactly: (n q mod m)/m.
        let before = settle_ticks % self.block;
        let n = (tick - self.start) % self.block + self.block - before;
        let share = (u128::from(n) * u128::from(self.turns) % u128::from(self.block)) as f64
            / self.block as f64;
        self.amplitude_a * libm::sin(TAU * share)
    }

    /// End of its measured blocks.
    fn end(&self, settle_ticks: u64) -> u64 {
        self.start + settle_ticks + BLOCKS_PER_SINE as u64 * self.block
    }
}

impl SteppedSine {
    /// The sines of the settings.
    fn new(settings: &SteppedSineSettings, shared: &SharedSettings<'_>) -> SteppedSine {
        let chirp = shared.chirp;
        let settle_ticks = shared.ticks(settings.settle_s).max(2);
        let mut stepped = SteppedSine {
            sines: Vec::new(),
            rate_hz: shared.rate_hz,
            fade_ticks: settle_ticks / 2,
            settle_ticks,
            start_tick: shared.ticks(chirp.quiet_before_s),
            quiet_after_ticks: shared.ticks(chirp.quiet_after_s),
        };
        let amplitude = AmplitudeCurve::of_current(&chirp.amplitude);
        let min_block_s = settings.measure_s / BLOCKS_PER_SINE;
        for frequency_hz in settings.frequencies_hz(chirp.start_hz, chirp.stop_hz) {
            let amplitude_a = amplitude.at(libm::log(frequency_hz));
            stepped.append(frequency_hz, amplitude_a, min_block_s);
        }
        stepped
    }

    /// Appends a sine, which begins at the end of the measured blocks of the one before.
    fn append(&mut self, frequency_hz: f64, amplitude_a: f64, min_block_s: f64) {
        let (turns, block) = block(frequency_hz, min_block_s, self.rate_hz);
        self.sines.push(Sine {
            amplitude_a,
            turns,
            block,
            start: self.measured_end(),
        });
    }

    /// End of the last measured block.
    fn measured_end(&self) -> u64 {
        let last = self.sines.last();
        last.map_or(self.start_tick, |last| last.end(self.settle_ticks))
    }

    /// End of the last fade.
    fn end(&self) -> u64 {
        if self.sines.is_empty() {
            self.start_tick
        } else {
            self.measured_end() + self.fade_ticks
        }
    }

    /// The current of a sine at a tick, times `share`; 0 without a sine.
    fn scaled_current_a(&self, sine: Option<&Sine>, tick: u64, share: f64) -> f64 {
        match sine {
            Some(sine) if share > 0.0 => share * sine.current_a(tick, self.settle_ticks),
            _ => 0.0,
        }
    }

    /// The sine that runs or fades in at a tick, with the one before it.
    fn at(&self, tick: u64) -> (Option<&Sine>, Option<&Sine>) {
        let begun = self.sines.partition_point(|sine| sine.start <= tick);
        let mut latest_first = self.sines[..begun].iter().rev();
        match latest_first.next() {
            Some(last) if tick >= last.end(self.settle_ticks) => (None, Some(last)),
            now => (now, latest_first.next()),
        }
    }
}

/// Whole turns q and ticks m of a block that lasts at least `least_s`; its frequency q rate/m is nearest to the requested one.
fn block(frequency_hz: f64, least_s: f64, rate_hz: f64) -> (u64, u64) {
    let turns = libm::ceil(frequency_hz * least_s.max(MIN_BLOCK_TICKS / rate_hz) - 1e-9).max(1.0);
    let block = libm::round(turns * rate_hz / frequency_hz).max(MIN_BLOCK_TICKS) as u64;
    // Close to half the rate, the nearest frequency would be half the rate itself, which has no phase.
    ((turns as u64).min((block - 1) / 2), block)
}

impl Excitation for SteppedSine {
    fn current_a(&self, tick: u64) -> f64 {
        let (now, before) = self.at(tick);
        let begun = now.map_or_else(
            || before.map_or(0, |b| b.end(self.settle_ticks)),
            |sine| sine.start,
        );
        let share = fade(tick.saturating_sub(begun) as f64, self.fade_ticks as f64);
        self.scaled_current_a(now, tick, share) + self.scaled_current_a(before, tick, 1.0 - share)
    }

    fn active(&self, tick: u64) -> bool {
        (self.start_tick..self.end()).contains(&tick)
    }

    fn ticks(&self) -> u64 {
        self.end() + self.quiet_after_ticks
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        let (now, before) = self.at(tick);
        now.or(before)
            .map(|sine| sine.turns as f64 / sine.block as f64)
            .map(|turns| turns * self.rate_hz)
    }

    fn pattern(&self) -> Pattern {
        let sines = self.sines.iter();
        let windows = sines.map(|sine| Window {
            start: (sine.start + self.settle_ticks) as usize,
            period: sine.block as usize,
            turns: sine.turns as usize,
            periods: BLOCKS_PER_SINE as usize,
        });
        Pattern::Stepped(windows.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AmplitudePoint;
    use crate::test_profile::{Profile, profile};

    fn config(spacing: Spacing, start_hz: f64, stop_hz: f64) -> Profile {
        let mut config = profile();
        (
            config.chirp.start_hz,
            config.chirp.stop_hz,
            config.chirp.quiet_before_s,
        ) = (start_hz, stop_hz, 0.1);
        config.chirp.amplitude = [(10.0, 0.2), (100.0, 0.02)]
            .map(|(frequency_hz, current_a)| AmplitudePoint {
                frequency_hz,
                current_a,
            })
            .to_vec();
        let settings = &mut config.excitations.stepped_sine;
        (
            settings.count,
            settings.spacing,
            settings.settle_s,
            settings.measure_s,
        ) = (9, spacing, 0.3, 0.2);
        config
    }

    fn built(config: &Profile) -> SteppedSine {
        let settings = &config.excitations.stepped_sine;
        SteppedSine::new(settings, &config.chosen_excitation().shared)
    }

    fn windows(sines: &SteppedSine) -> Vec<Window> {
        match sines.pattern() {
            Pattern::Stepped(windows) => windows,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn each_window_is_whole_periods_of_one_sine_of_its_amplitude() {
        for (spacing, start_hz, stop_hz) in [
            (Spacing::Linear, 7.3, 431.0),
            (Spacing::Logarithmic, 431.0, 7.3),
        ] {
            let config = config(spacing, start_hz, stop_hz);
            let sines = built(&config);
            for (window, requested_hz) in windows(&sines).iter().zip(
                config
                    .excitations
                    .stepped_sine
                    .frequencies_hz(start_hz, stop_hz),
            ) {
                let frequency_hz = window.turns as f64 * 5000.0 / window.period as f64;
                // The nearest whole number of ticks deviates by half a tick at most.
                assert!(
                    (frequency_hz / requested_hz - 1.0).abs() <= 0.51 / window.period as f64,
                    "{frequency_hz} {requested_hz}"
                );
                assert!(
                    window.periods == 6
                        && (window.period * window.periods) as f64 >= 0.2 * 5000.0 - 6.0
                );
                // 0.2 A (10 Hz/f) between 10 and 100 Hz.
                let amplitude_a = 0.2 * 10.0 / requested_hz.clamp(10.0, 100.0);
                for n in 0..window.period * window.periods {
                    let turns = (n * window.turns % window.period) as f64 / window.period as f64;
                    let expected_a = amplitude_a * (TAU * turns).sin();
                    let current_a = sines.current_a((window.start + n) as u64);
                    assert!(
                        (current_a - expected_a).abs() < 1e-12 * amplitude_a.max(0.1),
                        "{requested_hz} Hz, tick {n}"
                    );
                }
            }
        }
    }

    #[test]
    fn has_no_steps_and_starts_and_ends_at_zero() {
        let sines = built(&config(Spacing::Logarithmic, 20.0, 200.0));
        let signal: Vec<f64> = (0..sines.ticks())
            .map(|tick| sines.current_a(tick))
            .collect();
        // Both sines and both envelopes at their steepest: 2 (2 pi f A + pi A/(2 x 0.15 s))/rate, f A up to 2 + 2 Hz A.
        let largest = signal
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .fold(0.0, f64::max);
        assert!((0.001..0.012).contains(&largest), "{largest}");
        let active: Vec<u64> = (0..sines.ticks())
            .filter(|tick| sines.active(*tick))
            .collect();
        assert_eq!((active[0], signal[0], signal[500]), (500, 0.0, 0.0));
        let end = active.len() + 500;
        assert!(
            signal[end..].iter().all(|u| *u == 0.0) && signal.len() - end == 40_000,
            "8 s of quiet"
        );
        assert_eq!(active, (500..end as u64).collect::<Vec<_>>());
    }

    #[test]
    fn settings_at_their_limits_do_not_panic() {
        let mut config = config(Spacing::Linear, 2499.0, 1e-4);
        (
            config.excitations.stepped_sine.settle_s,
            config.excitations.stepped_sine.measure_s,
        ) = (0.001, 0.001);
        let sines = built(&config);
        for tick in (0..sines.ticks()).step_by(9973).chain([0, u64::MAX]) {
            assert!(sines.current_a(tick).abs() <= 0.4, "{tick}");
        }
    }
}

//! A small step with two tones, from rest: the check of a stage before a loop closes.
//!
//! ```text
//!             ______________    step and tones grow together (cosine ramp), and stay while the response is measured
//!            /  + tones
//!  _________/
//!   quiet   ramp    measured
//! ```

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::waveform::{Excitation, ticks};

/// Times, step and tones of a stage check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageCheckSettings {
    /// Zero current at the beginning, in seconds.
    pub quiet_s: f64,
    /// Time of the ramp in seconds.
    pub ramp_s: f64,
    /// Time after the ramp in which the response is measured, in seconds.
    pub measure_s: f64,
    /// Height of the step in amperes.
    pub step_a: f64,
    /// The tones.
    pub tones: Vec<Tone>,
}

/// A sine of current.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tone {
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// Amplitude in amperes.
    pub amplitude_a: f64,
}

/// The current of a stage check.
#[derive(Clone, Debug, PartialEq)]
pub struct StageCheckSignal {
    step_a: f64,
    tones: Vec<Tone>,
    quiet_ticks: u64,
    ramp_ticks: u64,
    measure_ticks: u64,
    period_s: f64,
}

impl StageCheckSignal {
    /// The signal for a loop of this period.
    pub fn new(settings: &StageCheckSettings, period_s: f64) -> StageCheckSignal {
        StageCheckSignal {
            step_a: settings.step_a,
            tones: settings.tones.clone(),
            quiet_ticks: ticks(settings.quiet_s, period_s).max(1),
            ramp_ticks: ticks(settings.ramp_s, period_s).max(1),
            measure_ticks: ticks(settings.measure_s, period_s).max(1),
            period_s,
        }
    }

    /// Ticks with zero current, from 0.
    pub fn quiet_ticks(&self) -> u64 {
        self.quiet_ticks
    }

    /// The first tick in which step and tones have their full size.
    pub fn measured_from_tick(&self) -> u64 {
        self.quiet_ticks + self.ramp_ticks
    }

    /// Time in seconds of a tick since the end of the zero current.
    pub fn time_s(&self, tick: u64) -> f64 {
        (tick as f64 - self.quiet_ticks as f64) * self.period_s
    }
}

impl Excitation for StageCheckSignal {
    fn current_a(&self, tick: u64) -> f64 {
        if !self.active(tick) {
            return 0.0;
        }
        let time_s = self.time_s(tick);
        let tones = self.tones.iter();
        let tones: f64 = tones
            .map(|tone| tone.amplitude_a * libm::sin(TAU * tone.frequency_hz * time_s))
            .sum();
        let share = ((tick - self.quiet_ticks) as f64 / self.ramp_ticks as f64).min(1.0);
        (self.step_a + tones) * (0.5 - 0.5 * libm::cos(PI * share))
    }

    fn ticks(&self) -> u64 {
        self.measured_from_tick() + self.measure_ticks
    }

    fn active(&self, tick: u64) -> bool {
        (self.quiet_ticks..self.ticks()).contains(&tick)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn begins_at_zero_and_ends_with_step_and_tones_of_full_size() {
        let settings = StageCheckSettings {
            quiet_s: 0.1,
            ramp_s: 0.2,
            measure_s: 0.5,
            step_a: 0.3,
            tones: vec![Tone {
                frequency_hz: 10.0,
                amplitude_a: 0.1,
            }],
        };
        let signal = StageCheckSignal::new(&settings, 1e-3);
        assert_eq!((signal.ticks(), signal.measured_from_tick()), (800, 300));
        assert!((0..=100).all(|tick| signal.current_a(tick) == 0.0));
        // Half of the ramp: half of the step, and the tone at its zero after one period.
        assert!((signal.current_a(200) - 0.15).abs() < 1e-12);
        // A quarter of a period after 300 ms: 0.3 A + 0.1 A.
        assert!((signal.current_a(325) - 0.4).abs() < 1e-12);
        assert_eq!(signal.current_a(800), 0.0);
    }
}

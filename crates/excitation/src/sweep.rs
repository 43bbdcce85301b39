//! A sine of rising (or falling) frequency, by its integrated phase; its unit is that of its amplitude.
//!
//! ```text
//!  u(t) = A(f(t)) e(t) (sin phi(t) - m)        phi(t) = 2 pi integral of f from 0 to t
//!  linear       f = f0 + (f1 - f0) t/T         phi = 2 pi (f0 t + (f1 - f0) t^2/(2 T))
//!  logarithmic  f = f0 exp(k t), k = ln(f1/f0)/T      phi = 2 pi f0 (exp(k t) - 1)/k
//! ```
//!
//! (sin(2 pi f(t) t) would end at 2 f1 - f0.) e(t) is the cosine fade at both ends, A the amplitude over frequency,
//! and m the constant that makes the sum over all ticks zero, so that the net impulse on motor and stage is zero.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::amplitude::{AmplitudeCurve, AmplitudePoint, fade};
use super::waveform::ticks;

/// How the frequency of a sweep changes over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "snake_case")]
pub enum Sweep {
    /// f(t) = f0 + (f1 - f0) t/T.
    Linear,
    /// f(t) = f0 (f1/f0)^(t/T).
    Logarithmic,
}

/// The excitation of `bench chirp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChirpSettings {
    /// Linear or logarithmic.
    pub sweep: Sweep,
    /// First frequency in hertz.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub start_hz: f64,
    /// Last frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub stop_hz: f64,
    /// Length of the sweep in seconds.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub duration_s: f64,
    /// Zero current before the sweep, in seconds.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_before_s: f64,
    /// Zero current after the sweep, in seconds: long enough for the stage to come to rest.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_after_s: f64,
    /// Length of the cosine fade at the start, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_in_s: f64,
    /// Length of the cosine fade at the end, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_out_s: f64,
    /// Number of repetitions of the chirp, including the zero current before and after; the analysis uses their mean.
    #[serde(default = "once")]
    #[schemars(range(min = 1, max = 10000))]
    pub repetitions: u32,
    /// Amplitude over frequency: straight lines on logarithmic axes, constant outside; one point is a flat sweep.
    #[schemars(length(min = 1, max = 64))]
    pub amplitude: Vec<AmplitudePoint>,
}

impl ChirpSettings {
    /// Lowest and highest frequency in hertz, in either direction of the sweep.
    pub fn band_hz(&self) -> (f64, f64) {
        (
            self.start_hz.min(self.stop_hz),
            self.start_hz.max(self.stop_hz),
        )
    }
}

fn once() -> u32 {
    1
}

/// A sweep with zeros before and after, in the unit of its amplitude.
#[derive(Clone, Debug)]
pub struct SweptSine {
    settings: ChirpSettings,
    amplitude: AmplitudeCurve,
    period_s: f64,
    start_tick: u64,
    sweep_ticks: u64,
    ticks: u64,
    rate: f64,
    mean: f64,
}

impl SweptSine {
    /// The sweep of the settings with another amplitude, for a loop of this period.
    pub fn new(settings: &ChirpSettings, amplitude: AmplitudeCurve, period_s: f64) -> SweptSine {
        let start_tick = ticks(settings.quiet_before_s, period_s);
        let sweep_ticks = ticks(settings.duration_s, period_s);
        let mut sweep = SweptSine {
            amplitude,
            period_s,
            start_tick,
            sweep_ticks,
            ticks: start_tick + sweep_ticks + ticks(settings.quiet_after_s, period_s),
            rate: rate(settings),
            mean: 0.0,
            settings: settings.clone(),
        };
        sweep.mean = sweep.weighted_mean();
        sweep
    }

    /// The mean of the sine, weighted by its envelope.
    fn weighted_mean(&self) -> f64 {
        let samples = (0..self.sweep_ticks).map(|tick| self.parts(tick as f64 * self.period_s));
        let (sum, weight) = samples.fold((0.0, 0.0), |(sum, weight), (envelope, sine)| {
            (sum + envelope * sine, weight + envelope)
        });
        if weight > 0.0 { sum / weight } else { 0.0 }
    }

    /// The value at a tick, counted from the start of the zeros before the sweep. Runs in the tick: must not allocate
    /// or block.
    pub fn at(&self, tick: u64) -> f64 {
        if !self.active(tick) {
            return 0.0;
        }
        let (envelope, sine) = self.parts((tick - self.start_tick) as f64 * self.period_s);
        envelope * (sine - self.mean)
    }

    /// Whether the tick lies in the sweep, not in the zeros before or after. Runs in the tick: must not allocate or
    /// block.
    pub fn active(&self, tick: u64) -> bool {
        (self.start_tick..self.start_tick + self.sweep_ticks).contains(&tick)
    }

    /// Length in ticks, including the zeros before and after.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The instantaneous frequency in hertz at a time in seconds after the start of the sweep.
    pub fn frequency_hz(&self, time_s: f64) -> f64 {
        match self.settings.sweep {
            Sweep::Linear => self.settings.start_hz + self.rate * time_s,
            Sweep::Logarithmic => self.settings.start_hz * libm::exp(self.rate * time_s),
        }
    }

    /// The instantaneous frequency in hertz at a tick; before and after the sweep, the one of the nearer end.
    pub fn frequency_at_hz(&self, tick: u64) -> f64 {
        let time_s = tick.saturating_sub(self.start_tick) as f64 * self.period_s;
        self.frequency_hz(time_s.min(self.settings.duration_s))
    }

    /// Envelope A(f) e(t) and sin phi at a time after the start of the sweep.
    fn parts(&self, time_s: f64) -> (f64, f64) {
        let s = &self.settings;
        let (ln_frequency, phase) = self.ln_frequency_and_phase(time_s);
        let fade = fade(time_s, s.fade_in_s) * fade(s.duration_s - time_s, s.fade_out_s);
        let sine = libm::sin(TAU * (phase - libm::floor(phase)));
        (fade * self.amplitude.at(ln_frequency), sine)
    }

    /// ln f and the phase in turns.
    fn ln_frequency_and_phase(&self, time_s: f64) -> (f64, f64) {
        let (s, rate) = (&self.settings, self.rate);
        match s.sweep {
            Sweep::Linear => (
                libm::log(s.start_hz + rate * time_s),
                s.start_hz * time_s + 0.5 * rate * time_s * time_s,
            ),
            Sweep::Logarithmic => (
                libm::log(s.start_hz) + rate * time_s,
                s.start_hz * libm::expm1(rate * time_s) / rate,
            ),
        }
    }
}

/// Change of the frequency in Hz/s, or of its logarithm in 1/s.
fn rate(settings: &ChirpSettings) -> f64 {
    match settings.sweep {
        Sweep::Linear => (settings.stop_hz - settings.start_hz) / settings.duration_s,
        Sweep::Logarithmic => libm::log(settings.stop_hz / settings.start_hz) / settings.duration_s,
    }
}

//! A sine of rising (or falling) frequency, by its integrated phase.
//!
//! ```text
//!  u(t) = A(f(t)) e(t) (sin phi(t) - m)        phi(t) = 2 pi integral of f from 0 to t
//!  linear       f = f0 + (f1 - f0) t/T         phi = 2 pi (f0 t + (f1 - f0) t^2/(2 T))
//!  logarithmic  f = f0 exp(k t), k = ln(f1/f0)/T      phi = 2 pi f0 (exp(k t) - 1)/k
//! ```
//!
//! (sin(2 pi f(t) t) would end at 2 f1 - f0.) e(t) is the cosine fade at both ends, A the amplitude over frequency, and m the
//! constant that makes the sum over all ticks zero, so that neither motor nor stage is left with an impulse.

use std::f64::consts::PI;

use super::{Excitation, Extremes};
use crate::config::{AmplitudePoint, ChirpSettings, Config, Sweep};
use crate::plant::Sampled;

/// A chirp that the interlocks would trip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChirpError {
    /// Beyond the motor or the amplifier.
    #[error("the chirp's amplitude of {amplitude_a} A is beyond {limit_a:.3} A, {what}; lower chirp.amplitude")]
    Amplitude {
        /// The largest amplitude.
        amplitude_a: f64,
        /// The limit.
        limit_a: f64,
        /// Whose limit it is.
        what: &'static str,
    },
    /// Faster than the amplifier can follow.
    #[error(
        "the chirp changes by up to {slew_a_per_s:.0} A/s, the amplifier follows {limit_a_per_s:.0} A/s; lower amplitude or stop frequency"
    )]
    Slew {
        /// 2 pi f A at its largest.
        slew_a_per_s: f64,
        /// The amplifier's limit.
        limit_a_per_s: f64,
    },
    /// Too hot.
    #[error(
        "the chirp would heat the motor to a thermal current of {thermal_a:.3} A, {limit_a:.3} A are allowed; lower amplitude or duration"
    )]
    Heat {
        /// Largest thermal current.
        thermal_a: f64,
        /// Continuous rating.
        limit_a: f64,
    },
    /// Too far.
    #[error(
        "by the model the stage would travel {travel_um:.0} um at {frequency_hz:.1} Hz, the soft limit is {limit_um:.0} um; lower the amplitude there"
    )]
    Travel {
        /// Largest travel by the model.
        travel_um: f64,
        /// The chirp's frequency when it happens.
        frequency_hz: f64,
        /// The soft limit.
        limit_um: f64,
    },
}

/// A chirp with quiet before and after.
#[derive(Clone, Debug)]
pub struct Chirp {
    settings: ChirpSettings,
    /// ln f and ln A of each point.
    amplitude: Vec<(f64, f64)>,
    period_s: f64,
    start_tick: u64,
    sweep_ticks: u64,
    ticks: u64,
    rate: f64,
    mean: f64,
}

impl Chirp {
    /// The chirp of the settings at a period of the loop.
    pub fn new(settings: &ChirpSettings, period_s: f64) -> Chirp {
        let ticks = |seconds: f64| libm::round(seconds / period_s) as u64;
        let (start_tick, sweep_ticks) = (ticks(settings.quiet_before_s), ticks(settings.duration_s));
        let ln = |p: &AmplitudePoint| (libm::log(p.frequency_hz), libm::log(p.current_a));
        let mut chirp = Chirp {
            amplitude: settings.amplitude.iter().map(ln).collect(),
            period_s,
            start_tick,
            sweep_ticks,
            ticks: start_tick + sweep_ticks + ticks(settings.quiet_after_s),
            rate: match settings.sweep {
                Sweep::Linear => (settings.stop_hz - settings.start_hz) / settings.duration_s,
                Sweep::Logarithmic => libm::log(settings.stop_hz / settings.start_hz) / settings.duration_s,
            },
            mean: 0.0,
            settings: settings.clone(),
        };
        let (sum, weight) = (0..sweep_ticks).fold((0.0, 0.0), |(sum, weight), tick| {
            let (envelope, sine) = chirp.parts(tick as f64 * period_s);
            (sum + envelope * sine, weight + envelope)
        });
        chirp.mean = if weight > 0.0 { sum / weight } else { 0.0 };
        chirp
    }

    /// The instantaneous frequency in hertz at a time in seconds after the sweep's start.
    pub fn frequency_hz(&self, time_s: f64) -> f64 {
        match self.settings.sweep {
            Sweep::Linear => self.settings.start_hz + self.rate * time_s,
            Sweep::Logarithmic => self.settings.start_hz * libm::exp(self.rate * time_s),
        }
    }

    /// Its lowest and its highest frequency in hertz.
    pub fn band_hz(&self) -> (f64, f64) {
        let (start_hz, stop_hz) = (self.settings.start_hz, self.settings.stop_hz);
        (start_hz.min(stop_hz), start_hz.max(stop_hz))
    }

    /// Refuses a chirp that would trip an interlock by the model of the plant; returns the travel to expect in metres.
    pub fn check(&self, config: &Config, plant: &Sampled) -> Result<f64, ChirpError> {
        let amplitude_a = self.settings.amplitude.iter().map(|p| p.current_a).fold(0.0, f64::max);
        let limits = [
            (config.motor.peak_current_a(), "the motor's peak current"),
            (config.amplifier.current_limit_a, "the amplifier's limit"),
        ];
        if let Some(&(limit_a, what)) = limits.iter().find(|(limit_a, _)| amplitude_a > *limit_a) {
            return Err(ChirpError::Amplitude { amplitude_a, limit_a, what });
        }
        self.check_course(config, plant)
    }

    /// Runs the whole chirp through the model: slew, heat and travel.
    fn check_course(&self, config: &Config, plant: &Sampled) -> Result<f64, ChirpError> {
        let extremes = Extremes::of(self, config, plant);
        let limit_a_per_s = config.amplifier.slew_limit_a_per_s;
        if extremes.slew_a_per_s > limit_a_per_s {
            return Err(ChirpError::Slew { slew_a_per_s: extremes.slew_a_per_s, limit_a_per_s });
        }
        let limit_a = config.motor.continuous_current_a();
        if extremes.thermal_a > limit_a {
            return Err(ChirpError::Heat { thermal_a: extremes.thermal_a, limit_a });
        }
        if extremes.travel_m > config.interlock.soft_limit_m {
            let time_s = extremes.travel_tick.saturating_sub(self.start_tick) as f64 * self.period_s;
            let frequency_hz = self.frequency_hz(time_s.min(self.settings.duration_s));
            let limit_um = config.interlock.soft_limit_m * 1e6;
            return Err(ChirpError::Travel { travel_um: extremes.travel_m * 1e6, frequency_hz, limit_um });
        }
        Ok(extremes.travel_m)
    }

    /// Envelope A(f) e(t) and sin phi at a time after the sweep's start.
    fn parts(&self, time_s: f64) -> (f64, f64) {
        let s = &self.settings;
        let (ln_frequency, phase) = match s.sweep {
            Sweep::Linear => {
                (libm::log(s.start_hz + self.rate * time_s), s.start_hz * time_s + 0.5 * self.rate * time_s * time_s)
            }
            Sweep::Logarithmic => {
                let ln = libm::log(s.start_hz) + self.rate * time_s;
                (ln, s.start_hz * libm::expm1(self.rate * time_s) / self.rate)
            }
        };
        let fade = fade(time_s, s.fade_in_s) * fade(s.duration_s - time_s, s.fade_out_s);
        (fade * self.amplitude_a(ln_frequency), libm::sin(2.0 * PI * (phase - libm::floor(phase))))
    }

    /// A(f): straight lines over ln f, constant beyond the ends.
    pub(crate) fn amplitude_a(&self, ln_frequency: f64) -> f64 {
        let after = self.amplitude.partition_point(|(ln_f, _)| *ln_f <= ln_frequency);
        let ln_a = match (after.checked_sub(1).and_then(|i| self.amplitude.get(i)), self.amplitude.get(after)) {
            (Some(&(f0, a0)), Some(&(f1, a1))) => a0 + (a1 - a0) * (ln_frequency - f0) / (f1 - f0),
            (Some(&(_, a)), None) | (None, Some(&(_, a))) => a,
            (None, None) => return 0.0,
        };
        libm::exp(ln_a)
    }
}

/// (1 - cos(pi t/T))/2 from 0 to 1 over T, 1 after.
fn fade(time_s: f64, length_s: f64) -> f64 {
    if time_s >= length_s { 1.0 } else { 0.5 - 0.5 * libm::cos(PI * time_s.max(0.0) / length_s) }
}

impl Excitation for Chirp {
    fn current_a(&self, tick: u64) -> f64 {
        if !self.active(tick) {
            return 0.0;
        }
        let (envelope, sine) = self.parts((tick - self.start_tick) as f64 * self.period_s);
        envelope * (sine - self.mean)
    }

    fn active(&self, tick: u64) -> bool {
        (self.start_tick..self.start_tick + self.sweep_ticks).contains(&tick)
    }

    fn ticks(&self) -> u64 {
        self.ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Source, load};

    const PERIOD_S: f64 = 2e-4;

    fn settings(sweep: Sweep, start_hz: f64, stop_hz: f64) -> ChirpSettings {
        let flat = vec![AmplitudePoint { frequency_hz: 1.0, current_a: 0.5 }];
        let quiet = 0.5;
        let (quiet_before_s, quiet_after_s) = (quiet, quiet);
        let mut settings = load(&Source::default()).unwrap().chirp;
        (settings.sweep, settings.start_hz, settings.stop_hz, settings.amplitude) = (sweep, start_hz, stop_hz, flat);
        (settings.quiet_before_s, settings.quiet_after_s, settings.duration_s) = (quiet_before_s, quiet_after_s, 10.0);
        (settings.fade_in_s, settings.fade_out_s) = (0.5, 0.5);
        settings
    }

    fn samples(chirp: &Chirp) -> Vec<f64> {
        (0..chirp.ticks()).map(|tick| chirp.current_a(tick)).collect()
    }

    /// Zero crossings between two times, counted on the signal itself: two a period.
    fn crossings_per_second(chirp: &Chirp, from_s: f64, to_s: f64) -> f64 {
        let signal = samples(chirp);
        let part = &signal[(from_s / PERIOD_S) as usize..(to_s / PERIOD_S) as usize];
        part.windows(2).filter(|w| (w[0] > 0.0) != (w[1] > 0.0)).count() as f64 / (to_s - from_s)
    }

    #[test]
    fn the_frequency_that_is_heard_ends_at_the_stop_frequency() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            for (start_hz, stop_hz) in [(5.0, 400.0), (300.0, 20.0)] {
                let chirp = Chirp::new(&settings(sweep, start_hz, stop_hz), PERIOD_S);
                for time_s in [2.0, 5.0, 8.0] {
                    let heard_hz = crossings_per_second(&chirp, 0.5 + time_s - 0.5, 0.5 + time_s + 0.5) / 2.0;
                    // Mean frequency over the second: from the phase's closed form; one crossing in the second may be missed.
                    let steps = 1000;
                    let mean_hz = (0..steps)
                        .map(|i| chirp.frequency_hz(time_s - 0.5 + (f64::from(i) + 0.5) / f64::from(steps)))
                        .sum::<f64>()
                        / f64::from(steps);
                    assert!(
                        (heard_hz - mean_hz).abs() <= 1.01,
                        "{sweep:?} {start_hz}-{stop_hz} at {time_s}: {heard_hz} for {mean_hz}"
                    );
                }
                assert!((chirp.frequency_hz(10.0) / stop_hz - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn it_is_quiet_before_and_after_fades_and_has_no_mean() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            let chirp = Chirp::new(&settings(sweep, 1.0, 400.0), PERIOD_S);
            let signal = samples(&chirp);
            let quiet = (0.5 / PERIOD_S) as usize;
            assert!(signal[..quiet].iter().chain(&signal[signal.len() - quiet..]).all(|u| *u == 0.0));
            // 50,000 numbers below 0.5, each rounded at 1e-16.
            assert!(signal.iter().sum::<f64>().abs() < 1e-11);
            // At the ends the envelope is (pi n/(2 N))^2 of the amplitude n samples in, N = 2500 to a fade.
            let (first, last) = (signal[quiet + 1].abs(), signal[signal.len() - quiet - 1].abs());
            assert!(first < 1e-6 && last < 1e-6, "{first} {last}");
            assert!(signal.iter().all(|u| u.abs() <= 0.5 * 1.05));
        }
    }

    #[test]
    fn the_amplitude_follows_its_points() {
        let mut s = settings(Sweep::Logarithmic, 1.0, 400.0);
        s.amplitude = vec![
            AmplitudePoint { frequency_hz: 10.0, current_a: 1.0 },
            AmplitudePoint { frequency_hz: 100.0, current_a: 0.01 },
        ];
        let chirp = Chirp::new(&s, PERIOD_S);
        // Two decades down over one decade up: A = (10 Hz/f)^2.
        for (frequency_hz, amplitude_a) in
            [(5.0, 1.0), (10.0, 1.0), (20.0, 0.25), (50.0, 0.04), (100.0, 0.01), (200.0, 0.01)]
        {
            let ours = chirp.amplitude_a(libm::log(frequency_hz));
            assert!((ours / amplitude_a - 1.0).abs() < 1e-12, "{frequency_hz}: {ours}");
        }
    }

    #[test]
    fn what_the_interlocks_would_trip_is_refused_with_the_figures() {
        let config = load(&Source::default()).unwrap();
        let structure = crate::plant::build(&config.plant).unwrap();
        let modes = crate::plant::Modal::of(&structure).unwrap().modes;
        let plant = Sampled::new(&modes, config.amplifier.bandwidth_hz, config.motor.force_constant_n_per_a, PERIOD_S);
        let check = |change: &dyn Fn(&mut ChirpSettings)| {
            let mut s = config.chirp.clone();
            change(&mut s);
            Chirp::new(&s, PERIOD_S).check(&config, &plant)
        };
        let flat = |current_a| vec![AmplitudePoint { frequency_hz: 1.0, current_a }];
        let travel_m = check(&|_| {}).unwrap();
        assert!((300e-6..900e-6).contains(&travel_m), "the default moves and stays inside: {travel_m}");
        assert!(matches!(check(&|s| s.amplitude = flat(9.99)), Err(ChirpError::Amplitude { .. })));
        assert!(matches!(check(&|s| s.amplitude = flat(8.0)), Err(ChirpError::Slew { .. })));
        assert!(matches!(check(&|s| s.amplitude = flat(3.5)), Err(ChirpError::Heat { .. })));
        let Err(ChirpError::Travel { travel_um, frequency_hz, .. }) = check(&|s| s.amplitude = flat(0.3)) else {
            panic!()
        };
        // Mode R at 183.9 rad/s = 29.3 Hz rings up as the sweep passes it.
        assert!((27.0..33.0).contains(&frequency_hz) && travel_um > 900.0, "{travel_um} {frequency_hz}");
    }
}

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

use super::Excitation;
use super::envelope::{Amplitude, fade};
use crate::config::{ChirpSettings, Sweep};

/// A chirp with quiet before and after.
#[derive(Clone, Debug)]
pub struct Chirp {
    settings: ChirpSettings,
    amplitude: Amplitude,
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
        let (start_tick, sweep_ticks) =
            (ticks(settings.quiet_before_s), ticks(settings.duration_s));
        let mut chirp = Chirp {
            amplitude: Amplitude::new(&settings.amplitude),
            period_s,
            start_tick,
            sweep_ticks,
            ticks: start_tick + sweep_ticks + ticks(settings.quiet_after_s),
            rate: match settings.sweep {
                Sweep::Linear => (settings.stop_hz - settings.start_hz) / settings.duration_s,
                Sweep::Logarithmic => {
                    libm::log(settings.stop_hz / settings.start_hz) / settings.duration_s
                }
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

    /// Envelope A(f) e(t) and sin phi at a time after the sweep's start.
    fn parts(&self, time_s: f64) -> (f64, f64) {
        let s = &self.settings;
        let (ln_frequency, phase) = match s.sweep {
            Sweep::Linear => (
                libm::log(s.start_hz + self.rate * time_s),
                s.start_hz * time_s + 0.5 * self.rate * time_s * time_s,
            ),
            Sweep::Logarithmic => {
                let ln = libm::log(s.start_hz) + self.rate * time_s;
                (ln, s.start_hz * libm::expm1(self.rate * time_s) / self.rate)
            }
        };
        let fade = fade(time_s, s.fade_in_s) * fade(s.duration_s - time_s, s.fade_out_s);
        (
            fade * self.amplitude.at(ln_frequency),
            libm::sin(2.0 * PI * (phase - libm::floor(phase))),
        )
    }
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

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        let time_s = tick.saturating_sub(self.start_tick) as f64 * self.period_s;
        Some(self.frequency_hz(time_s.min(self.settings.duration_s)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{AmplitudePoint, Source, load};

    const PERIOD_S: f64 = 2e-4;

    fn settings(sweep: Sweep, start_hz: f64, stop_hz: f64) -> ChirpSettings {
        let flat = vec![AmplitudePoint {
            frequency_hz: 1.0,
            current_a: 0.5,
        }];
        let quiet = 0.5;
        let (quiet_before_s, quiet_after_s) = (quiet, quiet);
        let mut settings = load(&Source::default()).unwrap().chirp;
        (
            settings.sweep,
            settings.start_hz,
            settings.stop_hz,
            settings.amplitude,
        ) = (sweep, start_hz, stop_hz, flat);
        (
            settings.quiet_before_s,
            settings.quiet_after_s,
            settings.duration_s,
        ) = (quiet_before_s, quiet_after_s, 10.0);
        (settings.fade_in_s, settings.fade_out_s) = (0.5, 0.5);
        settings
    }

    fn samples(chirp: &Chirp) -> Vec<f64> {
        (0..chirp.ticks())
            .map(|tick| chirp.current_a(tick))
            .collect()
    }

    /// Zero crossings between two times, counted on the signal itself: two a period.
    fn crossings_per_second(chirp: &Chirp, from_s: f64, to_s: f64) -> f64 {
        let signal = samples(chirp);
        let part = &signal[(from_s / PERIOD_S) as usize..(to_s / PERIOD_S) as usize];
        part.windows(2)
            .filter(|w| (w[0] > 0.0) != (w[1] > 0.0))
            .count() as f64
            / (to_s - from_s)
    }

    #[test]
    fn the_frequency_that_is_heard_ends_at_the_stop_frequency() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            for (start_hz, stop_hz) in [(5.0, 400.0), (300.0, 20.0)] {
                let chirp = Chirp::new(&settings(sweep, start_hz, stop_hz), PERIOD_S);
                for time_s in [2.0, 5.0, 8.0] {
                    let heard_hz =
                        crossings_per_second(&chirp, 0.5 + time_s - 0.5, 0.5 + time_s + 0.5) / 2.0;
                    // Mean frequency over the second: from the phase's closed form; one crossing in the second may be missed.
                    let steps = 1000;
                    let mean_hz = (0..steps)
                        .map(|i| {
                            chirp.frequency_hz(
                                time_s - 0.5 + (f64::from(i) + 0.5) / f64::from(steps),
                            )
                        })
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
            assert!(
                signal[..quiet]
                    .iter()
                    .chain(&signal[signal.len() - quiet..])
                    .all(|u| *u == 0.0)
            );
            // 50,000 numbers below 0.5, each rounded at 1e-16.
            assert!(signal.iter().sum::<f64>().abs() < 1e-11);
            // At the ends the envelope is (pi n/(2 N))^2 of the amplitude n samples in, N = 2500 to a fade.
            let (first, last) = (
                signal[quiet + 1].abs(),
                signal[signal.len() - quiet - 1].abs(),
            );
            assert!(first < 1e-6 && last < 1e-6, "{first} {last}");
            assert!(signal.iter().all(|u| u.abs() <= 0.5 * 1.05));
        }
    }

    #[test]
    fn the_amplitude_follows_its_points() {
        let mut s = settings(Sweep::Logarithmic, 1.0, 400.0);
        s.amplitude = vec![
            AmplitudePoint {
                frequency_hz: 10.0,
                current_a: 1.0,
            },
            AmplitudePoint {
                frequency_hz: 100.0,
                current_a: 0.01,
            },
        ];
        let chirp = Chirp::new(&s, PERIOD_S);
        // Two decades down over one decade up: A = (10 Hz/f)^2.
        for (frequency_hz, amplitude_a) in [
            (5.0, 1.0),
            (10.0, 1.0),
            (20.0, 0.25),
            (50.0, 0.04),
            (100.0, 0.01),
            (200.0, 0.01),
        ] {
            let ours = chirp.amplitude.at(libm::log(frequency_hz));
            assert!(
                (ours / amplitude_a - 1.0).abs() < 1e-12,
                "{frequency_hz}: {ours}"
            );
        }
    }
}

//! The chirp: a swept sine as current, once or several times.

use super::amplitude::AmplitudeCurve;
use super::design::{ExcitationDesign, Length, SharedSettings};
use super::repeated::Repeated;
use super::sweep::{ChirpSettings, Sweep, SweptSine};
use super::waveform::{Excitation, Pattern};

/// A chirp with zero current before and after, in amperes.
#[derive(Clone, Debug)]
pub struct Chirp(SweptSine);

impl Chirp {
    /// The chirp of the settings for a loop of this period.
    pub fn new(settings: &ChirpSettings, period_s: f64) -> Chirp {
        let amplitude = AmplitudeCurve::of_current(&settings.amplitude);
        Chirp(SweptSine::new(settings, amplitude, period_s))
    }

    /// The instantaneous frequency in hertz at a time in seconds after the start of the sweep.
    pub fn frequency_hz(&self, time_s: f64) -> f64 {
        self.0.frequency_hz(time_s)
    }
}

impl Excitation for Chirp {
    fn current_a(&self, tick: u64) -> f64 {
        self.0.at(tick)
    }

    fn ticks(&self) -> u64 {
        self.0.ticks()
    }

    fn active(&self, tick: u64) -> bool {
        self.0.active(tick)
    }

    fn frequency_at_hz(&self, tick: u64) -> Option<f64> {
        Some(self.0.frequency_at_hz(tick))
    }
}

/// The chirp as a kind of excitation: all its settings are the shared ones.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChirpDesign;

impl ExcitationDesign for ChirpDesign {
    fn describe(&self, shared: &SharedSettings<'_>) -> String {
        let chirp = shared.chirp;
        let sweep = match chirp.sweep {
            Sweep::Linear => "linear",
            Sweep::Logarithmic => "logarithmic",
        };
        let times = match chirp.repetitions {
            0 | 1 => String::new(),
            several => format!(", {several} times"),
        };
        let (band, duration_s) = (shared.band(), chirp.duration_s);
        format!("{sweep} chirp, {band} in {duration_s} s{times}")
    }

    fn length(&self, shared: &SharedSettings<'_>) -> Length {
        let chirp = shared.chirp;
        let once_s = shared.quiet_s() + chirp.duration_s;
        Length {
            ticks: once_s * f64::from(chirp.repetitions) * shared.rate_hz,
            key: "chirp.duration_s",
            value: chirp.duration_s,
        }
    }

    /// A single chirp is not built for this, which takes as long as its sweep has ticks.
    fn pattern(&self, shared: &SharedSettings<'_>) -> Pattern {
        match shared.chirp.repetitions {
            0 | 1 => Pattern::Once,
            _ => self.build(shared).pattern(),
        }
    }

    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation> {
        let chirp = Chirp::new(shared.chirp, shared.period_s());
        match shared.chirp.repetitions {
            0 | 1 => Box::new(chirp),
            several => Box::new(Repeated::new(chirp, several)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AmplitudePoint;
    use crate::test_profile::profile;

    const PERIOD_S: f64 = 2e-4;

    fn settings(sweep: Sweep, start_hz: f64, stop_hz: f64) -> ChirpSettings {
        let flat = vec![AmplitudePoint {
            frequency_hz: 1.0,
            current_a: 0.5,
        }];
        let quiet = 0.5;
        let (quiet_before_s, quiet_after_s) = (quiet, quiet);
        let mut settings = profile().chirp;
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

    /// Zero crossings per second between two times, counted in the signal itself: two per period.
    fn crossings_per_second(chirp: &Chirp, from_s: f64, to_s: f64) -> f64 {
        let signal = samples(chirp);
        let part = &signal[(from_s / PERIOD_S) as usize..(to_s / PERIOD_S) as usize];
        part.windows(2)
            .filter(|w| (w[0] > 0.0) != (w[1] > 0.0))
            .count() as f64
            / (to_s - from_s)
    }

    #[test]
    fn frequency_ends_at_the_stop_frequency() {
        for sweep in [Sweep::Linear, Sweep::Logarithmic] {
            for (start_hz, stop_hz) in [(5.0, 400.0), (300.0, 20.0)] {
                let chirp = Chirp::new(&settings(sweep, start_hz, stop_hz), PERIOD_S);
                for time_s in [2.0, 5.0, 8.0] {
                    let measured_hz =
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
                        (measured_hz - mean_hz).abs() <= 1.01,
                        "{sweep:?} {start_hz}-{stop_hz} at {time_s}: {measured_hz} for {mean_hz}"
                    );
                }
                assert!((chirp.frequency_hz(10.0) / stop_hz - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn is_zero_before_and_after_fades_and_has_zero_mean() {
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
            // 50,000 numbers below 0.5, each with a rounding error of 1e-16.
            assert!(signal.iter().sum::<f64>().abs() < 1e-11);
            // At the ends the envelope is (pi n/(2 N))^2 of the amplitude n samples from the end, with N = 2500
            // samples per fade.
            let (first, last) = (
                signal[quiet + 1].abs(),
                signal[signal.len() - quiet - 1].abs(),
            );
            assert!(first < 1e-6 && last < 1e-6, "{first} {last}");
            assert!(signal.iter().all(|u| u.abs() <= 0.5 * 1.05));
        }
    }

    #[test]
    fn amplitude_follows_its_points() {
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
        // Two decades down over one decade up: A = (10 Hz/f)^2.
        for (frequency_hz, amplitude_a) in [
            (5.0, 1.0),
            (10.0, 1.0),
            (20.0, 0.25),
            (50.0, 0.04),
            (100.0, 0.01),
            (200.0, 0.01),
        ] {
            let ours = AmplitudeCurve::of_current(&s.amplitude).at(libm::log(frequency_hz));
            assert!(
                (ours / amplitude_a - 1.0).abs() < 1e-12,
                "{frequency_hz}: {ours}"
            );
        }
    }
}

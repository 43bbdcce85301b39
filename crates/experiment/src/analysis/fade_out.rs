//! The signals of a sweep that ended early, faded out at their end.
//!
//! A transform treats the record as one period of a periodic signal, and a stage in motion at the end makes a step in it. With a fade w
//! that changes little while the stage responds, the response to w u is w y: where the sweep has passed, the response is that of the
//! stage, and the step is gone.

use std::f64::consts::PI;

use bench_identify::Signals;
use bench_identify::joint::LoopSignals;

/// The last part of a record, as a ratio of it, over which it is faded out.
const FADED_PART: f64 = 0.05;

/// The fade of a record: a raised cosine.
#[derive(Clone, Copy, Debug)]
pub(super) struct FadeOut {
    /// The first tick that is less than whole.
    pub(super) first_tick: usize,
    ticks: usize,
}

impl FadeOut {
    /// The fade of a record of this number of ticks.
    pub(super) fn of(ticks: usize) -> FadeOut {
        let first_tick = ticks - (FADED_PART * ticks as f64) as usize;
        FadeOut { first_tick, ticks }
    }

    /// The signals with `excitation`, one of them, and the others faded out to where they were before it began.
    pub(super) fn applied(&self, signals: &LoopSignals, excitation: &[f64]) -> LoopSignals {
        let first = excitation.first();
        let rest = excitation
            .iter()
            .take_while(|x| Some(*x) == first)
            .count()
            .max(1);
        LoopSignals {
            signals: Signals {
                rate_hz: signals.signals.rate_hz,
                input: self.faded(&signals.signals.input, rest),
                output: self.faded(&signals.signals.output, rest),
            },
            reference_m: self.faded(&signals.reference_m, rest),
        }
    }

    /// Samples that end at the mean of the first ones.
    fn faded(&self, samples: &[f64], rest: usize) -> Vec<f64> {
        let at_rest = samples.iter().take(rest);
        let mean = at_rest.clone().sum::<f64>() / at_rest.len().max(1) as f64;
        let samples = samples.iter().enumerate();
        samples
            .map(|(tick, x)| mean + (x - mean) * self.weight(tick))
            .collect()
    }

    /// From 1 to 0.
    fn weight(&self, tick: usize) -> f64 {
        let since = (tick + 1).saturating_sub(self.first_tick) as f64;
        let length = (self.ticks - self.first_tick).max(1) as f64;
        0.5 + 0.5 * libm::cos(PI * (since / length).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_end_where_they_were_before_the_excitation() {
        let ticks = 1000;
        let excitation: Vec<f64> = (0..ticks)
            .map(|k| if k < 100 { 0.0 } else { 1.0 })
            .collect();
        let signals = LoopSignals {
            signals: Signals {
                rate_hz: 1000.0,
                input: excitation.clone(),
                output: excitation.iter().map(|u| 5.0 + 2.0 * u).collect(),
            },
            reference_m: vec![3.0; ticks],
        };
        let fade = FadeOut::of(ticks);
        assert_eq!(fade.first_tick, 950);
        let faded = fade.applied(&signals, &excitation);
        let output = &faded.signals.output;
        assert_eq!(output[..950], signals.signals.output[..950]);
        // Half of the fade: 25 of 50 ticks.
        assert!(
            (output[974] - 6.0).abs() < 1e-12 && (faded.signals.input[974] - 0.5).abs() < 1e-12
        );
        assert_eq!((output[999], faded.signals.input[999]), (5.0, 0.0));
        assert_eq!(faded.reference_m, signals.reference_m);
    }
}

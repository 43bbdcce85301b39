//! The signals of an external record, with the reference of the loop in which they were taken.

use std::borrow::Cow;

use crate::periodic::Repetition;
use crate::record_check::{self, Checked, Corrected, Defect, Ends, Resolution, StrayLine};
use crate::remedies::{OF_LOOP, OF_SIGNALS, Remedies};
use crate::steady_input::is_steady;
use crate::sweep_harmonics::{SweepHarmonic, harmonics};
use crate::{
    EstimatorSettings, Frf, IdentifyError, IdentifySettings, Signals, excited_band_hz, joint,
};

/// An input whose RMS value at the first or the last samples exceeds this ratio of that of the record began before, or did not end.
pub(super) const ACTIVE_RATIO: f64 = 0.3;
/// At rest an input differs from its first value by less than this ratio of its largest difference.
const REST_RATIO: f64 = 0.01;

/// Input and output, and what excites them.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExternalSignals<'a> {
    pub(super) signals: &'a Signals,
    /// The reference of a closed loop, which is independent of the noise; in open loop the input is.
    pub(super) reference: Option<&'a [f64]>,
    /// How the record begins and ends.
    pub(super) ends: Ends,
}

impl<'a> ExternalSignals<'a> {
    pub(super) fn new(
        signals: &'a Signals,
        reference: Option<&'a [f64]>,
        repetition: Option<Repetition>,
    ) -> Self {
        let ends = match (repetition, reference) {
            (Some(_), _) => Ends::Periods,
            (None, None) if goes_on(signals) => Ends::Motion,
            (None, _) => Ends::Rest,
        };
        ExternalSignals {
            signals,
            reference,
            ends,
        }
    }

    /// The record with other signals of the same times, which may end before.
    pub(super) fn with_signals<'b>(&self, signals: &'b Signals) -> ExternalSignals<'b>
    where
        'a: 'b,
    {
        ExternalSignals {
            signals,
            reference: self.reference.map(|reference| &reference[..signals.len()]),
            ends: self.ends,
        }
    }

    pub(super) fn check(&self) -> Result<(), IdentifyError> {
        self.signals.check()?;
        match self.reference {
            Some(reference) => self.signals.check_reference(reference),
            None => Ok(()),
        }
    }

    /// The output with the signal that excites it as its input: in closed loop the reference, from its first value.
    pub(super) fn excited(&self) -> Cow<'a, Signals> {
        let Some(reference) = self.reference else {
            return Cow::Borrowed(self.signals);
        };
        let first = reference.first().copied().unwrap_or_default();
        Cow::Owned(Signals {
            rate_hz: self.signals.rate_hz,
            input: reference.iter().map(|r| r - first).collect(),
            output: self.signals.output.clone(),
        })
    }

    /// The duration of the excitation in seconds: from the first to the last sample at which it differs from its first value by more than
    /// [`REST_RATIO`] of the largest difference.
    pub(super) fn excitation_s(&self) -> f64 {
        let excited = self.excited();
        let first = excited.input.first().copied().unwrap_or_default();
        let distance = |u: &f64| (u - first).abs();
        let largest = excited.input.iter().map(distance).fold(0.0, f64::max);
        let is_active = |u: &f64| distance(u) > REST_RATIO * largest;
        let begin = excited.input.iter().position(is_active);
        let end = excited.input.iter().rposition(is_active);
        let samples = begin.zip(end).map_or(0, |(begin, end)| end + 1 - begin);
        samples as f64 / excited.rate_hz
    }

    /// The band that is excited; `None` without any excitation.
    pub(super) fn excited_band_hz(&self) -> Option<(f64, f64)> {
        let Some(reference) = self.reference else {
            return excited_band_hz(self.signals);
        };
        let [input, _, output] = self.signals.without_steps(reference);
        excited_band_hz(&Signals {
            rate_hz: self.signals.rate_hz,
            input,
            output,
        })
    }

    /// What to do about implausible data.
    pub(super) fn remedies(&self) -> &'static Remedies {
        match self.reference {
            None => &OF_SIGNALS,
            Some(_) => &OF_LOOP,
        }
    }

    /// The response from input to output; in closed loop with the reference as the instrument.
    pub(super) fn response(&self, band_hz: (f64, f64)) -> Result<Frf, IdentifyError> {
        let settings = EstimatorSettings {
            transient: self.ends == Ends::Motion,
            ..EstimatorSettings::default()
        };
        match self.reference {
            None => crate::response(self.signals, band_hz, &IdentifySettings::Local(settings)),
            Some(reference) => joint::plant(self.signals, reference, band_hz, &settings),
        }
    }

    /// The resolution of input and output.
    pub(super) fn resolution(&self) -> Resolution {
        Resolution {
            input: Resolution::of(self.signals).input,
            ..Resolution::of(&self.excited())
        }
    }

    /// The harmonics of the excitation in the output.
    pub(super) fn harmonics(&self) -> Vec<SweepHarmonic> {
        harmonics(&self.excited())
    }

    /// The first defect of each kind, and the readings that are left; `cleaned` is the record without its stray lines.
    pub(super) fn checked(&self, cleaned: &ExternalSignals<'_>) -> Checked {
        record_check::check(&self.excited(), &cleaned.excited(), self.ends)
    }

    /// The signals without the spikes and steps of the output. In closed loop they are not corrected: they move the plant as well.
    pub(super) fn corrected(&self, defects: &[Defect]) -> Option<Corrected> {
        let are_outliers = |defect: &Defect| defect.is_outlier();
        if self.reference.is_some() || !defects.iter().any(are_outliers) {
            return None;
        }
        Corrected::of(self.signals)
    }

    /// The signals without sinusoids that do not come from the excitation, and those of the output. A loop feeds them back, so that the
    /// input has them too.
    pub(super) fn without_stray_lines(&self) -> (Cow<'a, Signals>, Vec<StrayLine>) {
        let Some(reference) = self.reference else {
            let lines = record_check::stray_lines(self.signals);
            return (record_check::without(self.signals, &lines), lines);
        };
        let lines = record_check::stray_lines(&self.excited());
        let cleaned = Signals {
            rate_hz: self.signals.rate_hz,
            input: without_lines(self.signals, reference),
            output: record_check::without(self.signals, &lines)
                .into_owned()
                .output,
        };
        (Cow::Owned(cleaned), lines)
    }
}

/// Whether the excitation goes on at one of the ends or both, and excites each frequency all the time.
fn goes_on(signals: &Signals) -> bool {
    let is_active = record_check::input_ratio_at_start(signals) > ACTIVE_RATIO
        || record_check::input_ratio_at_end(signals) > ACTIVE_RATIO;
    is_active && is_steady(signals)
}

/// The input without the sinusoids that the reference does not have.
fn without_lines(signals: &Signals, reference: &[f64]) -> Vec<f64> {
    let by_reference = Signals {
        rate_hz: signals.rate_hz,
        input: reference.to_vec(),
        output: signals.input.clone(),
    };
    let lines = record_check::stray_lines(&by_reference);
    record_check::without(&by_reference, &lines)
        .into_owned()
        .output
}

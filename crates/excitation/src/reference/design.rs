//! Properties of a reference that follow from its settings alone.

use std::path::Path;

use crate::sweep::ChirpSettings;
use crate::waveform::{Reference, ticks};
use bench_base::finding::Finding;
use bench_base::input_file::{self, MAX_TABLE_BYTES};
use bench_base::quantity::Dimension;

/// The properties of a run that a reference needs in addition to its own settings.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceContext<'a> {
    /// The sweep that one kind follows.
    pub chirp: &'a ChirpSettings,
    /// Length of a tick in seconds.
    pub period_s: f64,
    /// Text of the file that the settings name, if they name one.
    pub file: Option<&'a str>,
}

impl ReferenceContext<'_> {
    /// The tick nearest to a time in seconds.
    pub fn ticks(&self, seconds: f64) -> u64 {
        ticks(seconds, self.period_s)
    }
}

/// A step within a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOfReference {
    /// Height in metres.
    pub height_m: f64,
    /// Time in seconds after the loop closed.
    pub at_s: f64,
}

/// The settings of one kind of reference. This trait provides all properties in which the kinds differ.
pub trait ReferenceDesign {
    /// Kind and values as text.
    fn describe(&self) -> String;

    /// The reference.
    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError>;

    /// Values that the limits of the bench forbid.
    fn check(&self, _soft_limit_m: f64, _rate_hz: f64) -> Vec<Finding> {
        Vec::new()
    }

    /// Refuses a file with a value beyond the soft limit.
    fn check_file(
        &self,
        _context: &ReferenceContext<'_>,
        _soft_limit_m: f64,
    ) -> Result<(), ReferenceError> {
        Ok(())
    }

    /// The step, of a kind that is one.
    fn step(&self) -> Option<StepOfReference> {
        None
    }

    /// Frequency in hertz of a sine, whose gain and phase are measured.
    fn sine_hz(&self) -> Option<f64> {
        None
    }

    /// Time in seconds of its last change: the steady state is measured after it.
    fn last_change_s(&self) -> f64 {
        self.step().map_or(0.0, |step| step.at_s)
    }

    /// Whether a record with this reference can be identified: it excites a band of frequencies.
    fn can_identify(&self) -> bool {
        false
    }

    /// Ticks with the loop closed, of a kind that decides its own length.
    fn closed_ticks(&self, _context: &ReferenceContext<'_>) -> Option<u64> {
        None
    }

    /// The file that it reads, if it reads one.
    fn path(&self) -> Option<&str> {
        None
    }

    /// The text of this file, which is stored in the recording.
    fn text(&self) -> Result<Option<String>, ReferenceError> {
        let Some(path) = self.path() else {
            return Ok(None);
        };
        let text = input_file::read_text(Path::new(path), MAX_TABLE_BYTES);
        text.map(Some).map_err(|e| ReferenceError::Unreadable {
            path: path.into(),
            why: e.to_string(),
        })
    }
}

/// A length in micrometres, rounded to nanometres.
pub(super) fn um(metres: f64) -> String {
    format!("{} um", (metres * 1e9).round() / 1e3)
}

/// A finding about an amplitude beyond the soft limit.
pub(super) fn check_amplitude(amplitude_m: f64, soft_limit_m: f64) -> Vec<Finding> {
    if amplitude_m.abs() <= soft_limit_m {
        return Vec::new();
    }
    let what = format!(
        "is {amplitude_m} m, beyond the soft limit of {soft_limit_m} m (interlock.soft_limit_m); lower it"
    );
    vec![Finding::new("control.reference.amplitude_m", what)]
}

/// A finding about a frequency that is not below half the servo rate.
pub(super) fn check_frequency(frequency_hz: f64, rate_hz: f64) -> Option<Finding> {
    let nyquist_hz = rate_hz / 2.0;
    let what = format!(
        "is {frequency_hz} Hz, not below half the servo rate of {nyquist_hz} Hz; lower it, or raise loop.rate_hz"
    );
    (frequency_hz >= nyquist_hz).then(|| Finding::new("control.reference.frequency_hz", what))
}

/// A reference file that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The file cannot be read.
    #[error(
        "cannot read the reference {path}: {why}; check that it is a file and that you may read it"
    )]
    Unreadable {
        /// The file.
        path: String,
        /// The system's message.
        why: String,
    },
    /// A line is not two numbers, or time does not rise.
    #[error(
        "{path} line {line}: {why}; write the header `time_s,reference_m` and rows of two numbers as in 0.5,1e-6 with rising times"
    )]
    Line {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        why: String,
    },
    /// A value beyond the soft limit.
    #[error(
        "{path} line {line}: the reference is {}, beyond the soft limit of {limit_m} m (interlock.soft_limit_m); write the values in metres, or lower them",
        Dimension::Length.display(*.reference_m)
    )]
    Travel {
        /// The file.
        path: String,
        /// The line, from 1.
        line: usize,
        /// The value.
        reference_m: f64,
        /// The soft limit.
        limit_m: f64,
    },
}

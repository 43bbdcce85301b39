//! Errors of the estimators.

use core::fmt;

use thiserror::Error;

/// Why no frequency response can be estimated. Messages state value, place, limit and remedy.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum IdentifyError {
    /// Samples, their number or their rate are unusable.
    #[error(transparent)]
    Signals(#[from] SignalsError),
    /// The band is invalid, or no frequency of the record lies in it.
    #[error(transparent)]
    Band(#[from] BandError),
    /// Too few whole periods to average.
    #[error(
        "too few periods remain after omitting {skipped} of {periods} whole ones, at least {min} are needed \
         (the last is used for the drift only); record more periods, omit fewer, or check the length of the period"
    )]
    Periods {
        /// Periods at the beginning that are omitted.
        skipped: usize,
        /// Whole periods of the record.
        periods: usize,
        /// Smallest number of periods after the omitted ones, with the last.
        min: usize,
    },
    /// The input has no energy in the band.
    #[error(
        "the input has no energy between {low_hz} and {high_hz} Hz to distinguish \
         the response from noise; excite this band, or select the band that was excited"
    )]
    NotExcited {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
    },
    /// The reference of a loop determines too little of its signals in the band.
    #[error(
        "the reference explains too little of the input between {low_hz} and {high_hz} Hz to distinguish the response from noise; \
         excite this band, select the band that was excited, or check the column of the reference"
    )]
    WeakReference {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
    },
    /// A setting of an estimator is out of bounds.
    #[error("{name} is {value}; give a value from {min} to {max}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
}

/// Why signals allow no estimate.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SignalsError {
    /// Input and output differ in length.
    #[error(
        "the input has {input} samples, the output {output}; \
         give both one sample for each tick, with the same tick at the same index"
    )]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// The reference of a closed loop and its signals differ in length.
    #[error(
        "the reference has {reference} samples, input and output {signals}; \
         give all one sample for each tick, with the same tick at the same index"
    )]
    ReferenceLength {
        /// Samples of the reference.
        reference: usize,
        /// Samples of input and output.
        signals: usize,
    },
    /// Too few samples.
    #[error("{samples} samples are too few, at least {min} are needed; record for longer")]
    TooShort {
        /// Samples of the record.
        samples: usize,
        /// Smallest allowed number.
        min: usize,
    },
    /// The sampling rate is not finite, or not above zero.
    #[error("the sampling rate is {rate_hz} Hz; give a finite rate above 0 Hz")]
    Rate {
        /// Samples per second.
        rate_hz: f64,
    },
    /// A sample is not finite, or too large to be squared.
    #[error(
        "the {signal} is {value} at sample {index}: every sample must be finite and below {max:e} in magnitude; \
         cut the record before it, or repair the sample"
    )]
    Sample {
        /// The signal.
        signal: Signal,
        /// Index of the first such sample, from 0.
        index: usize,
        /// Its value.
        value: f64,
        /// Largest allowed magnitude.
        max: f64,
    },
    /// The input does not change.
    #[error(
        "the input is {value} at every one of {samples} samples: nothing was excited; \
         check that the amplifier was enabled and that the excitation is not zero"
    )]
    ConstantInput {
        /// Value of all samples.
        value: f64,
        /// Their number.
        samples: usize,
    },
    /// The reference of a loop does not change.
    #[error(
        "the reference is {value} at every one of {samples} samples, so it excites nothing; \
         select the column of the set-point or of the excitation that was added in the loop"
    )]
    ConstantReference {
        /// Value of all samples.
        value: f64,
        /// Their number.
        samples: usize,
    },
    /// The output does not change.
    #[error(
        "the output is {value} at every one of {samples} samples: the probe does not measure the stage; \
         check its range, its cable and its validity flag"
    )]
    ConstantOutput {
        /// Value of all samples.
        value: f64,
        /// Their number.
        samples: usize,
    },
}

/// One of the signals of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// The input.
    Input,
    /// The output.
    Output,
    /// The reference of the loop.
    Reference,
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Signal::Input => "input",
            Signal::Output => "output",
            Signal::Reference => "reference",
        })
    }
}

/// Why nothing can be estimated in a band.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BandError {
    /// Limits that are not finite, negative, or in the wrong order.
    #[error(
        "the band from {low_hz} to {high_hz} Hz is invalid; give finite limits with 0 <= lower < upper"
    )]
    Limits {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
    },
    /// The band reaches beyond half the sampling rate.
    #[error(
        "the band reaches {high_hz} Hz, beyond the Nyquist frequency of {nyquist_hz} Hz; \
         lower its upper limit, or record at a higher rate"
    )]
    BeyondNyquist {
        /// Upper limit of the band.
        high_hz: f64,
        /// Half the sampling rate.
        nyquist_hz: f64,
    },
    /// No frequency of the transform lies in the band.
    #[error(
        "no frequency bin lies between {low_hz} and {high_hz} Hz (first bin at {bin_hz} Hz, spacing {bin_hz} Hz); \
         widen the band, or use a longer record or segment"
    )]
    NoBin {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
        /// Spacing of the bins, and frequency of the first.
        bin_hz: f64,
    },
}

impl IdentifyError {
    /// The input has no energy in `band_hz`.
    pub(super) fn not_excited((low_hz, high_hz): (f64, f64)) -> Self {
        Self::NotExcited { low_hz, high_hz }
    }

    /// The reference does not determine the signals in `band_hz`.
    pub(super) fn weak_reference((low_hz, high_hz): (f64, f64)) -> Self {
        Self::WeakReference { low_hz, high_hz }
    }
}

/// Checks that a setting lies within its bounds, limits included; NaN does not.
pub(super) fn check_setting(
    name: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), IdentifyError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(IdentifyError::Setting {
            name,
            value,
            min,
            max,
        })
    }
}

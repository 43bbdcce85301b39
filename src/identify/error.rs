//! Why there is no FRF: value, place, limit and what to do about it.

use thiserror::Error;

/// What keeps a record from being identified.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IdentifyError {
    /// The two columns do not belong together.
    #[error(
        "{input} samples of the input but {output} of the output: both need one sample a tick, with the same tick at the same index"
    )]
    Lengths {
        /// Samples of the input.
        input: usize,
        /// Samples of the output.
        output: usize,
    },
    /// Too few samples to have neighbouring bins at all.
    #[error("{samples} samples are too few: at least {least} are needed, so record for longer")]
    TooShort {
        /// Samples there are.
        samples: usize,
        /// Samples needed.
        least: usize,
    },
    /// The sampling rate is no rate.
    #[error("a sampling rate of {rate_hz} Hz: it must be finite and greater than 0 Hz")]
    Rate {
        /// The rate given.
        rate_hz: f64,
    },
    /// A sample is not a number, or beyond any instrument.
    #[error(
        "{column} is {value} at sample {index}: every sample must be finite and below {limit:e} in magnitude; cut the record before it or repair the sample"
    )]
    Sample {
        /// `input_a` or `output_m`.
        column: &'static str,
        /// Index of the first such sample.
        index: usize,
        /// Its value.
        value: f64,
        /// The greatest magnitude taken.
        limit: f64,
    },
    /// The input never moves.
    #[error(
        "the input is {value} A at every one of {samples} samples: nothing was excited; check that the amplifier was enabled and the excitation not zero"
    )]
    InputStill {
        /// The constant value in amperes.
        value: f64,
        /// Samples looked at.
        samples: usize,
    },
    /// The output never moves.
    #[error(
        "the output is {value} m at every one of {samples} samples: the probe did not see the stage; check its range, its cable and its validity flag"
    )]
    OutputStill {
        /// The constant value in metres.
        value: f64,
        /// Samples looked at.
        samples: usize,
    },
    /// The band is no band.
    #[error("a band from {low_hz} to {high_hz} Hz: both must be finite with 0 <= lower < upper")]
    BandOrder {
        /// Lower limit.
        low_hz: f64,
        /// Upper limit.
        high_hz: f64,
    },
    /// The band asks for more than sampling can show.
    #[error(
        "the band reaches {high_hz} Hz, beyond the Nyquist frequency of {limit_hz} Hz: lower its upper limit or record at a higher rate"
    )]
    BandBeyondNyquist {
        /// Upper limit asked for.
        high_hz: f64,
        /// Half the sampling rate.
        limit_hz: f64,
    },
    /// Too few periods to average.
    #[error(
        "{periods} whole periods, of which {skip} are left out: {least} must remain, the last of which only shows the drift; record more periods, leave out fewer, or check the length of the period"
    )]
    Periods {
        /// Whole periods in the record.
        periods: usize,
        /// Periods that are left out.
        skip: usize,
        /// Periods that must remain.
        least: usize,
    },
    /// No bin of the FFT falls into the band.
    #[error(
        "no frequency of this record lies between {low_hz} and {high_hz} Hz, its bins are {bin_hz} Hz apart and begin at {bin_hz} Hz: widen the band or use a longer record or segment"
    )]
    BandEmpty {
        /// Lower limit.
        low_hz: f64,
        /// Upper limit.
        high_hz: f64,
        /// Distance of bins.
        bin_hz: f64,
    },
    /// The input has no energy anywhere in the band.
    #[error(
        "the input has no energy between {low_hz} and {high_hz} Hz that could tell a response from noise: excite this band or ask for the one that was excited"
    )]
    NotExcited {
        /// Lower limit.
        low_hz: f64,
        /// Upper limit.
        high_hz: f64,
    },
    /// A setting of an estimator is out of its bounds.
    #[error("{name} is {value}, it must be from {least} to {most}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Least value allowed.
        least: f64,
        /// Greatest value allowed.
        most: f64,
    },
}

/// An error unless a setting lies within its bounds, limits included; a NaN does not.
pub(super) fn check_setting(
    name: &'static str,
    value: f64,
    least: f64,
    most: f64,
) -> Result<(), IdentifyError> {
    if value >= least && value <= most {
        Ok(())
    } else {
        Err(IdentifyError::Setting {
            name,
            value,
            least,
            most,
        })
    }
}

//! How a frequency response is analysed, by the options of an order.

use super::identify::{ExternalOptions, Hold, checked_rate_hz};
use bench_experiment::{AnalysisError, ExperimentError};
use bench_identify::{ResponseError, ResponseIdentification};

impl ExternalOptions {
    /// How a frequency response is analysed.
    ///
    /// # Errors
    /// When an option is refused. The hold follows from the rate, so that they are given together.
    pub fn response_identification(&self) -> Result<ResponseIdentification, ExperimentError> {
        let mut identification = ResponseIdentification::new();
        if let Some(lag_s) = self.lag_s()? {
            identification = identification.lag_s(lag_s);
        }
        if let Some((low_hz, high_hz)) = self.band_hz()? {
            identification = identification.band_hz(low_hz, high_hz);
        }
        if let Some(kind) = self.input_kind {
            identification = identification.input_kind(kind);
        }
        if let Some(kind) = self.output_kind {
            identification = identification.output_kind(kind);
        }
        match (self.hold, &self.rate) {
            (Hold::None, None) => Ok(identification),
            (Hold::Zoh, Some(rate)) => Ok(identification.held_at_hz(checked_rate_hz(rate.si())?)),
            (Hold::Zoh, None) => refused(
                "--hold zoh with --frf needs the rate at which the command was held; give --rate HZ",
            ),
            (Hold::None, Some(_)) => refused(
                "--rate with --frf is the rate of a held command; give --hold zoh too, or leave out --rate",
            ),
        }
    }

    /// The error of an analysis: wrong usage, if an option is the cause.
    pub fn response_refused(&self, error: ResponseError) -> ExperimentError {
        let option = match &error {
            ResponseError::Limits { .. } | ResponseError::NoPoint { .. } => {
                self.band.as_ref().map(|band| format!("--band {band}: "))
            }
            ResponseError::BeyondHalfRate { .. } => Some("--rate: ".into()),
            ResponseError::Zeros(error) => return AnalysisError::from(error.clone()).into(),
            _ => None,
        };
        ExperimentError::Refused(format!("{}{error}", option.unwrap_or_default()))
    }
}

fn refused<T>(message: &str) -> Result<T, ExperimentError> {
    Err(ExperimentError::Refused(message.into()))
}

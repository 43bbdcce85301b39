//! Modes of an output that is rounded to steps above its noise, as by an encoder or a coarse converter.
//!
//! Rounding errors of such an output are no noise: they repeat with the motion, and where that is below a step nothing is seen of it. A
//! response that is estimated from them is distorted. Known is the step in which each true value lies. The modes with the greatest
//! probability of all readings are found in time:
//!
//! ```text
//! modes of the response --likeliest parameters of each order--> order of least -2 ln P + parameters ln N --checks--> modes
//!      ^--- with the response of the expected output before rounding, which shows more modes ---' do not pass
//! ```
//!
//! The output of the modes is that from rest to a held input ([`Simulation`](simulated::Simulation)).

mod cell;
mod checks;
mod coverage;
mod equations;
mod order;
mod refine;
mod search;
mod simulated;
#[cfg(test)]
mod tests;

use crate::modal::ModalFit;
pub(crate) use search::RoundedSearch;

/// The modes of greatest likelihood of a rounded output.
#[derive(Debug)]
pub(crate) struct RoundedFit {
    pub(crate) fit: ModalFit,
    /// The expected values of the output before rounding.
    pub(crate) output: Vec<f64>,
    pub(crate) noise: RoundedOutput,
}

/// The step and the noise of an output that is rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedOutput {
    /// The step, in the unit of the output.
    pub step: f64,
    /// Standard deviation of the noise before rounding, in the unit of the output.
    pub sigma: f64,
    /// Up to this frequency in hertz the readings show modes, within the requested band.
    pub seen_up_to_hz: f64,
}

impl RoundedOutput {
    /// Why no verdict follows, if a mode lies above a range in which the readings would not show one.
    pub(crate) fn gap(&self, fit: &ModalFit) -> Option<String> {
        let frequencies = fit
            .modes()
            .into_iter()
            .map(|mode| mode.frequency_hz().value);
        let above_hz = frequencies
            .filter(|hz| *hz > self.seen_up_to_hz)
            .reduce(f64::min)?;
        Some(format!(
            "from {:.1} Hz to the mode at {above_hz:.1} Hz the output moves by less than its steps of {:.4e}, so that another mode would not be seen; increase the amplitude there, or use a finer range of the probe",
            self.seen_up_to_hz, self.step
        ))
    }

    /// What follows from them, for a reader.
    pub fn description(&self) -> String {
        format!(
            "the output has steps of {:.4e}, more than its noise of {:.1e}: the modes are those of the greatest likelihood of its readings, which show modes up to {:.1} Hz; the plotted response, which the steps distort, does not show them exactly",
            self.step, self.sigma, self.seen_up_to_hz
        )
    }
}

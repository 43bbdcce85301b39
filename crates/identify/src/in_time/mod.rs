//! Modes of an output some of whose samples are no readings with noise: it is rounded to steps above its noise, as by an encoder or a coarse
//! converter; it is clipped; its probe was stuck, or is slower than the log.
//!
//! Rounding errors of such an output are no noise: they repeat with the motion, and where that is below a step nothing is seen of it. A
//! response that is estimated from them, or from samples that are no readings, is distorted. Known is the step in which each true value lies,
//! beyond which limit it lies, or nothing. The modes with the greatest probability of all readings are found in time:
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
mod noise;
mod order;
mod refine;
mod search;
mod simulated;
#[cfg(test)]
mod tests;

use crate::modal::ModalFit;
pub(crate) use search::TimeSearch;

/// The modes of greatest likelihood of the readings of an output.
#[derive(Debug)]
pub(crate) struct TimeFit {
    pub(crate) fit: ModalFit,
    /// The expected values of the output before rounding, also where readings are lost.
    pub(crate) output: Vec<f64>,
    pub(crate) noise: ReadingsFit,
}

/// Step and noise of an output whose modes are found in time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadingsFit {
    /// The step in the unit of the output, if it exceeds the noise.
    pub step: Option<f64>,
    /// Standard deviation of the noise before rounding, in the unit of the output.
    pub sigma: f64,
    /// Up to this frequency in hertz the readings show modes, within the requested band.
    pub seen_up_to_hz: f64,
}

impl ReadingsFit {
    /// Why no verdict follows, if a mode lies above a range in which the readings would not show one.
    pub(crate) fn gap(&self, fit: &ModalFit) -> Option<String> {
        let frequencies = fit
            .modes()
            .into_iter()
            .map(|mode| mode.frequency_hz().value);
        let above_hz = frequencies
            .filter(|hz| *hz > self.seen_up_to_hz)
            .reduce(f64::min)?;
        let from_hz = self.seen_up_to_hz;
        Some(match self.step {
            Some(step) => format!(
                "from {from_hz:.1} Hz to the mode at {above_hz:.1} Hz the output moves by less than its steps of {step:.4e}, so that another mode would not be seen; increase the amplitude there, or use a finer range of the probe"
            ),
            None => format!(
                "from {from_hz:.1} Hz to the mode at {above_hz:.1} Hz another mode would not be seen, because readings are missing there or the noise is too large; repeat the record, or increase the amplitude there"
            ),
        })
    }

    /// The noise before rounding, if the output is rounded.
    pub fn noise_before_rounding(&self) -> Option<f64> {
        self.step.map(|_| self.sigma)
    }

    /// What follows from them, for a reader.
    pub fn description(&self) -> String {
        let (sigma, seen_hz) = (self.sigma, self.seen_up_to_hz);
        match self.step {
            Some(step) => format!(
                "the output has steps of {step:.4e}, more than its noise of {sigma:.1e}: the modes are those of the greatest likelihood of its readings, which show modes up to {seen_hz:.1} Hz; the plotted response, which the steps distort, does not show them exactly"
            ),
            None => format!(
                "the modes are those of the greatest likelihood of the other readings, with a noise of {sigma:.1e}, which show modes up to {seen_hz:.1} Hz; in the plotted response the modes stand for the missing readings"
            ),
        }
    }
}

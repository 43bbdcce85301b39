//! Averages over the periods of an excitation: no leakage, no smoothing; the noise is what differs between the periods.
//!
//! ```text
//! H = mean Y / mean U                      at each line k rate/period that is excited
//! E|error of H|^2 = sum over periods of |Y_p - H U_p|^2 / ((P - 1) P |mean U|^2)
//! ```
//!
//! so that noise on the measured input counts as well as that on the output (Pintelon, Schoukens, System Identification, 2nd
//! ed., section 2.5). What the plant repeats in every period, distortion included, is not noise here: a model that does not
//! describe it has a reduced chi-square above 1. With these variances of P periods, chi-square is (P - 1)/(P - 2) times too high; for a
//! fit they are pooled over neighbouring lines by [`with_pooled_noise`].

use super::excited::excited;
use super::lines::{Line, ROUNDING, lines, mean};
use crate::{Frf, FrfDatum, FrfPoint, IdentifyError, Signals};

pub use super::lines::Repetition;
pub use super::pooled::with_pooled_noise;

/// The response by averages over periods.
#[derive(Clone, Debug, PartialEq)]
pub struct Periods {
    /// The response at the excited lines, with one datum per line, and variances by the scatter of the periods of the line; the resolution
    /// is the distance of the lines.
    pub frf: Frf,
    /// |mean U|^2 of each datum.
    pub input_powers: Vec<f64>,
    /// Number of averaged periods.
    pub count: usize,
}

/// The response at the excited lines of `band_hz`.
///
/// # Errors
/// When the signals, the band or the periods allow no estimate: see [`IdentifyError`].
pub fn estimate(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
) -> Result<Periods, IdentifyError> {
    let lines = lines(signals, band_hz, repetition)?;
    let line_hz = signals.rate_hz / repetition.period as f64;
    let count = lines.first().map_or(0, |line| line.input.len());
    let mut periods = Periods {
        frf: Frf::default(),
        input_powers: Vec::new(),
        count,
    };
    for line in excited(&lines) {
        periods.push(line, line_hz);
    }
    Ok(Periods {
        frf: periods.frf.with_data(band_hz)?,
        ..periods
    })
}

impl Periods {
    /// The response with its data for a fit: variances that are pooled over neighbouring lines.
    pub fn pooled(self) -> Frf {
        let data = with_pooled_noise(&self.frf.data, &self.input_powers, self.count);
        Frf { data, ..self.frf }
    }

    fn push(&mut self, line: &Line, line_hz: f64) {
        let (frequency_hz, response) = (line.number as f64 * line_hz, line.response());
        let variance = line
            .variance()
            .max(ROUNDING * ROUNDING * response.norm_sqr());
        let coherence = line.coherence();
        let point = FrfPoint {
            frequency_hz,
            response,
            coherence,
            variance,
            resolution_hz: line_hz,
        };
        if self.frf.push(point) && variance > 0.0 {
            self.frf.data.push(FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response,
                variance,
            });
            self.input_powers.push(mean(&line.input).norm_sqr());
        }
    }
}

//! What goes into a plot, and what is drawn of it.

use nalgebra::Complex;
use plotters::style::RGBColor;

use super::colours::{BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION};
use super::{ReportError, phase};
use crate::identify::{Frf, wrapped_phase_rad};

/// Half-width of the band, and what a magnitude must be to be drawn in full, in sigmas.
const BAND_SIGMAS: f64 = 2.0;
/// What a magnitude must be for its phase to lead those after it, in sigmas: known to 0.25 rad then.
const LEADING_SIGMAS: f64 = 4.0;
/// Measured frequencies further apart than this many resolutions leave a gap between them.
const GAP_RESOLUTIONS: f64 = 2.0;
/// Colours of measured curves, and of models.
const MEASURED: [RGBColor; 4] = [BLUE, GREEN, PURPLE, SKY];
const MODEL: [RGBColor; 3] = [VERMILION, INK, ORANGE];
/// Dashes of one model after the other, and the spaces between: of two that coincide both are seen.
const DASHES: [(f64, f64); 2] = [(6.0, 5.0), (2.5, 3.0)];

/// A curve with a name for the legend.
#[derive(Clone, Debug)]
pub struct Trace<'a> {
    /// What the legend calls it.
    pub name: &'a str,
    /// What it shows.
    pub curve: Curve<'a>,
}

/// What a trace shows; it is drawn accordingly.
#[derive(Clone, Debug)]
pub enum Curve<'a> {
    /// A measured response: line with its band of two sigma, and coherence.
    Measured(&'a Frf),
    /// The response of a model: a line on top.
    Model {
        /// Frequencies in hertz.
        frequency_hz: &'a [f64],
        /// Response in metres per ampere.
        response: &'a [Complex<f64>],
    },
}

/// A trace made ready: one entry a frequency in every column.
pub(super) struct Line<'a> {
    pub name: &'a str,
    pub colour: RGBColor,
    /// Lengths in pixels of its dashes and of the space after them, so that what lies below is seen.
    pub dashes: Option<(f64, f64)>,
    pub frequency_hz: &'a [f64],
    pub magnitude: Vec<f64>,
    /// Unwrapped.
    pub phase_deg: Vec<f64>,
    /// Whether the band leaves out zero.
    pub firm: Vec<bool>,
    /// Whether the phase is known well enough to tell turns.
    leading: Vec<bool>,
    /// Whether a gap lies before the frequency.
    pub begins: Vec<bool>,
    pub measured: Option<&'a Frf>,
}

/// A value, the ends of its band, and whether it is known too badly to be drawn in full.
pub(super) struct Shown {
    pub value: f64,
    pub low: f64,
    pub high: f64,
    pub faint: bool,
}

/// The lines of a plot, their phases on the same turn as far as they overlap.
pub(super) fn lines<'a>(traces: &[Trace<'a>]) -> Result<Vec<Line<'a>>, ReportError> {
    let (mut measured, mut models) = (MEASURED.iter().cycle(), MODEL.iter().cycle());
    let mut lines = Vec::new();
    for trace in traces {
        let colour = match trace.curve {
            Curve::Measured(_) => measured.next(),
            Curve::Model { .. } => models.next(),
        };
        lines.push(Line::new(trace, colour.copied().unwrap_or_default())?);
    }
    align_phases(&mut lines);
    let any_measured = lines.iter().any(|line| line.measured.is_some());
    let models = lines
        .iter_mut()
        .filter(|line| any_measured && line.measured.is_none());
    models
        .zip(DASHES.iter().cycle())
        .for_each(|(line, dashes)| line.dashes = Some(*dashes));
    if lines.is_empty() {
        Err(ReportError::NoTrace)
    } else {
        Ok(lines)
    }
}

impl<'a> Line<'a> {
    fn new(trace: &Trace<'a>, colour: RGBColor) -> Result<Self, ReportError> {
        check(trace)?;
        let (frequency_hz, response, measured) = match trace.curve {
            Curve::Measured(frf) => (&frf.frequency_hz[..], &frf.response[..], Some(frf)),
            Curve::Model {
                frequency_hz,
                response,
            } => (frequency_hz, response, None),
        };
        let magnitude: Vec<f64> = response.iter().map(|h| h.norm()).collect();
        let sigma = |k: usize| measured.map_or(0.0, |frf| frf.magnitude_sigma[k]);
        let beyond = |sigmas: f64| {
            magnitude
                .iter()
                .enumerate()
                .map(|(k, h)| *h > sigmas * sigma(k))
                .collect()
        };
        let (firm, leading): (Vec<bool>, Vec<bool>) = (beyond(BAND_SIGMAS), beyond(LEADING_SIGMAS));
        let wrapped: Vec<f64> = response
            .iter()
            .map(|h| wrapped_phase_rad(*h).to_degrees())
            .collect();
        let phase_deg = phase::unwrapped_deg(&wrapped, &leading);
        let begins = (0..response.len())
            .map(|k| k == 0 || measured.is_some_and(|frf| gap(frf, k)))
            .collect();
        let name = trace.name;
        Ok(Self {
            name,
            colour,
            dashes: None,
            frequency_hz,
            magnitude,
            phase_deg,
            firm,
            leading,
            begins,
            measured,
        })
    }

    /// Magnitude with its band.
    pub fn magnitude(&self, k: usize) -> Shown {
        self.shown(
            k,
            self.magnitude[k],
            self.measured.map_or(0.0, |frf| frf.magnitude_sigma[k]),
        )
    }

    /// Phase in degrees with its band.
    pub fn phase(&self, k: usize) -> Shown {
        self.shown(
            k,
            self.phase_deg[k],
            self.measured
                .map_or(0.0, |frf| frf.phase_sigma_rad[k].to_degrees()),
        )
    }

    fn shown(&self, k: usize, value: f64, sigma: f64) -> Shown {
        Shown {
            value,
            low: value - BAND_SIGMAS * sigma,
            high: value + BAND_SIGMAS * sigma,
            faint: !self.firm[k],
        }
    }

    /// The points (frequency, phase) that are known well.
    fn leading_phases(&self) -> Vec<(f64, f64)> {
        (0..self.leading.len())
            .filter(|k| self.leading[*k])
            .map(|k| (self.frequency_hz[k], self.phase_deg[k]))
            .collect()
    }
}

/// Whether a gap lies between a measured frequency and the one before it.
pub(super) fn gap(frf: &Frf, k: usize) -> bool {
    frf.frequency_hz[k] - frf.frequency_hz[k - 1]
        > GAP_RESOLUTIONS * frf.resolution_hz[k].max(frf.resolution_hz[k - 1])
}

/// Puts every line on the turn of the one that begins at the lowest frequency, which knows best where the phase starts.
fn align_phases(lines: &mut [Line]) {
    let first = |a: &&Line, b: &&Line| a.frequency_hz[0].total_cmp(&b.frequency_hz[0]);
    let Some(reference) = lines.iter().min_by(first).map(Line::leading_phases) else {
        return;
    };
    for line in lines {
        let offset = phase::offset_deg(&line.leading_phases(), &reference);
        line.phase_deg.iter_mut().for_each(|phase| *phase += offset);
    }
}

fn check(trace: &Trace) -> Result<(), ReportError> {
    let name = || trace.name.to_owned();
    match trace.curve {
        Curve::Model {
            frequency_hz,
            response,
        } => {
            check_lengths(trace.name, frequency_hz.len(), &[response.len()])?;
            check_frequencies(trace.name, frequency_hz)?;
            let bad = response
                .iter()
                .position(|h| !(h.re.is_finite() && h.im.is_finite()));
            bad.map_or(Ok(()), |k| {
                Err(ReportError::NotFinite {
                    name: name(),
                    frequency_hz: frequency_hz[k],
                })
            })
        }
        Curve::Measured(frf) => {
            let columns = [
                &frf.coherence,
                &frf.magnitude_sigma,
                &frf.phase_sigma_rad,
                &frf.resolution_hz,
            ];
            let lengths = columns.map(Vec::len);
            check_lengths(
                trace.name,
                frf.len(),
                &[&lengths[..], &[frf.response.len()]].concat(),
            )?;
            check_frequencies(trace.name, &frf.frequency_hz)?;
            let finite = |k: &usize| {
                frf.response[*k].norm().is_finite() && columns.iter().all(|c| c[*k].is_finite())
            };
            let bad = (0..frf.len()).find(|k| !finite(k));
            bad.map_or(Ok(()), |k| {
                Err(ReportError::NotFinite {
                    name: name(),
                    frequency_hz: frf.frequency_hz[k],
                })
            })
        }
    }
}

fn check_lengths(name: &str, frequencies: usize, columns: &[usize]) -> Result<(), ReportError> {
    let name = name.to_owned();
    match columns.iter().find(|values| **values != frequencies) {
        Some(values) => Err(ReportError::Lengths {
            name,
            frequencies,
            values: *values,
        }),
        None if frequencies == 0 => Err(ReportError::Empty { name }),
        None => Ok(()),
    }
}

fn check_frequencies(name: &str, frequency_hz: &[f64]) -> Result<(), ReportError> {
    let mut last = 0.0;
    for (index, value) in frequency_hz.iter().copied().enumerate() {
        if !(value.is_finite() && value > last) {
            return Err(ReportError::Frequency {
                name: name.to_owned(),
                index,
                value,
            });
        }
        last = value;
    }
    Ok(())
}

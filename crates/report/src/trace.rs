//! Frequency responses to be plotted: checked, with their phases unwrapped.

use nalgebra::Complex;

use super::chart::colours::{BLUE, Colour, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION};
use super::{Pen, ReportError, SeriesPoint, Stroke, phase};
use bench_identify::{Frf, wrapped_phase_rad};

/// Half-width of the band in sigmas; smaller magnitudes are drawn faint.
pub(super) const BAND_SIGMAS: f64 = 2.0;
/// Smallest magnitude in sigmas whose phase is used for unwrapping: it is known to 0.25 rad.
const VALID_PHASE_SIGMAS: f64 = 4.0;
/// Measured frequencies further apart than this many resolutions have a gap between them.
const GAP_RESOLUTIONS: f64 = 2.0;
/// Colours of measured responses, and of models.
const MEASURED: [Colour; 4] = [BLUE, GREEN, PURPLE, SKY];
const MODEL: [Colour; 2] = [VERMILION, ORANGE];
/// Strokes of models over measured responses.
const STROKES: [Stroke; 2] = [Stroke::Dashed, Stroke::Dotted];
const LINE_WIDTH: f64 = 1.4;
const HALF_TURN_DEG: f64 = 180.0;
/// A measured response below others is wide, and a fit over it thin, so that both are visible where they agree.
const WIDTH_BELOW: f64 = 3.6;
const FIT: Pen = Pen::solid(INK).width(0.9);
/// An ambiguous response of fewer points than this is drawn as points: a line between them would show what is not known.
const FEW_POINTS: usize = 150;

/// A response with its name in the legend.
#[derive(Clone, Debug)]
pub struct Trace<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// The response.
    pub curve: Curve<'a>,
}

impl<'a> Trace<'a> {
    /// A measured response.
    pub fn measured(name: &'a str, frf: &'a Frf) -> Self {
        let curve = Curve::Measured(frf);
        Self { name, curve }
    }

    /// The response of a model.
    pub fn model(name: &'a str, frequency_hz: &'a [f64], response: &'a [Complex<f64>]) -> Self {
        let curve = Curve::Model {
            frequency_hz,
            response,
        };
        Self { name, curve }
    }

    /// The response of a fit to a measured response.
    pub fn fit(name: &'a str, frequency_hz: &'a [f64], response: &'a [Complex<f64>]) -> Self {
        let curve = Curve::Fit {
            frequency_hz,
            response,
        };
        Self { name, curve }
    }

    pub(super) fn is_measured(&self) -> bool {
        self.curve.measured().is_some()
    }
}

/// A response: measured, of a model or of a fit.
#[derive(Clone, Debug)]
pub enum Curve<'a> {
    /// Measured: a line with its band of two sigma, and its coherence.
    Measured(&'a Frf),
    /// Response of a model: a line.
    Model {
        /// Frequencies in hertz.
        frequency_hz: &'a [f64],
        /// Response in the unit of the plot.
        response: &'a [Complex<f64>],
    },
    /// Response of a fit: a thin line.
    Fit {
        /// Frequencies in hertz.
        frequency_hz: &'a [f64],
        /// Response in the unit of the plot.
        response: &'a [Complex<f64>],
    },
}

impl<'a> Curve<'a> {
    /// The response, if it is measured.
    fn measured(&self) -> Option<&'a Frf> {
        match *self {
            Curve::Measured(frf) => Some(frf),
            Curve::Model { .. } | Curve::Fit { .. } => None,
        }
    }

    /// Frequencies and response.
    fn columns(&self) -> (&'a [f64], &'a [Complex<f64>]) {
        match *self {
            Curve::Measured(frf) => (&frf.frequency_hz, &frf.response),
            Curve::Model {
                frequency_hz,
                response,
            }
            | Curve::Fit {
                frequency_hz,
                response,
            } => (frequency_hz, response),
        }
    }
}

/// A response ready to be plotted, with one entry per frequency in every column.
pub(super) struct Line<'a> {
    pub name: &'a str,
    pub pen: Pen,
    pub frequency_hz: &'a [f64],
    pub response: &'a [Complex<f64>],
    pub magnitude: Vec<f64>,
    /// Unwrapped, or in (-180, 180].
    pub phase_deg: Vec<f64>,
    /// Whether the phases are not unwrapped, because some of them are ambiguous.
    pub is_wrapped: bool,
    /// Whether the band of the magnitude excludes 0.
    pub certain: Vec<bool>,
    /// Whether no line joins the points.
    is_points: bool,
    /// Whether the phase is known well enough to be used for unwrapping.
    valid: Vec<bool>,
    pub measured: Option<&'a Frf>,
}

/// The responses with their pens, phases on the same turn where they overlap. If the phase of one is ambiguous, none is
/// unwrapped, so that they can be compared.
pub(super) fn lines<'a>(traces: &[Trace<'a>]) -> Result<Vec<Line<'a>>, ReportError> {
    let pens = pens(traces);
    let with_pens = traces.iter().zip(pens);
    let mut lines = with_pens
        .map(|(trace, pen)| Line::new(trace, pen))
        .collect::<Result<Vec<_>, _>>()?;
    if lines.iter().any(Line::is_ambiguous) {
        lines.iter_mut().for_each(Line::wrap)
    } else {
        align_phases(&mut lines)
    }
    if lines.is_empty() {
        Err(ReportError::NoTrace)
    } else {
        Ok(lines)
    }
}

/// A pen for each trace.
fn pens(traces: &[Trace]) -> Vec<Pen> {
    let mut pens = Vec::new();
    for (k, trace) in traces.iter().enumerate() {
        let is_same_kind = |other: &&Trace| {
            std::mem::discriminant(&other.curve) == std::mem::discriminant(&trace.curve)
        };
        let index = traces[..k].iter().filter(is_same_kind).count();
        pens.push(match trace.curve {
            Curve::Measured(_) => measured_pen(index, traces),
            Curve::Model { .. } => model_pen(index, traces),
            Curve::Fit { .. } => FIT,
        });
    }
    pens
}

fn measured_pen(index: usize, traces: &[Trace]) -> Pen {
    let is_alone = traces.iter().all(Trace::is_measured);
    let width = if is_alone { LINE_WIDTH } else { WIDTH_BELOW };
    Pen::solid(MEASURED[index % MEASURED.len()]).width(width)
}

/// Models are dashed where something measured lies below them.
fn model_pen(index: usize, traces: &[Trace]) -> Pen {
    let over_measured = traces.iter().any(Trace::is_measured);
    let stroke = if over_measured {
        STROKES[index % STROKES.len()]
    } else {
        Stroke::Solid
    };
    Pen {
        stroke,
        ..Pen::solid(MODEL[index % MODEL.len()]).width(LINE_WIDTH)
    }
}

impl<'a> Line<'a> {
    fn new(trace: &Trace<'a>, pen: Pen) -> Result<Self, ReportError> {
        check(trace)?;
        let measured = trace.curve.measured();
        let (frequency_hz, response) = trace.curve.columns();
        let magnitude: Vec<f64> = response.iter().map(|h| h.norm()).collect();
        let valid = above_sigmas(&magnitude, measured, VALID_PHASE_SIGMAS);
        let wrapped = wrapped_deg(response);
        Ok(Self {
            name: trace.name,
            pen,
            frequency_hz,
            response,
            certain: above_sigmas(&magnitude, measured, BAND_SIGMAS),
            phase_deg: phase::unwrapped_deg(&wrapped, &valid),
            is_wrapped: false,
            is_points: false,
            magnitude,
            valid,
            measured,
        })
    }

    /// Whether the phase is measured and cannot be unwrapped with certainty.
    fn is_ambiguous(&self) -> bool {
        self.measured.is_some() && phase::is_ambiguous(&self.phase_deg, &self.valid)
    }

    fn wrap(&mut self) {
        self.is_points = self.is_ambiguous() && self.frequency_hz.len() < FEW_POINTS;
        self.phase_deg = wrapped_deg(self.response);
        self.is_wrapped = true;
    }

    /// The magnitude with its band.
    pub fn magnitude_points(&self) -> Vec<SeriesPoint> {
        self.points(&self.magnitude, |frf, k| frf.magnitude_sigma[k])
    }

    /// The phase in degrees with its band. No stroke joins phases at both ends of a turn.
    pub fn phase_points(&self) -> Vec<SeriesPoint> {
        let mut points = self.points(&self.phase_deg, |frf, k| {
            frf.phase_sigma_rad[k].to_degrees()
        });
        for k in (1..points.len()).filter(|_| self.is_wrapped) {
            points[k].starts |= (points[k].y - points[k - 1].y).abs() > HALF_TURN_DEG;
        }
        points
    }

    fn points(&self, values: &[f64], sigma: fn(&Frf, usize) -> f64) -> Vec<SeriesPoint> {
        let values = values.iter().enumerate();
        values
            .map(|(k, y)| {
                let sigma = self.measured.map_or(0.0, |frf| sigma(frf, k));
                self.point(k, *y, BAND_SIGMAS * sigma)
            })
            .collect()
    }

    /// A value at a frequency, with the half-width of its band.
    fn point(&self, k: usize, y: f64, half_width: f64) -> SeriesPoint {
        SeriesPoint {
            x: self.frequency_hz[k],
            y,
            band: (y - half_width, y + half_width),
            faint: !self.certain[k],
            starts: self.starts(k),
        }
    }

    /// Whether no line joins a point with the one before it.
    pub fn starts(&self, k: usize) -> bool {
        k == 0 || self.is_points || self.measured.is_some_and(|frf| has_gap_before(frf, k))
    }

    /// The points (frequency, phase) whose phase is valid.
    fn valid_phases(&self) -> Vec<(f64, f64)> {
        let points = self
            .frequency_hz
            .iter()
            .copied()
            .zip(self.phase_deg.iter().copied());
        let valid = points.zip(&self.valid).filter(|(_, valid)| **valid);
        valid.map(|(point, _)| point).collect()
    }
}

/// Whether the phase of a measured response cannot be unwrapped with certainty: see [`phase::is_ambiguous`].
pub fn has_ambiguous_phase(frf: &Frf) -> bool {
    let magnitude: Vec<f64> = frf.response.iter().map(|h| h.norm()).collect();
    let valid = above_sigmas(&magnitude, Some(frf), VALID_PHASE_SIGMAS);
    phase::is_ambiguous(&wrapped_deg(&frf.response), &valid)
}

/// The phases in degrees, in (-180, 180].
fn wrapped_deg(response: &[Complex<f64>]) -> Vec<f64> {
    let phases = response.iter().map(|h| wrapped_phase_rad(*h).to_degrees());
    phases.collect()
}

/// Which magnitudes are above a multiple of their sigmas; all magnitudes of a model are.
fn above_sigmas(magnitude: &[f64], measured: Option<&Frf>, sigmas: f64) -> Vec<bool> {
    let magnitude = magnitude.iter().enumerate();
    magnitude
        .map(|(k, magnitude)| {
            *magnitude > sigmas * measured.map_or(0.0, |frf| frf.magnitude_sigma[k])
        })
        .collect()
}

/// Whether a gap lies between a measured frequency and the one before it.
pub(super) fn has_gap_before(frf: &Frf, k: usize) -> bool {
    if k == 0 {
        return false;
    }
    let step = frf.frequency_hz[k] - frf.frequency_hz[k - 1];
    step > GAP_RESOLUTIONS * frf.resolution_hz[k].max(frf.resolution_hz[k - 1])
}

/// Moves every line to the turn of the one that starts at the lowest frequency.
fn align_phases(lines: &mut [Line]) {
    let lowest = lines
        .iter()
        .min_by(|a, b| a.frequency_hz[0].total_cmp(&b.frequency_hz[0]));
    let Some(reference) = lowest.map(Line::valid_phases) else {
        return;
    };
    for line in lines {
        let offset = phase::offset_deg(&line.valid_phases(), &reference);
        line.phase_deg.iter_mut().for_each(|phase| *phase += offset);
    }
}

fn check(trace: &Trace) -> Result<(), ReportError> {
    let (frequency_hz, response) = trace.curve.columns();
    let columns = trace.curve.measured().map_or_else(Vec::new, |frf| {
        vec![
            &frf.coherence,
            &frf.magnitude_sigma,
            &frf.phase_sigma_rad,
            &frf.resolution_hz,
        ]
    });
    let mut lengths: Vec<usize> = columns.iter().map(|column| column.len()).collect();
    lengths.push(response.len());
    check_columns(trace.name, frequency_hz, &lengths)?;
    check_finite(trace.name, frequency_hz, |k| {
        response[k].norm().is_finite() && columns.iter().all(|column| column[k].is_finite())
    })
}

fn check_columns(name: &str, frequency_hz: &[f64], columns: &[usize]) -> Result<(), ReportError> {
    let (name, frequencies) = (name.to_owned(), frequency_hz.len());
    match columns.iter().find(|values| **values != frequencies) {
        Some(&values) => Err(ReportError::Lengths {
            name,
            frequencies,
            values,
        }),
        None if frequencies == 0 => Err(ReportError::Empty { name }),
        None => check_rising(name, frequency_hz),
    }
}

fn check_rising(name: String, frequency_hz: &[f64]) -> Result<(), ReportError> {
    let mut before = 0.0;
    for (index, &value) in frequency_hz.iter().enumerate() {
        if !(value.is_finite() && value > before) {
            return Err(ReportError::Frequency { name, index, value });
        }
        before = value;
    }
    Ok(())
}

fn check_finite(
    name: &str,
    frequency_hz: &[f64],
    finite: impl Fn(usize) -> bool,
) -> Result<(), ReportError> {
    match (0..frequency_hz.len()).find(|k| !finite(*k)) {
        Some(k) => Err(ReportError::NotFinite {
            name: name.to_owned(),
            frequency_hz: frequency_hz[k],
        }),
        None => Ok(()),
    }
}

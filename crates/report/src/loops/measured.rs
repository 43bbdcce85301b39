//! Plots of a measured loop: L with its margins as Bode and Nyquist plot, S and T.

use nalgebra::Complex;

use super::plane::{self, CRITICAL, plane, with_critical_point, with_unit_circle};
use crate::ReportError;
use crate::bode::{MAGNITUDE_HEIGHT, PHASE_HEIGHT, magnitude, phase, stacked};
use crate::chart::colours::{Colour, GREY, PURPLE};
use crate::chart::{Chart, Pen, Row, Symbol, sheet_svg};
use crate::ellipse::{self, SIGMAS_95_PLANE};
use crate::labels::{ResponsePoint, frequency_text, spread};
use crate::magnitude::{MagnitudeAxis, MagnitudeScale};
use crate::trace::{self, Line, Trace};
use bench_identify::{Frf, Unit};

/// Ends of the axes of the Nyquist plot: the surroundings of -1 and of the unit circle.
const REAL_PART: (f64, f64) = (-2.6, 1.4);
const IMAGINARY_PART: (f64, f64) = (-1.6, 1.6);
/// Height of the Nyquist plot in pixels; its axes have the same scale.
const NYQUIST_HEIGHT: f64 = 640.0;
/// Largest number of frequencies and of circles in the Nyquist plot.
const FREQUENCIES: usize = 14;
const CIRCLES: usize = 60;
/// Smallest distance of two labelled frequencies on the curve.
const LABEL_DISTANCE: f64 = 0.27;
/// Opacity of a circle.
const OPACITY: f64 = 0.15;
/// Scale of L, S and T.
const SCALE: MagnitudeScale = MagnitudeScale::new(Unit::Bare, MagnitudeAxis::Logarithmic);
/// Colour of the margins.
const MARK: Colour = PURPLE;
/// Symbols of the margins, in their order.
const SYMBOLS: [Symbol; 2] = [Symbol::Ring, Symbol::Dot];

/// A frequency of a loop with its name: a margin.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredMark {
    /// Name and value.
    pub label: String,
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// L there.
    pub loop_gain: Complex<f64>,
}

/// A measured loop with that of the model.
#[derive(Clone, Debug)]
pub struct MeasuredLoopPlot<'a> {
    /// Measured L.
    pub loop_gain: &'a Frf,
    /// L of the model at the same frequencies.
    pub model: &'a [Complex<f64>],
    /// Margins to be marked.
    pub marks: &'a [MeasuredMark],
    /// 1/max |S|.
    pub modulus_margin: Option<f64>,
    /// Title of the plot.
    pub title: &'a str,
    /// Line below the title.
    pub subtitle: &'a str,
}

impl MeasuredLoopPlot<'_> {
    fn lines(&self) -> Result<Vec<Line<'_>>, ReportError> {
        let frequency_hz = &self.loop_gain.frequency_hz;
        trace::lines(&[
            Trace::measured("L measured", self.loop_gain),
            Trace::model("L by the model", frequency_hz, self.model),
        ])
    }
}

/// The Bode plot of L as an SVG document. A band of two sigma surrounds the measured curve; margins are marked in both charts, and
/// the levels |L| = 1 and arg L = -180 deg are lines.
///
/// # Errors
/// When a response is invalid.
pub fn measured_bode_svg(plot: &MeasuredLoopPlot<'_>) -> Result<String, ReportError> {
    let lines = plot.lines()?;
    let mut gains = level(magnitude(SCALE, &lines)?, &lines, 1.0);
    let mut phases = level(phase(&lines), &lines, -180.0);
    for (mark, symbol) in plot.marks.iter().zip(SYMBOLS) {
        let gain = (mark.frequency_hz, mark.loop_gain.norm());
        let phase = (mark.frequency_hz, phase_deg(&lines[0], mark));
        gains = gains.points(&mark.label, MARK, symbol, vec![gain]);
        phases = phases.points(&mark.label, MARK, symbol, vec![phase]);
    }
    let charts = [(MAGNITUDE_HEIGHT, gains), (PHASE_HEIGHT, phases)];
    stacked(charts, &lines, plot.title, plot.subtitle)
}

/// The phase of a mark on the turn of the curve.
fn phase_deg(line: &Line, mark: &MeasuredMark) -> f64 {
    let after = line
        .frequency_hz
        .partition_point(|f| *f < mark.frequency_hz);
    let near_deg = line.phase_deg[after.min(line.phase_deg.len() - 1)];
    let phase_deg = mark.loop_gain.arg().to_degrees();
    phase_deg + 360.0 * libm::round((near_deg - phase_deg) / 360.0)
}

/// A horizontal line over all frequencies.
fn level(chart: Chart, lines: &[Line], value: f64) -> Chart {
    let points = plane::level(lines[0].frequency_hz, value);
    chart.line("", Pen::dotted(GREY), points)
}

/// The Nyquist plot of L around -1 as an SVG document, with frequencies in hertz on the measured curve, 95 % confidence circles, the
/// unit circle, and the circle about -1 whose radius is the modulus margin.
///
/// # Errors
/// When a response is invalid.
pub fn measured_nyquist_svg(plot: &MeasuredLoopPlot<'_>) -> Result<String, ReportError> {
    let lines = plot.lines()?;
    let mut chart = plane("", REAL_PART, IMAGINARY_PART);
    chart = confidence_circles(chart, &lines[0], plot.loop_gain);
    chart = with_unit_circle(chart, "|L| = 1");
    if let Some(radius) = plot.modulus_margin {
        let outline = plane::circle(CRITICAL, radius);
        chart = chart.line("modulus margin", Pen::dashed(MARK).thin(), outline);
    }
    for line in &lines {
        let points = line.response.iter().map(|l| (l.re, l.im)).collect();
        chart = chart.line(line.name, line.pen, points);
    }
    for (frequency_hz, l) in labelled(plot.loop_gain) {
        chart = chart
            .points("", lines[0].pen.colour, Symbol::Dot, vec![(l.re, l.im)])
            .text((l.re, l.im), (26.0, -9.0), &frequency_text(frequency_hz));
    }
    chart = with_critical_point(chart);
    let row = Row::new(NYQUIST_HEIGHT, vec![chart]);
    sheet_svg(plot.title, plot.subtitle, &[row])
}

fn is_inside(l: &Complex<f64>) -> bool {
    (REAL_PART.0..=REAL_PART.1).contains(&l.re)
        && (IMAGINARY_PART.0..=IMAGINARY_PART.1).contains(&l.im)
}

/// 95 % circles of some of the points inside.
fn confidence_circles(mut chart: Chart, line: &Line, frf: &Frf) -> Chart {
    let all = 0..frf.len();
    let inside: Vec<usize> = all.filter(|k| is_inside(&frf.response[*k])).collect();
    let step = inside.len().div_ceil(CIRCLES).max(1);
    let mut name = "95 % circles";
    for &k in inside.iter().step_by(step) {
        let (centre, radius) = (frf.response[k], SIGMAS_95_PLANE * frf.magnitude_sigma[k]);
        let outline = ellipse::circle((centre.re, centre.im), radius);
        chart = chart.area(name, line.pen.colour, OPACITY, outline);
        name = "";
    }
    chart
}

/// Frequencies whose points are far enough from each other for labels; those nearest to -1 first.
fn labelled(frf: &Frf) -> Vec<ResponsePoint> {
    let points = frf
        .frequency_hz
        .iter()
        .copied()
        .zip(frf.response.iter().copied());
    let mut candidates: Vec<ResponsePoint> = points.filter(|(_, l)| is_inside(l)).collect();
    candidates.sort_by(|(_, a), (_, b)| (a + 1.0).norm().total_cmp(&(b + 1.0).norm()));
    spread(candidates, LABEL_DISTANCE, FREQUENCIES)
}

/// Measured S and T with those of the model.
#[derive(Clone, Debug)]
pub struct MeasuredSensitivityPlot<'a> {
    /// Measured S.
    pub sensitivity: &'a Frf,
    /// Measured T.
    pub complementary: &'a Frf,
    /// L of the model at the frequencies of S.
    pub model_loop: &'a [Complex<f64>],
    /// The peak of |S|.
    pub peak: Option<&'a MeasuredMark>,
    /// Least allowed modulus margin; 0 for none.
    pub min_modulus_margin: f64,
    /// Title of the plot.
    pub title: &'a str,
    /// Line below the title.
    pub subtitle: &'a str,
}

/// |S| and |T| over frequency as an SVG document, each with a band of two sigma and beside that of the model, the peak of |S| and its
/// limit.
///
/// # Errors
/// When a response is invalid.
pub fn measured_sensitivity_svg(plot: &MeasuredSensitivityPlot<'_>) -> Result<String, ReportError> {
    let frequency_hz = &plot.sensitivity.frequency_hz;
    let model_loop = plot.model_loop.iter();
    let (sensitivity, complementary): (Vec<_>, Vec<_>) =
        model_loop.map(|l| ((l + 1.0).inv(), l / (l + 1.0))).unzip();
    let lines = trace::lines(&[
        Trace::measured("S", plot.sensitivity),
        Trace::measured("T", plot.complementary),
        Trace::model("S by the model", frequency_hz, &sensitivity),
        Trace::model("T by the model", frequency_hz, &complementary),
    ])?;
    let mut chart = level(magnitude(SCALE, &lines)?, &lines, 1.0);
    if plot.min_modulus_margin > 0.0 {
        let name = format!("limit of |S|: 1/{}", plot.min_modulus_margin);
        let limit = plane::level(frequency_hz, 1.0 / plot.min_modulus_margin);
        chart = chart.line(&name, Pen::dashed(GREY), limit);
    }
    if let Some(mark) = plot.peak {
        let size = (mark.loop_gain + 1.0).inv().norm();
        let at = vec![(mark.frequency_hz, size)];
        chart = chart.points(&mark.label, MARK, Symbol::Dot, at);
    }
    stacked(
        [(MAGNITUDE_HEIGHT, chart)],
        &lines,
        plot.title,
        plot.subtitle,
    )
}

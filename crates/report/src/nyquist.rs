//! The Nyquist plot: responses in the complex plane, measured ones with circles of confidence.

use nalgebra::Complex;

use super::ReportError;
use super::chart::colours::INK;
use super::chart::{Chart, Row, Scale, Symbol, sheet_svg};
use super::ellipse::{self, SIGMAS_95_PLANE};
use super::labels::{ResponsePoint, frequency_text, spread};
use super::trace::{self, BAND_SIGMAS, Line, Trace};
use bench_identify::{Frf, Unit};

/// Largest number of circles.
const CIRCLES: usize = 90;
/// Circles smaller than this part of the largest magnitude are invisible and not drawn.
const VISIBLE: f64 = 0.004;
/// Opacity of a circle.
const OPACITY: f64 = 0.13;
const MICRO: f64 = 1e6;
/// Number of labelled frequencies, their least distance as a ratio of the largest magnitude, and the place of the text in pixels.
const LABELS: usize = 10;
const LABEL_DISTANCE: f64 = 0.3;
const LABEL_OFFSET: (f64, f64) = (30.0, 8.0);

/// The Nyquist plot as an SVG document: all frequencies, in µm/A or in the unit of the columns, and beside them a part of
/// the frequencies in hertz. Arrows show the direction of rising frequency on the last model or fit, or on the measured curve without
/// one, and some frequencies are written beside it. Circles are 95 % confidence regions. Magnitudes below two sigma are left out, as their
/// direction is unknown.
///
/// # Errors
/// When there is nothing to draw, or a trace is invalid: see [`ReportError`].
pub fn nyquist_svg(
    unit: Unit,
    traces: &[Trace],
    part_hz: Option<(f64, f64)>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let lines = trace::lines(traces)?;
    let all_hz = (0.0, f64::INFINITY);
    let mut charts = vec![nyquist(unit, "All frequencies", &lines, all_hz)];
    if let Some((low, high)) = part_hz {
        let heading = format!("{low:.1} to {high:.1} Hz");
        charts.push(nyquist(unit, &heading, &lines, (low, high)));
    }
    sheet_svg(title, subtitle, &[Row::new(400.0, charts)])
}

fn nyquist(unit: Unit, heading: &str, lines: &[Line], band_hz: (f64, f64)) -> Chart {
    let (name, factor) = match unit {
        Unit::MetresPerAmpere => (" (µm/A)", MICRO),
        Unit::Bare => ("", 1.0),
    };
    let x = Scale::linear(&format!("Real part of H{name}"));
    let y = Scale::linear(&format!("Imaginary part of H{name}"));
    let mut chart = Chart::new(heading, x, y).equal();
    for line in lines {
        let indices = within(line, band_hz);
        if let Some(frf) = line.measured {
            chart = circles(chart, line, frf, &indices, factor);
        }
        let curve = points(line, &indices, factor);
        chart = if std::ptr::eq(line, finest(lines)) {
            chart.directed(line.name, line.pen, curve)
        } else {
            chart.line(line.name, line.pen, curve)
        };
    }
    chart = with_frequencies(chart, finest(lines), band_hz, factor);
    chart.points("origin", INK, Symbol::Cross, vec![(0.0, 0.0)])
}

/// The curve with arrows and frequencies: the last model or fit, which is smooth, or else the measured one.
fn finest<'a, 'b>(lines: &'a [Line<'b>]) -> &'a Line<'b> {
    let smooth = lines.iter().rev().find(|line| line.measured.is_none());
    smooth.unwrap_or(&lines[0])
}

/// Frequencies at some points of a curve, those of large magnitude first.
fn with_frequencies(mut chart: Chart, line: &Line, band_hz: (f64, f64), factor: f64) -> Chart {
    let indices = within(line, band_hz);
    let mut points: Vec<ResponsePoint> = indices
        .iter()
        .filter(|k| line.measured.is_none_or(|frf| is_known(frf, **k)))
        .map(|k| (line.frequency_hz[*k], line.response[*k]))
        .collect();
    points.sort_by(|(_, a), (_, b)| b.norm().total_cmp(&a.norm()));
    let distance = points
        .first()
        .map_or(0.0, |(_, h)| LABEL_DISTANCE * h.norm());
    for (frequency_hz, h) in spread(points, distance, LABELS) {
        let (at, text) = ((factor * h.re, factor * h.im), frequency_text(frequency_hz));
        let side = if h.re < 0.0 { -1.0 } else { 1.0 };
        chart = chart
            .points("", line.pen.colour, Symbol::Dot, vec![at])
            .text(at, (side * LABEL_OFFSET.0, LABEL_OFFSET.1), &text);
    }
    chart
}

/// Indices of the frequencies of a band.
fn within(line: &Line, (low, high): (f64, f64)) -> Vec<usize> {
    let frequencies = line.frequency_hz.iter().enumerate();
    let inside = frequencies.filter(|(_, f)| (low..=high).contains(*f));
    inside.map(|(k, _)| k).collect()
}

/// Circles of confidence that are visible and do not hide each other.
fn circles(mut chart: Chart, line: &Line, frf: &Frf, indices: &[usize], factor: f64) -> Chart {
    let mut name = "95 % circles";
    for (centre, radius) in visible_circles(line, frf, indices) {
        let outline = ellipse::circle((centre.re * factor, centre.im * factor), factor * radius);
        chart = chart.area(name, line.pen.colour, OPACITY, outline);
        name = "";
    }
    chart
}

/// Centres and radii.
fn visible_circles(line: &Line, frf: &Frf, indices: &[usize]) -> Vec<(Complex<f64>, f64)> {
    let magnitudes = indices.iter().map(|k| line.magnitude[*k]);
    let min_radius = VISIBLE * magnitudes.fold(0.0, f64::max);
    let step = indices.len().div_ceil(CIRCLES).max(1);
    let mut circles: Vec<(Complex<f64>, f64)> = Vec::new();
    for &k in indices.iter().step_by(step) {
        let (centre, radius) = (frf.response[k], SIGMAS_95_PLANE * frf.magnitude_sigma[k]);
        let is_free = circles
            .iter()
            .all(|(other, _)| (centre - other).norm() >= radius);
        if radius > min_radius && is_known(frf, k) && is_free {
            circles.push((centre, radius));
        }
    }
    circles
}

/// The curve, with gaps where frequencies, or magnitudes above the noise, are missing, and where the points are too far apart for a line.
fn points(line: &Line, indices: &[usize], factor: f64) -> Vec<(f64, f64)> {
    const GAP: (f64, f64) = (f64::NAN, f64::NAN);
    let mut points = Vec::new();
    for &k in indices {
        if line.starts(k) {
            points.push(GAP);
        }
        let known = line.measured.is_none_or(|frf| is_known(frf, k));
        let h = line.response[k] * factor;
        points.push(if known { (h.re, h.im) } else { GAP });
    }
    points
}

fn is_known(frf: &Frf, k: usize) -> bool {
    frf.response[k].norm() > BAND_SIGMAS * frf.magnitude_sigma[k]
}

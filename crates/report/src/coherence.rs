//! The coherence of a measured response.

use super::ReportError;
use super::chart::colours::BLUE;
use super::chart::{Chart, Pen, Row, Scale, sheet_svg};
use super::trace::{self, Trace, has_gap_before};
use bench_identify::Frf;

const HEIGHT: f64 = 250.0;

/// The coherence over frequency as an SVG document, and below it 1 - coherence on a logarithmic axis.
///
/// # Errors
/// When the response is empty or invalid: see [`ReportError`].
pub fn coherence_svg(frf: &Frf, title: &str, subtitle: &str) -> Result<String, ReportError> {
    trace::lines(&[Trace::measured("coherence", frf)])?;
    let explained = Scale::linear("Coherence (ratio)").within(0.0, 1.05);
    let rest = Scale::logarithmic("1 − coherence (ratio)");
    let rest_heading = "Part of the output power that the input does not explain";
    let charts = [
        chart("", explained, frf, |coherence| coherence),
        chart(rest_heading, rest, frf, |coherence| 1.0 - coherence),
    ];
    let rows = charts.map(|chart| Row::new(HEIGHT, vec![chart]));
    sheet_svg(title, subtitle, &rows)
}

fn chart(heading: &str, y: Scale, frf: &Frf, value: fn(f64) -> f64) -> Chart {
    let pen = Pen::solid(BLUE).width(1.2);
    let ends = frf.frequency_hz.first().zip(frf.frequency_hz.last());
    let x = Scale::frequency(ends.map_or((0.0, 0.0), |(first, last)| (*first, *last)));
    let chart = Chart::new(heading, x, y).without_legend();
    chart.line("measured", pen, points(frf, value))
}

fn points(frf: &Frf, value: fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut points = Vec::new();
    for (k, frequency_hz) in frf.frequency_hz.iter().enumerate() {
        if has_gap_before(frf, k) {
            points.push((f64::NAN, f64::NAN));
        }
        points.push((*frequency_hz, value(frf.coherence[k])));
    }
    points
}

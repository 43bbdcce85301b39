//! The response of the plant to a step of force, and the part of each mode.

use super::colour;
use crate::ReportError;
use crate::chart::colours::{BLUE, GREY, INK};
use crate::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use crate::labels::frequency_text;
use bench_base::numeric::linspace;
use bench_thesis::{StepFeatures, StepResponse};

const HEIGHT: f64 = 420.0;
const MICRO: f64 = 1e6;
const MILLI: f64 = 1e3;
/// Number of times that are drawn.
const TIMES: usize = 2000;

/// The response up to a time and its beginning, in which reversals are counted, with its zero crossings and reversals, and thin the
/// parts of the modes, as an SVG document.
///
/// # Errors
/// When there is nothing to draw.
pub fn model_step_svg(
    response: &StepResponse<'_>,
    features: &StepFeatures,
    end_s: f64,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let mut charts = vec![chart("", response, features, end_s)];
    if features.initial_s > 0.0 && features.initial_s < end_s {
        charts.push(chart(
            "The beginning",
            response,
            features,
            features.initial_s,
        ));
    }
    sheet_svg(title, subtitle, &[Row::new(HEIGHT, charts)])
}

/// Modes are named by frequency: the response has only the observable ones, so that their numbers differ from those of other results.
fn part_name(frequency_hz: f64) -> String {
    if frequency_hz > 0.0 {
        format!("part of the mode at {}", frequency_text(frequency_hz))
    } else {
        "part of the rigid body".into()
    }
}

fn chart(heading: &str, response: &StepResponse<'_>, features: &StepFeatures, end_s: f64) -> Chart {
    let times_s: Vec<f64> = linspace(0.0, end_s, TIMES).collect();
    let place = |t: f64| (MILLI * t, MICRO * response.position_m(t));
    let parts: Vec<Vec<f64>> = times_s.iter().map(|t| response.parts_m(*t)).collect();
    let x = Scale::linear("Time since the step (ms)");
    let mut chart = Chart::new(heading, x, Scale::linear("Displacement (µm/N)")).line(
        "",
        Pen::solid(GREY).thin(),
        vec![(0.0, 0.0), (MILLI * end_s, 0.0)],
    );
    for (mode, frequency_hz) in response.frequencies_hz().into_iter().enumerate() {
        let points = times_s.iter().zip(&parts);
        let points = points.map(|(t, parts)| (MILLI * t, MICRO * parts[mode]));
        chart = chart.line(
            &part_name(frequency_hz),
            Pen::dashed(colour(mode + 1)).thin(),
            points.collect(),
        );
    }
    let whole = times_s.iter().map(|t| place(*t)).collect();
    chart = chart.line("response", Pen::solid(BLUE).width(2.2), whole);
    for (name, symbol, marked_s) in [
        ("zero crossing", Symbol::Ring, &features.zero_crossings_s),
        ("reversal", Symbol::Cross, &features.reversals_s),
    ] {
        let inside = marked_s.iter().filter(|t| **t <= end_s);
        let places: Vec<(f64, f64)> = inside.map(|t| place(*t)).collect();
        if !places.is_empty() {
            chart = chart.points(name, INK, symbol, places);
        }
    }
    chart
}

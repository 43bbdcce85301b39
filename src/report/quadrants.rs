//! Actuator and probe in the plane of two mode shapes (Fig 4-5a), one chart for each value of a setting.

use super::ReportError;
use super::chart::colours::{BLUE, Colour, GREY, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, sheet_svg};
use super::ellipse::Ellipse;
use crate::model::veering::QuadrantDiagram;

/// Height of a chart in pixels, and the values that it shows around the unit circle; captions stand below the circle.
const HEIGHT: f64 = 365.0;
const X_RANGE: (f64, f64) = (-1.25, 1.25);
const Y_RANGE: (f64, f64) = (-2.62, 1.3);
const FIRST_CAPTION: (f64, f64) = (0.0, -1.42);
const CAPTION_HEIGHT: f64 = 18.0;
const ALTERNATING: Colour = Colour(200, 30, 30);
const UNIT_CIRCLE: Ellipse = Ellipse {
    half_axes: [1.0, 1.0],
    angle_rad: 0.0,
};
const NUMERALS: [&str; 4] = ["I", "II", "III", "IV"];
/// Signs of the components along u and v in the quadrants.
const SIGNS: [(f64, f64); 4] = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];

/// A diagram and its heading.
#[derive(Clone, Debug)]
pub struct QuadrantPanel {
    /// Heading.
    pub title: String,
    /// Diagram.
    pub picture: QuadrantDiagram,
}

/// The diagrams side by side, as an SVG document. The longer vector of each reaches the circle. The quadrant in which a
/// probe makes the signs alternate is shaded.
///
/// # Errors
/// When there is no diagram, or the drawing library fails.
pub fn quadrants_svg(
    panels: &[QuadrantPanel],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let chart = |(k, panel): (usize, &QuadrantPanel)| chart(panel, k == 0);
    let charts = panels.iter().enumerate().map(chart).collect();
    sheet_svg(title, subtitle, &[Row::new(HEIGHT, charts)])
}

fn chart(panel: &QuadrantPanel, with_legend: bool) -> Chart {
    let picture = &panel.picture;
    let name = |name: &'static str| if with_legend { name } else { "" };
    let x = Scale::blank("").within(X_RANGE.0, X_RANGE.1).unnumbered();
    let y = Scale::blank("").within(Y_RANGE.0, Y_RANGE.1);
    let mut chart = Chart::new(&panel.title, x, y).equal();
    if let Some(quadrant) = picture.avoid() {
        let sector = sector(picture.shapes, quadrant);
        chart = chart.area(
            name("a probe here makes the signs alternate"),
            ALTERNATING,
            0.13,
            sector,
        );
    }
    chart = chart.line(
        "",
        Pen::solid(GREY).width(0.8),
        UNIT_CIRCLE.outline((0.0, 0.0)),
    );
    chart = with_shapes(chart, picture.shapes, name("mode shape φ"));
    let length = longest(picture).max(f64::MIN_POSITIVE);
    for (vector, colour, vector_name) in [
        (picture.actuator, VERMILION, "actuator"),
        (picture.sensor, BLUE, "probe"),
    ] {
        let tip = picture.in_frame(vector).map(|component| component / length);
        chart = chart.arrow(
            name(vector_name),
            Pen::solid(colour).width(2.2),
            (0.0, 0.0),
            tip.into(),
        );
    }
    with_captions(chart, picture)
}

/// The shapes u and v, the line across each, and the numbers of the quadrants.
fn with_shapes(mut chart: Chart, [u, v]: [[f64; 2]; 2], name: &str) -> Chart {
    let thin = Pen::solid(GREY).width(0.8);
    for (text, name, shape, across) in [("φu", name, u, v), ("φv", "", v, u)] {
        let ends = [-1.0, 1.0].map(|side| (side * across[0], side * across[1]));
        chart = chart.line("", thin, ends.to_vec());
        chart = chart.arrow(name, thin, (0.0, 0.0), (1.07 * shape[0], 1.07 * shape[1]));
        chart = chart.text((1.17 * shape[0], 1.17 * shape[1]), (0.0, 0.0), text);
    }
    for (signs, numeral) in SIGNS.iter().zip(NUMERALS) {
        let middle = combination(u, v, 0.51 * signs.0, 0.51 * signs.1);
        chart = chart.text(middle, (0.0, 0.0), numeral);
    }
    chart
}

fn with_captions(chart: Chart, picture: &QuadrantDiagram) -> Chart {
    let lines = captions(picture);
    lines.iter().enumerate().fold(chart, |chart, (row, line)| {
        chart.text(FIRST_CAPTION, (0.0, CAPTION_HEIGHT * row as f64), line)
    })
}

fn captions(picture: &QuadrantDiagram) -> Vec<String> {
    let place = |quadrant: Option<usize>| match quadrant {
        Some(quadrant) => format!("in {}", NUMERALS[quadrant - 1]),
        None => "on a line".into(),
    };
    let [actuator, probe] = picture.quadrants().map(place);
    let turn_deg = (picture.turn_rad().to_degrees() * 10.0).round() / 10.0 + 0.0;
    let mut lines = vec![format!("actuator {actuator}, probe {probe}")];
    lines.extend(sign_captions(picture.signs()));
    lines.push(format!(
        "circle: {:.3} of the vector length",
        longest(picture)
    ));
    lines.push(format!("shapes turned by {turn_deg:+.1}°"));
    lines
        .iter()
        .map(|line| line.replace('-', "\u{2212}"))
        .collect()
}

fn sign_captions(signs: Option<[char; 3]>) -> Vec<String> {
    let Some([r, u, v]) = signs else {
        return vec!["the modes cross".into()];
    };
    let (which, zeros) = match r == v && r != u {
        true => ("signs alternate:", "CNMP zeros possible"),
        false => ("signs do not alternate:", "no CNMP zeros"),
    };
    vec![
        format!("αR {r}   αu {u}   αv {v}"),
        which.into(),
        zeros.into(),
    ]
}

/// Length of the longer vector, as a ratio of its whole length.
fn longest(picture: &QuadrantDiagram) -> f64 {
    let lengths = [picture.actuator, picture.sensor].map(|[x, y]| libm::hypot(x, y));
    lengths.into_iter().fold(0.0, f64::max)
}

fn combination(u: [f64; 2], v: [f64; 2], a: f64, b: f64) -> (f64, f64) {
    (a * u[0] + b * v[0], a * u[1] + b * v[1])
}

/// A quarter of the disc.
fn sector([u, v]: [[f64; 2]; 2], quadrant: usize) -> Vec<(f64, f64)> {
    let (a, b) = SIGNS[quadrant - 1];
    let point = |step: i32| {
        let (sine, cosine) = libm::sincos(f64::from(step) * core::f64::consts::FRAC_PI_2 / 24.0);
        combination(u, v, a * cosine, b * sine)
    };
    core::iter::once((0.0, 0.0))
        .chain((0..=24).map(point))
        .collect()
}

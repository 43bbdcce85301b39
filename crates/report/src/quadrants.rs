//! Actuator and probe in the plane of two mode shapes (Fig 4-5a), one chart for each value of a setting.

use super::ReportError;
use super::chart::colours::{BLUE, Colour, GREY, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, sheet_svg};
use super::ellipse::Ellipse;
use bench_thesis::veering::QuadrantDiagram;

/// Height of a chart in pixels, and the values that it shows around the unit circle; the captions are below the circle.
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
const ORIGIN: (f64, f64) = (0.0, 0.0);
const THIN: Pen = Pen::solid(GREY).width(0.8);
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
/// When there is no diagram.
pub fn quadrants_svg(
    panels: &[QuadrantPanel],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let charts = panels.iter().enumerate();
    let charts = charts.map(|(k, panel)| chart(panel, &Names::new(k == 0)));
    sheet_svg(title, subtitle, &[Row::new(HEIGHT, charts.collect())])
}

/// Names in the legend. Only the first chart has one: empty names have no entry.
#[derive(Default)]
struct Names {
    sector: &'static str,
    shape: &'static str,
    actuator: &'static str,
    probe: &'static str,
}

impl Names {
    fn new(with_legend: bool) -> Names {
        if !with_legend {
            return Names::default();
        }
        Names {
            sector: "a probe here makes the signs alternate",
            shape: "mode shape φ",
            actuator: "actuator",
            probe: "probe",
        }
    }
}

fn chart(panel: &QuadrantPanel, names: &Names) -> Chart {
    let picture = &panel.picture;
    let x = Scale::blank("").within(X_RANGE.0, X_RANGE.1).unnumbered();
    let y = Scale::blank("").within(Y_RANGE.0, Y_RANGE.1);
    let mut chart = Chart::new(&panel.title, x, y).equal();
    if let Some(quadrant) = picture.avoid() {
        let sector = sector(picture.shapes, quadrant);
        chart = chart.area(names.sector, ALTERNATING, 0.13, sector);
    }
    chart = chart.line("", THIN, UNIT_CIRCLE.outline(ORIGIN));
    chart = with_shape(chart, picture.shapes, "φu", names.shape);
    let [u, v] = picture.shapes;
    chart = with_shape(chart, [v, u], "φv", "");
    chart = with_numerals(chart, [u, v]);
    chart = with_vectors(chart, picture, names);
    with_captions(chart, picture)
}

/// The vectors of actuator and probe, the longer one up to the circle.
fn with_vectors(chart: Chart, picture: &QuadrantDiagram, names: &Names) -> Chart {
    let length = longest(picture).max(f64::MIN_POSITIVE);
    let [actuator, sensor] = [picture.actuator, picture.sensor]
        .map(|vector| picture.in_frame(vector).map(|component| component / length));
    let [red, blue] = [VERMILION, BLUE].map(|colour| Pen::solid(colour).width(2.2));
    chart
        .arrow(names.actuator, red, ORIGIN, actuator.into())
        .arrow(names.probe, blue, ORIGIN, sensor.into())
}

/// A mode shape, and the line along the other shape, which separates the quadrants.
fn with_shape(chart: Chart, [shape, across]: [[f64; 2]; 2], text: &str, name: &str) -> Chart {
    let ends = [-1.0, 1.0].map(|side| (side * across[0], side * across[1]));
    chart
        .line("", THIN, ends.to_vec())
        .arrow(name, THIN, ORIGIN, (1.07 * shape[0], 1.07 * shape[1]))
        .text((1.17 * shape[0], 1.17 * shape[1]), (0.0, 0.0), text)
}

/// The numbers of the quadrants.
fn with_numerals(chart: Chart, [u, v]: [[f64; 2]; 2]) -> Chart {
    let quadrants = SIGNS.iter().zip(NUMERALS);
    quadrants.fold(chart, |chart, (signs, numeral)| {
        let middle = combination(u, v, 0.51 * signs.0, 0.51 * signs.1);
        chart.text(middle, (0.0, 0.0), numeral)
    })
}

fn with_captions(chart: Chart, picture: &QuadrantDiagram) -> Chart {
    let lines = captions(picture);
    lines.iter().enumerate().fold(chart, |chart, (row, line)| {
        chart.text(FIRST_CAPTION, (0.0, CAPTION_HEIGHT * row as f64), line)
    })
}

fn captions(picture: &QuadrantDiagram) -> Vec<String> {
    let [actuator, probe] = picture.quadrants().map(place);
    let turn_deg = (picture.turn_rad().to_degrees() * 10.0).round() / 10.0 + 0.0;
    let radius = longest(picture);
    let mut lines = vec![format!("actuator {actuator}, probe {probe}")];
    lines.extend(sign_captions(picture.signs()));
    lines.push(format!("circle: {radius:.3} of the vector length"));
    lines.push(format!("shapes turned by {turn_deg:+.1}°"));
    lines
        .iter()
        .map(|line| line.replace('-', "\u{2212}"))
        .collect()
}

fn place(quadrant: Option<usize>) -> String {
    match quadrant {
        Some(quadrant) => format!("in {}", NUMERALS[quadrant - 1]),
        None => "on a line".into(),
    }
}

fn sign_captions(signs: Option<[char; 3]>) -> Vec<String> {
    let Some([r, u, v]) = signs else {
        return vec!["the modes cross".into()];
    };
    let (which, zeros) = if r == v && r != u {
        ("signs alternate:", "CNMP zeros possible")
    } else {
        ("signs do not alternate:", "no CNMP zeros")
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
    let angles = (0..=24).map(|step| f64::from(step) * core::f64::consts::FRAC_PI_2 / 24.0);
    let arc = angles
        .map(libm::sincos)
        .map(|(sine, cosine)| combination(u, v, a * cosine, b * sine));
    core::iter::once(ORIGIN).chain(arc).collect()
}

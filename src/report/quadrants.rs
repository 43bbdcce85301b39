//! Actuator and probe in the plane of two shapes (Fig 4-5a), one panel a value.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::ReportError;
use super::canvas::{self, Canvas, TextForm};
use super::header::Header;
use super::panel::INK;
use crate::model::veering::QuadrantDiagram;

const LEFT: f64 = 24.0;
const SIDE: f64 = 300.0;
const GAP: f64 = 24.0;
const RADIUS: f64 = 118.0;
/// Room for title, circle and the lines below it.
const PANEL_HEIGHT: f64 = 404.0;
const LEGEND_HEIGHT: f64 = 30.0;
const SHAPE: RGBColor = RGBColor(120, 120, 120);
const ACTUATOR: RGBColor = RGBColor(204, 84, 0);
const PROBE: RGBColor = RGBColor(0, 98, 168);
const AVOID: RGBColor = RGBColor(200, 30, 30);
const NUMERALS: [&str; 4] = ["I", "II", "III", "IV"];

/// A picture and what stands above it.
#[derive(Clone, Debug)]
pub struct QuadrantPanel {
    /// When.
    pub title: String,
    /// What.
    pub picture: QuadrantDiagram,
}

/// The quadrants side by side, as an SVG document. The longer vector of a panel reaches the
/// circle. Shaded: the
/// quadrant in which a probe makes the signs alternate.
///
/// # Errors
/// When there is no panel, or the drawing library fails.
pub fn quadrants_svg(
    panels: &[QuadrantPanel],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if panels.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let width = 2.0 * LEFT + panels.len() as f64 * SIDE + (panels.len() - 1) as f64 * GAP;
    let header = Header::new(title, subtitle, &[], (LEFT, width - LEFT));
    let size = (width, header.bottom + PANEL_HEIGHT + LEGEND_HEIGHT);
    canvas::page(size, |canvas| {
        header.draw(canvas, &[])?;
        for (index, panel) in panels.iter().enumerate() {
            let left = LEFT + index as f64 * (SIDE + GAP);
            draw(canvas, panel, (left, header.bottom))?;
        }
        legend(canvas, size.1 - 16.0)
    })
}

/// The longer of the two vectors, a part of its whole length.
fn longest(picture: &QuadrantDiagram) -> f64 {
    [picture.actuator, picture.sensor]
        .into_iter()
        .map(|[x, y]| libm::hypot(x, y))
        .fold(0.0, f64::max)
}

/// A point of the frame on the page: y upwards.
struct Frame {
    centre: (f64, f64),
}

impl Frame {
    fn at(&self, [x, y]: [f64; 2], pixels: f64) -> (f64, f64) {
        (self.centre.0 + x * pixels, self.centre.1 - y * pixels)
    }
}

fn draw(
    canvas: &Canvas,
    panel: &QuadrantPanel,
    (left, top): (f64, f64),
) -> Result<(), ReportError> {
    let (frame, picture) = (
        Frame {
            centre: (left + SIDE / 2.0, top + 172.0),
        },
        &panel.picture,
    );
    write(
        canvas,
        &panel.title,
        (left + SIDE / 2.0, top),
        13.0,
        INK,
        true,
    )?;
    let [u, v] = picture.shapes;
    if let Some(quadrant) = picture.avoid() {
        canvas.area(&sector(&frame, u, v, quadrant), AVOID.mix(0.13))?;
    }
    canvas.line(&circle(&frame), SHAPE.mix(0.6), 0.8)?;
    for (name, shape, across) in [("u", u, v), ("v", v, u)] {
        let ends = [frame.at(across, -RADIUS), frame.at(across, RADIUS)];
        canvas.line(&ends, SHAPE.mix(0.8), 0.8)?;
        arrow(
            canvas,
            frame.centre,
            frame.at(shape, RADIUS + 8.0),
            SHAPE,
            1.0,
        )?;
        write(
            canvas,
            &format!("φ{name}"),
            frame.at(shape, RADIUS + 20.0),
            12.5,
            INK,
            false,
        )?;
    }
    for (quadrant, numeral) in (1..).zip(NUMERALS) {
        let middle = middle(u, v, quadrant);
        write(
            canvas,
            numeral,
            frame.at(middle, 0.72 * RADIUS),
            13.0,
            SHAPE,
            false,
        )?;
    }
    let longest = longest(picture).max(f64::MIN_POSITIVE);
    for (vector, colour) in [(picture.actuator, ACTUATOR), (picture.sensor, PROBE)] {
        arrow(
            canvas,
            frame.centre,
            frame.at(picture.in_frame(vector), RADIUS / longest),
            colour,
            2.2,
        )?;
    }
    captions(
        canvas,
        picture,
        (left + SIDE / 2.0, top + 172.0 + RADIUS + 36.0),
    )
}

fn captions(
    canvas: &Canvas,
    picture: &QuadrantDiagram,
    (x, y): (f64, f64),
) -> Result<(), ReportError> {
    let place = |quadrant: Option<usize>| {
        quadrant.map_or("on a line".into(), |quadrant| {
            format!("in {}", NUMERALS[quadrant - 1])
        })
    };
    let [actuator, probe] = picture.quadrants().map(place);
    let turned = format!(
        "{:+.1}°",
        (picture.turn_rad().to_degrees() * 10.0).round() / 10.0 + 0.0
    )
    .replace('-', "−");
    let (signs, verdict) = match picture.signs() {
        None => ("the modes cross".into(), ""),
        Some([r, u, v]) => {
            let alternate = r == v && ["+-", "-+"].contains(&format!("{r}{u}").as_str());
            let verdict = if alternate {
                "signs alternate: CNMP zeros may appear"
            } else {
                "signs do not alternate: no CNMP zeros"
            };
            (
                format!("αR {r}   αu {u}   αv {v}").replace('-', "−"),
                verdict,
            )
        }
    };
    let length = format!(
        "circle: {:.3} of a vector's length, turned {turned}",
        longest(picture)
    );
    let lines = [
        format!("actuator {actuator}, probe {probe}"),
        signs,
        verdict.to_string(),
        length,
    ];
    for (row, line) in (0..).zip(lines.iter().filter(|line| !line.is_empty())) {
        write(
            canvas,
            line,
            (x, y + 18.0 * f64::from(row)),
            12.0,
            INK,
            false,
        )?;
    }
    Ok(())
}

fn legend(canvas: &Canvas, y: f64) -> Result<(), ReportError> {
    let entries = [
        (LEFT, ACTUATOR, "actuator"),
        (LEFT + 110.0, PROBE, "probe"),
        (LEFT + 200.0, SHAPE, "shapes φ and the lines across them"),
    ];
    for (x, colour, name) in entries {
        arrow(canvas, (x, y), (x + 28.0, y), colour, 2.0)?;
        left(canvas, name, (x + 36.0, y))?;
    }
    let x = LEFT + 480.0;
    canvas.area(
        &[
            (x, y - 7.0),
            (x + 28.0, y - 7.0),
            (x + 28.0, y + 7.0),
            (x, y + 7.0),
        ],
        AVOID.mix(0.13),
    )?;
    left(
        canvas,
        "a probe here makes the signs alternate",
        (x + 36.0, y),
    )
}

fn middle(u: [f64; 2], v: [f64; 2], quadrant: usize) -> [f64; 2] {
    let (a, b) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][quadrant - 1];
    [0, 1].map(|axis| (a * u[axis] + b * v[axis]) * 0.5f64.sqrt())
}

/// A quarter of the disc.
fn sector(frame: &Frame, u: [f64; 2], v: [f64; 2], quadrant: usize) -> Vec<(f64, f64)> {
    let (a, b) = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)][quadrant - 1];
    let point = |step: i32| {
        let (sine, cosine) = libm::sincos(f64::from(step) * core::f64::consts::FRAC_PI_2 / 24.0);
        frame.at(
            [0, 1].map(|axis| a * cosine * u[axis] + b * sine * v[axis]),
            RADIUS,
        )
    };
    core::iter::once(frame.centre)
        .chain((0..=24).map(point))
        .collect()
}

fn circle(frame: &Frame) -> Vec<(f64, f64)> {
    let point = |step: i32| {
        let (sine, cosine) = libm::sincos(f64::from(step) * core::f64::consts::PI / 48.0);
        frame.at([cosine, sine], RADIUS)
    };
    (0..=96).map(point).collect()
}

/// A line with a head, which is left out where the line is shorter.
fn arrow(
    canvas: &Canvas,
    from: (f64, f64),
    to: (f64, f64),
    colour: RGBColor,
    width: f64,
) -> Result<(), ReportError> {
    canvas.line(&[from, to], colour.to_rgba(), width)?;
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = libm::hypot(dx, dy);
    let head = 5.0 + 1.5 * width;
    if length < head {
        return canvas.dot(to, width, colour.to_rgba());
    }
    let (x, y) = (dx / length, dy / length);
    let side = |turn: f64| {
        (
            to.0 - head * x - turn * 0.4 * head * y,
            to.1 - head * y + turn * 0.4 * head * x,
        )
    };
    canvas.area(&[to, side(1.0), side(-1.0)], colour.to_rgba())
}

fn write(
    canvas: &Canvas,
    text: &str,
    at: (f64, f64),
    size: f64,
    colour: RGBColor,
    bold: bool,
) -> Result<(), ReportError> {
    let anchor = (HPos::Center, VPos::Center);
    canvas.text(
        text,
        at,
        TextForm {
            size,
            colour,
            bold,
            anchor,
            upward: false,
        },
    )
}

fn left(canvas: &Canvas, text: &str, at: (f64, f64)) -> Result<(), ReportError> {
    let anchor = (HPos::Left, VPos::Center);
    canvas.text(
        text,
        at,
        TextForm {
            size: 12.5,
            colour: INK,
            bold: false,
            anchor,
            upward: false,
        },
    )
}

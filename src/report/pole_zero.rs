//! The map of poles and zeros: the whole, the two closest modes enlarged, and zeros enlarged until their ellipses are seen.

use nalgebra::Complex;

use super::chart::{Chart, Pen, Scale, Symbol};
use super::colours::{BLUE, Colour, GREY, INK, VERMILION};
use super::ellipse::{Ellipse, SIGMAS_95_PLANE};
use super::sheet::{Row, sheet_svg};
use super::{ReportError, number};
use crate::identify::modal::SIGMAS_95;

/// Zeros enlarged at most: those nearest to the imaginary axis, in their sigmas.
const ENLARGED: usize = 3;
/// Beyond every frame, in rad/s.
const FAR: f64 = 1e9;
/// Part of an enlarged ellipse's half-width left free beside it.
const ROOM: f64 = 0.45;
/// The axis is within the frame of an enlarged zero that is closer to it than so many half-widths of its ellipse.
const AXIS_WITHIN: f64 = 6.0;
/// Poles more damped than this, as ratio of |s|, have no say in the frame.
const OSCILLATES: f64 = 0.2;

/// A pole or a zero in the plane of s: of a conjugate pair the one above the real axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where, in rad/s.
    pub s: Complex<f64>,
    /// Covariance of its real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
}

/// What is on the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoleZeroMap {
    /// All poles.
    pub poles: Vec<Place>,
    /// Zeros that a verdict is about.
    pub zeros: Vec<Place>,
    /// Others, of which nothing is said.
    pub others: Vec<Place>,
    /// Up to here poles and zeros count, in rad/s.
    pub up_to_rad_s: f64,
}

/// The map as an SVG document.
///
/// # Errors
/// When drawing fails.
pub fn pole_zero_svg(
    map: &PoleZeroMap,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let first = std::iter::once(map.whole())
        .chain(map.close_modes())
        .collect();
    let rows = [Row::new(400.0, first), Row::new(250.0, map.enlarged())];
    sheet_svg(title, subtitle, &rows)
}

impl PoleZeroMap {
    /// The two neighbouring poles that are closest to each other for their frequency, among those that count: their
    /// imaginary parts in rad/s.
    pub fn close_pair(&self) -> Option<(f64, f64)> {
        let counts = |place: &&Place| place.s.im > 0.0 && place.s.norm() <= self.up_to_rad_s;
        let mut im: Vec<f64> = self
            .poles
            .iter()
            .filter(counts)
            .map(|pole| pole.s.im)
            .collect();
        im.sort_by(f64::total_cmp);
        let pairs = im.windows(2).map(|pair| (pair[0], pair[1]));
        pairs.min_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0)))
    }

    fn whole(&self) -> Chart {
        let swings = |place: &&Place| -place.s.re <= OSCILLATES * place.s.norm();
        let seen: Vec<&Place> = self
            .poles
            .iter()
            .filter(swings)
            .chain(&self.zeros)
            .collect();
        let re = span(seen.iter().map(|place| place.s.re), 0.15);
        let highest = seen.iter().map(|place| place.s.im).fold(0.0, f64::max);
        let frame = (re, (0.0, 1.08 * highest.max(1.0)));
        let beyond = self
            .poles
            .iter()
            .chain(&self.zeros)
            .chain(&self.others)
            .filter(|place| !holds(frame, place))
            .count();
        let heading = match beyond {
            0 => "Upper half of the plane of s".into(),
            n => format!("Upper half of the plane of s; {n} more beyond"),
        };
        self.marked(plane(&heading, frame), true, false)
    }

    /// The surroundings of the closest pair.
    fn close_modes(&self) -> Option<Chart> {
        let (low, high) = self.close_pair()?;
        let room = 0.7 * (high - low).max(1e-3 * high);
        let im = (low - room, high + room);
        let within = |place: &&Place| place.s.im >= im.0 && place.s.im <= im.1;
        let seen: Vec<&Place> = self
            .poles
            .iter()
            .chain(&self.zeros)
            .filter(within)
            .collect();
        let re = span(seen.iter().map(|place| place.s.re), 0.3);
        let hertz = 2.0 * std::f64::consts::PI;
        let heading = format!(
            "The closest modes, {:.2} and {:.2} Hz, enlarged",
            low / hertz,
            high / hertz
        );
        Some(self.marked(plane(&heading, (re, im)), false, true))
    }

    /// Poles, zeros with their ellipses, and the poles' intervals if wanted.
    fn marked(&self, mut chart: Chart, named: bool, intervals: bool) -> Chart {
        let name = |text: &'static str| if named { text } else { "" };
        for pole in self.poles.iter().filter(|_| intervals) {
            chart = crossed(chart, pole);
        }
        chart = chart.points(name("pole"), INK, Symbol::Cross, points(&self.poles));
        if !self.others.is_empty() {
            chart = chart.points(
                name("zero that is not judged"),
                GREY,
                Symbol::Ring,
                points(&self.others),
            );
        }
        for (right, text) in [(false, "zero left"), (true, "zero right of the axis")] {
            let side: Vec<Place> = self
                .zeros
                .iter()
                .filter(|zero| (zero.s.re > 0.0) == right)
                .copied()
                .collect();
            if side.is_empty() {
                continue;
            }
            chart = side.iter().fold(chart, |chart, zero| {
                ellipse(chart, "", zero, Complex::new(0.0, 0.0))
            });
            chart = chart.points(name(text), colour(&side[0]), Symbol::Ring, points(&side));
        }
        chart
    }

    /// Zeros whose ellipses can be drawn, nearest to the axis first.
    fn enlarged(&self) -> Vec<Chart> {
        let drawn = |zero: &&Place| {
            sigma(zero, 0) > 0.0 && Ellipse::of_95_percent(zero.covariance).is_some()
        };
        let mut zeros: Vec<&Place> = self.zeros.iter().filter(drawn).collect();
        zeros.sort_by(|a, b| {
            (a.s.re / sigma(a, 0))
                .abs()
                .total_cmp(&(b.s.re / sigma(b, 0)).abs())
        });
        zeros.into_iter().take(ENLARGED).map(zero_alone).collect()
    }
}

/// One zero: real and imaginary part less where it is, so that the numbers along the axes stay short.
fn zero_alone(zero: &Place) -> Chart {
    let half = |part: usize| SIGMAS_95_PLANE * sigma(zero, part);
    let (re, im) = (half(0), if half(1) > 0.0 { half(1) } else { half(0) });
    let axis = if zero.s.re.abs() <= AXIS_WITHIN * re {
        -zero.s.re
    } else {
        0.0
    };
    let free = ROOM * re;
    let x = ((-re).min(axis) - free, re.max(axis) + free);
    let less = |value: f64, half: f64| number::plain(value, number::decimals(half));
    let chart = Chart::new(
        &heading(zero),
        Scale::linear(&format!("Real part less {} (rad/s)", less(zero.s.re, re))).within(x.0, x.1),
        Scale::linear(&format!("Im. part less {} (rad/s)", less(zero.s.im, im)))
            .within(-(1.0 + ROOM) * im, (1.0 + ROOM) * im),
    );
    let chart = if axis == 0.0 {
        chart
    } else {
        upright(chart, "imaginary axis", axis)
    };
    ellipse(chart, "95 %", zero, zero.s).points("", colour(zero), Symbol::Dot, vec![(0.0, 0.0)])
}

fn heading(zero: &Place) -> String {
    let sigmas = (zero.s.re / sigma(zero, 0)).abs();
    let sigmas = if sigmas > 1000.0 {
        "over 1000".into()
    } else {
        format!("{sigmas:.1}")
    };
    let side = if zero.s.re > 0.0 { "right" } else { "left" };
    let hz = zero.s.norm() / (2.0 * std::f64::consts::PI);
    format!("Zero at {hz:.2} Hz, {sigmas} σ {side} of the axis")
}

/// A chart of the plane of s with its imaginary and real axis.
fn plane(heading: &str, (re, im): ((f64, f64), (f64, f64))) -> Chart {
    let chart = Chart::new(
        heading,
        Scale::linear("Real part of s (rad/s)").within(re.0, re.1),
        Scale::linear("Imaginary part of s (rad/s)").within(im.0, im.1),
    );
    upright(chart, "imaginary axis", 0.0)
}

fn upright(chart: Chart, name: &str, x: f64) -> Chart {
    chart.line(
        name,
        Pen {
            width: 1.1,
            ..Pen::solid(INK)
        },
        vec![(x, -FAR), (x, FAR)],
    )
}

/// The ellipse of a zero, less an origin.
fn ellipse(chart: Chart, name: &str, zero: &Place, origin: Complex<f64>) -> Chart {
    let Some(ellipse) = Ellipse::of_95_percent(zero.covariance) else {
        return chart;
    };
    let outline = ellipse.outline((zero.s.re - origin.re, zero.s.im - origin.im));
    let pen = Pen {
        width: 1.0,
        ..Pen::solid(colour(zero))
    };
    let area = super::Mark::Area {
        name: name.into(),
        colour: colour(zero),
        strength: 0.22,
        outline: outline.clone(),
    };
    chart.mark(area).line("", pen, outline)
}

/// The 95 % intervals of a pole's two parts.
fn crossed(chart: Chart, pole: &Place) -> Chart {
    let Complex { re, im } = pole.s;
    let half = |part: usize| SIGMAS_95 * sigma(pole, part);
    let pen = Pen {
        width: 0.9,
        ..Pen::solid(INK)
    };
    chart
        .line("", pen, vec![(re - half(0), im), (re + half(0), im)])
        .line("", pen, vec![(re, im - half(1)), (re, im + half(1))])
}

fn colour(zero: &Place) -> Colour {
    if zero.s.re > 0.0 { VERMILION } else { BLUE }
}

fn points(places: &[Place]) -> Vec<(f64, f64)> {
    places
        .iter()
        .map(|place| (place.s.re, place.s.im))
        .collect()
}

fn sigma(place: &Place, part: usize) -> f64 {
    place.covariance[part][part].sqrt()
}

fn holds((re, im): ((f64, f64), (f64, f64)), place: &Place) -> bool {
    let within = |value: f64, (low, high): (f64, f64)| value >= low && value <= high;
    within(place.s.re, re) && within(place.s.im, im)
}

/// From the least to the greatest, 0 among them, with a margin.
fn span(values: impl Iterator<Item = f64>, margin: f64) -> (f64, f64) {
    let (low, high) = values.fold((0.0, 0.0), |(low, high): (f64, f64), x| {
        (low.min(x), high.max(x))
    });
    let room = margin * (high - low).max(1e-3);
    (low - room, high + room)
}

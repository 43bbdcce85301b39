//! The map of poles and zeros: all of them, the two closest modes enlarged, and zeros enlarged until their confidence
//! regions are visible.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::chart::colours::{BLUE, Colour, GREY, INK, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use super::ellipse::{Ellipse, SIGMAS_95_PLANE};
use super::{ReportError, number};
use bench_identify::modal::SIGMAS_95;

/// Largest number of enlarged zeros: those nearest to the imaginary axis in sigmas.
const ENLARGED: usize = 3;
/// Ends of the line that marks the imaginary axis, beyond any frame, in rad/s.
const FAR: f64 = 1e9;
/// Part of the half-width of an enlarged ellipse left free beside it.
const MARGIN_RATIO: f64 = 0.45;
/// An enlarged zero is shown with the imaginary axis if its distance from it is at most this multiple of the ellipse's half-width.
const AXIS_WITHIN: f64 = 6.0;
/// Poles of a larger damping ratio do not widen the frame.
const OSCILLATING: f64 = 0.2;
/// Opacity of an ellipse.
const OPACITY: f64 = 0.22;

/// Ranges of real and imaginary part in rad/s.
type Window = ((f64, f64), (f64, f64));

/// A pole or zero with its covariance; of a conjugate pair the one above the real axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainPoint {
    /// Its place in rad/s.
    pub s: Complex<f64>,
    /// Covariance of real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
}

/// Poles and zeros of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoleZeroMap {
    /// All poles.
    pub poles: Vec<UncertainPoint>,
    /// Zeros that count for the verdict.
    pub zeros: Vec<UncertainPoint>,
    /// Other zeros.
    pub others: Vec<UncertainPoint>,
    /// Poles and zeros up to here count, in rad/s.
    pub up_to_rad_s: f64,
}

/// The map as an SVG document.
///
/// # Errors
/// When there is nothing to draw.
pub fn pole_zero_svg(
    map: &PoleZeroMap,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let mut upper = vec![map.whole()];
    upper.extend(map.close_modes());
    let rows = [Row::new(400.0, upper), Row::new(250.0, map.enlarged())];
    sheet_svg(title, subtitle, &rows)
}

impl UncertainPoint {
    fn sigma(&self, part: usize) -> f64 {
        self.covariance[part][part].sqrt()
    }

    /// Distance from the imaginary axis in sigmas.
    fn sigmas_from_axis(&self) -> f64 {
        (self.s.re / self.sigma(0)).abs()
    }

    fn is_within(&self, (re, im): Window) -> bool {
        (re.0..=re.1).contains(&self.s.re) && (im.0..=im.1).contains(&self.s.im)
    }

    fn is_oscillating(&self) -> bool {
        -self.s.re <= OSCILLATING * self.s.norm()
    }

    fn has_ellipse(&self) -> bool {
        self.sigma(0) > 0.0 && Ellipse::of_95_percent(self.covariance).is_some()
    }

    /// Half-widths of the 95 % ellipse in real and imaginary part; that of a real zero is a circle.
    fn half_widths(&self) -> (f64, f64) {
        let [re, im] = [0, 1].map(|part| SIGMAS_95_PLANE * self.sigma(part));
        (re, if im > 0.0 { im } else { re })
    }

    fn colour(&self) -> Colour {
        if self.s.re > 0.0 { VERMILION } else { BLUE }
    }
}

impl PoleZeroMap {
    /// The two neighbouring poles that are closest to each other for their frequency, among those that count: their
    /// imaginary parts in rad/s.
    pub fn close_pair(&self) -> Option<(f64, f64)> {
        let counted = self
            .poles
            .iter()
            .filter(|pole| pole.s.im > 0.0 && pole.s.norm() <= self.up_to_rad_s);
        let mut im: Vec<f64> = counted.map(|pole| pole.s.im).collect();
        im.sort_by(f64::total_cmp);
        let pairs = im.windows(2).map(|pair| (pair[0], pair[1]));
        pairs.min_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0)))
    }

    fn whole(&self) -> Chart {
        let oscillating = self.poles.iter().filter(|pole| pole.is_oscillating());
        let visible: Vec<_> = oscillating.chain(&self.zeros).collect();
        let highest = visible.iter().map(|point| point.s.im).fold(0.0, f64::max);
        let window = (span(&visible, 0.15), (0.0, 1.08 * highest.max(1.0)));
        let all = self.poles.iter().chain(&self.zeros).chain(&self.others);
        let heading = match all.filter(|point| !point.is_within(window)).count() {
            0 => "Upper half of the s-plane".into(),
            n => format!("Upper half of the s-plane; {n} more outside"),
        };
        self.with_points(plane(&heading, window), NAMES)
    }

    /// The surroundings of the closest pair, with the intervals of the poles.
    fn close_modes(&self) -> Option<Chart> {
        let (low, high) = self.close_pair()?;
        let room = 0.7 * (high - low).max(1e-3 * high);
        let im = (low - room, high + room);
        let all = self.poles.iter().chain(&self.zeros);
        let visible: Vec<_> = all
            .filter(|point| (im.0..=im.1).contains(&point.s.im))
            .collect();
        let [low_hz, high_hz] = [low / TAU, high / TAU];
        let heading = format!("The closest modes, {low_hz:.2} and {high_hz:.2} Hz, enlarged");
        let chart = plane(&heading, (span(&visible, 0.3), im));
        let chart = self.poles.iter().fold(chart, with_intervals);
        Some(self.with_points(chart, Names::default()))
    }

    /// Poles, and zeros with their ellipses.
    fn with_points(&self, chart: Chart, names: Names) -> Chart {
        let mut chart = chart.points(names.pole, INK, Symbol::Cross, places(&self.poles));
        if !self.others.is_empty() {
            chart = chart.points(names.other, GREY, Symbol::Ring, places(&self.others));
        }
        let (right, left): (Vec<UncertainPoint>, _) =
            self.zeros.iter().partition(|zero| zero.s.re > 0.0);
        chart = with_zeros(chart, names.left, &left);
        with_zeros(chart, names.right, &right)
    }

    /// Zeros that have an ellipse, nearest to the axis first.
    fn enlarged(&self) -> Vec<Chart> {
        let with_ellipse = self.zeros.iter().filter(|zero| zero.has_ellipse());
        let mut zeros: Vec<&UncertainPoint> = with_ellipse.collect();
        zeros.sort_by(|a, b| a.sigmas_from_axis().total_cmp(&b.sigmas_from_axis()));
        zeros.truncate(ENLARGED);
        zeros.into_iter().map(enlarged_zero).collect()
    }
}

/// Names in the legend; empty names have no entry.
#[derive(Clone, Copy, Default)]
struct Names {
    pole: &'static str,
    other: &'static str,
    left: &'static str,
    right: &'static str,
}

const NAMES: Names = Names {
    pole: "pole",
    other: "zero, not part of the verdict",
    left: "zero left of the axis",
    right: "zero right of the axis",
};

fn with_zeros(mut chart: Chart, name: &str, zeros: &[UncertainPoint]) -> Chart {
    let Some(first) = zeros.first() else {
        return chart;
    };
    for zero in zeros {
        chart = with_ellipse(chart, "", zero, Complex::new(0.0, 0.0));
    }
    chart.points(name, first.colour(), Symbol::Ring, places(zeros))
}

/// One zero. The axes show real and imaginary part minus the zero itself, so that their numbers stay short.
fn enlarged_zero(zero: &UncertainPoint) -> Chart {
    let (re, im) = zero.half_widths();
    let with_axis = zero.s.re.abs() <= AXIS_WITHIN * re;
    let axis = if with_axis { -zero.s.re } else { 0.0 };
    let x = (
        (-re).min(axis) - MARGIN_RATIO * re,
        re.max(axis) + MARGIN_RATIO * re,
    );
    let y = ((1.0 + MARGIN_RATIO) * -im, (1.0 + MARGIN_RATIO) * im);
    let mut chart = Chart::new(
        &enlarged_heading(zero),
        offset_scale("Real", zero.s.re, re, x),
        offset_scale("Im.", zero.s.im, im, y),
    );
    if with_axis {
        chart = with_vertical(chart, "imaginary axis", axis);
    }
    chart = with_ellipse(chart, "95 %", zero, zero.s);
    chart.points("", zero.colour(), Symbol::Dot, vec![(0.0, 0.0)])
}

fn offset_scale(part: &str, value: f64, half: f64, range: (f64, f64)) -> Scale {
    let value = number::plain(value, number::decimals(half));
    Scale::linear(&format!("{part} part − ({value}) (rad/s)")).within(range.0, range.1)
}

fn enlarged_heading(zero: &UncertainPoint) -> String {
    let sigmas = match zero.sigmas_from_axis() {
        s if s > 1000.0 => "over 1000".into(),
        s => format!("{s:.1}"),
    };
    let side = if zero.s.re > 0.0 { "right" } else { "left" };
    let hz = zero.s.norm() / TAU;
    format!("Zero at {hz:.2} Hz, {sigmas} σ {side} of the axis")
}

/// A chart of the s-plane with its imaginary axis.
fn plane(heading: &str, (re, im): Window) -> Chart {
    let x = Scale::linear("Real part of s (rad/s)").within(re.0, re.1);
    let y = Scale::linear("Imaginary part of s (rad/s)").within(im.0, im.1);
    with_vertical(Chart::new(heading, x, y), "imaginary axis", 0.0)
}

fn with_vertical(chart: Chart, name: &str, x: f64) -> Chart {
    chart.line(name, Pen::solid(INK).width(1.1), vec![(x, -FAR), (x, FAR)])
}

/// The ellipse of a zero, relative to an origin.
fn with_ellipse(chart: Chart, name: &str, zero: &UncertainPoint, origin: Complex<f64>) -> Chart {
    let Some(ellipse) = Ellipse::of_95_percent(zero.covariance) else {
        return chart;
    };
    let centre = zero.s - origin;
    let outline = ellipse.outline((centre.re, centre.im));
    let pen = Pen::solid(zero.colour()).width(1.0);
    chart
        .area(name, zero.colour(), OPACITY, outline.clone())
        .line("", pen, outline)
}

/// The 95 % intervals of both parts of a pole.
fn with_intervals(chart: Chart, pole: &UncertainPoint) -> Chart {
    let Complex { re, im } = pole.s;
    let (half_re, half_im) = (SIGMAS_95 * pole.sigma(0), SIGMAS_95 * pole.sigma(1));
    let pen = Pen::solid(INK).width(0.9);
    chart
        .line("", pen, vec![(re - half_re, im), (re + half_re, im)])
        .line("", pen, vec![(re, im - half_im), (re, im + half_im)])
}

fn places(points: &[UncertainPoint]) -> Vec<(f64, f64)> {
    points
        .iter()
        .map(|point| (point.s.re, point.s.im))
        .collect()
}

/// The range of the real parts, 0 included, with a margin.
fn span(points: &[&UncertainPoint], margin: f64) -> (f64, f64) {
    let re = points.iter().map(|point| point.s.re);
    let (low, high) = re.fold((0.0, 0.0), |(low, high): (f64, f64), x| {
        (low.min(x), high.max(x))
    });
    let room = margin * (high - low).max(1e-3);
    (low - room, high + room)
}

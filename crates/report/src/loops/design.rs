//! Plots of a designed loop: L, S and K S over frequency, and the Nyquist plot with the disc that L must not enter.

use nalgebra::Complex;

use super::plane::{CRITICAL, circle, plane, with_critical_point, with_unit_circle};
use crate::ReportError;
use crate::chart::colours::{BLUE, INK, SKY, VERMILION};
use crate::chart::{Chart, Pen, Row, Scale, sheet_svg};
use bench_base::units::{UM_PER_M, hz};
use bench_control::tuning::{Goal, LoopCurve, Requirements};

/// Heights of the charts of L, S and K S in pixels.
const HEIGHTS: [f64; 3] = [230.0, 260.0, 230.0];
/// Height of the Nyquist plot in pixels, and the values that it shows.
const NYQUIST_HEIGHT: f64 = 560.0;
const NYQUIST_RANGE: (f64, f64) = (-3.0, 2.0);
/// Part of half the sampling rate that is shown: at its end C has zeros by Tustin's rule, and |L| falls by many decades.
const SHOWN: f64 = 0.9;
/// Opacity of the disc around -1.
const OPACITY: f64 = 0.2;

/// Limits that the plots show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignLimits {
    /// Least modulus margin.
    pub modulus_margin: f64,
    /// The slope bandwidth in rad/s that |S| attains, of a design for it.
    pub slope_bandwidth_rad_s: Option<f64>,
    /// The largest |K S| in A/m.
    pub control_sensitivity_a_per_m: Option<f64>,
}

impl DesignLimits {
    /// The limits of a design, and the attained value of its goal.
    pub fn of(requirements: &Requirements, attained: f64) -> DesignLimits {
        let is_slope = requirements.goal == Goal::Disturbance;
        DesignLimits {
            modulus_margin: requirements.modulus_margin,
            slope_bandwidth_rad_s: is_slope.then_some(attained),
            control_sensitivity_a_per_m: requirements.max_control_sensitivity_a_per_m,
        }
    }
}

/// |L|, |S| and |K S| of the loop with each plant, with the limits.
///
/// # Errors
/// When there is no loop.
pub fn design_loop_svg(
    curves: &[LoopCurve],
    limits: DesignLimits,
    title: &str,
) -> Result<String, ReportError> {
    let first = curves.first().ok_or(ReportError::NoTrace)?;
    let ends = (first.omega_rad_s.first(), first.omega_rad_s.last());
    let (Some(low), Some(high)) = ends else {
        return Err(ReportError::NoTrace);
    };
    let x = Scale::frequency((hz(*low), hz(*high)));
    let charts = [
        magnitudes("|L|", "loop", curves, |l, _| l.norm()),
        sensitivity_chart(curves, limits),
        control_chart(curves, limits),
    ];
    let mut rows: Vec<Row> = Vec::new();
    for (index, (chart, height)) in charts.into_iter().zip(HEIGHTS).enumerate() {
        let x = match index {
            2 => x.clone(),
            _ => x.clone().unnumbered(),
        };
        rows.push(Row::new(height, vec![Chart { x, ..chart }]));
    }
    sheet_svg(title, "each line is the loop with one plant", &rows)
}

fn sensitivity_chart(curves: &[LoopCurve], limits: DesignLimits) -> Chart {
    let chart = magnitudes("|S|", "sensitivity", curves, |l, _| (l + 1.0).inv().norm());
    let limit = 1.0 / limits.modulus_margin;
    let chart = chart.line("1/modulus margin", LIMIT, constant(curves, limit));
    match limits.slope_bandwidth_rad_s {
        Some(slope_rad_s) => chart.line("slope of the goal", GOAL, slope(curves, slope_rad_s)),
        None => chart,
    }
}

fn control_chart(curves: &[LoopCurve], limits: DesignLimits) -> Chart {
    let chart = magnitudes("|KS| (A/µm)", "control", curves, |l, c| {
        (c / (l + 1.0)).norm() / UM_PER_M
    });
    match limits.control_sensitivity_a_per_m {
        Some(limit) => chart.line("limit", LIMIT, constant(curves, limit / UM_PER_M)),
        None => chart,
    }
}

const LIMIT: Pen = Pen::dashed(VERMILION);
const GOAL: Pen = Pen::dashed(INK);

/// A magnitude of each loop over frequency.
fn magnitudes(
    label: &str,
    name: &str,
    curves: &[LoopCurve],
    magnitude: impl Fn(Complex<f64>, Complex<f64>) -> f64,
) -> Chart {
    let chart = Chart::new("", Scale::logarithmic(""), Scale::logarithmic(label));
    curves.iter().enumerate().fold(chart, |chart, (k, curve)| {
        let [_, last] = ends(curves);
        let shown = curve.omega_rad_s.iter().take_while(|w| **w <= SHOWN * last);
        let points = shown.enumerate();
        let points = points.map(|(i, w)| {
            let value = magnitude(curve.open_loop[i], curve.controller[i]);
            (hz(*w), value)
        });
        chart.line(once(name, k), pen(k), points.collect())
    })
}

/// The name for the legend: only the first line of a kind has one.
fn once(name: &str, index: usize) -> &str {
    if index == 0 { name } else { "" }
}

fn pen(index: usize) -> Pen {
    match index {
        0 => Pen::solid(BLUE).thin(),
        _ => Pen::solid(SKY).thin(),
    }
}

fn constant(curves: &[LoopCurve], value: f64) -> Vec<(f64, f64)> {
    ends(curves).map(|w| (hz(w), value)).to_vec()
}

/// w/(sqrt(2) ws) up to ws.
fn slope(curves: &[LoopCurve], slope_rad_s: f64) -> Vec<(f64, f64)> {
    let [low, _] = ends(curves);
    let bound = |w: f64| w / (std::f64::consts::SQRT_2 * slope_rad_s);
    [low, slope_rad_s].map(|w| (hz(w), bound(w))).to_vec()
}

/// The lowest and the highest frequency of the first curve in rad/s.
fn ends(curves: &[LoopCurve]) -> [f64; 2] {
    let grid = curves.first().map_or(&[][..], |curve| &curve.omega_rad_s);
    [grid.first(), grid.last()].map(|w| w.copied().unwrap_or(1.0))
}

/// The Nyquist plot of the loop with each plant, with the disc around -1 whose radius is the modulus margin.
///
/// # Errors
/// When there is no loop.
pub fn design_nyquist_svg(
    curves: &[LoopCurve],
    limits: DesignLimits,
    title: &str,
) -> Result<String, ReportError> {
    if curves.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let disc = circle(CRITICAL, limits.modulus_margin);
    let chart = plane("", NYQUIST_RANGE, NYQUIST_RANGE);
    let chart = with_unit_circle(chart.area("modulus margin", VERMILION, OPACITY, disc), "");
    let chart = curves.iter().enumerate().fold(chart, |chart, (k, curve)| {
        let points = curve.open_loop.iter().map(|l| visible((l.re, l.im)));
        chart.line(once("loop", k), pen(k), points.collect())
    });
    let chart = with_critical_point(chart);
    let subtitle =
        "each line is the loop with one plant, from low frequency to half the sampling rate";
    sheet_svg(title, subtitle, &[Row::new(NYQUIST_HEIGHT, vec![chart])])
}

/// A point near the plot; points far away leave a gap.
fn visible((x, y): (f64, f64)) -> (f64, f64) {
    const FAR: f64 = 50.0;
    if x.abs() < FAR && y.abs() < FAR {
        (x, y)
    } else {
        (f64::NAN, f64::NAN)
    }
}

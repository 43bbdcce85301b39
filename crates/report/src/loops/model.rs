//! A control loop by its model: Bode plot and Nyquist plot of L with its margins, and S and T with their limits.

use nalgebra::Complex;

use super::plane::{CRITICAL, circle, level, plane, with_critical_point, with_unit_circle};
use crate::ReportError;
use crate::chart::colours::{BLUE, GREEN, GREY, ORANGE, VERMILION};
use crate::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use crate::labels::frequency_text;
use crate::trace::{self, Line, Trace};
use bench_base::units::hz;
use bench_control::{Crossing, Margins};
use bench_experiment::LoopModel;

/// Heights of the frames in pixels.
const MAGNITUDE_HEIGHT: f64 = 300.0;
const PHASE_HEIGHT: f64 = 243.0;
const NYQUIST_HEIGHT: f64 = 400.0;
const SENSITIVITY_HEIGHT: f64 = 360.0;
/// The magnitude of L is drawn from here to the inverse.
const LEAST_MAGNITUDE: f64 = 1e-3;
/// Part of an axis left free above and below the curves.
const MARGIN: f64 = 0.06;
/// Half the width of the Nyquist plot around -1, and its middle.
const NEAR: f64 = 2.0;
const NEAR_MIDDLE: f64 = -0.5;
/// Limits of half the width of the larger Nyquist plot.
const FAR: (f64, f64) = (4.0, 40.0);

/// A loop and its margins.
#[derive(Clone, Copy, Debug)]
pub struct LoopPlot<'a> {
    /// Frequencies in hertz, rising.
    pub frequency_hz: &'a [f64],
    /// L = P C at these frequencies.
    pub loop_gain: &'a [Complex<f64>],
    /// Its margins; those of an unstable loop are not drawn.
    pub margins: &'a Margins,
    /// Least allowed modulus margin; 0 for none.
    pub min_modulus_margin: f64,
}

impl<'a> From<&'a LoopModel> for LoopPlot<'a> {
    fn from(model: &'a LoopModel) -> LoopPlot<'a> {
        LoopPlot {
            frequency_hz: &model.frequency_hz,
            loop_gain: &model.loop_gain,
            margins: &model.margins,
            min_modulus_margin: model.min_modulus_margin,
        }
    }
}

/// A place of the loop that a margin marks.
struct MarkedPlace {
    frequency_hz: f64,
    loop_gain: Complex<f64>,
    text: String,
}

impl LoopPlot<'_> {
    /// The crossing of |L| = 1 with the smallest phase margin, in a stable loop.
    fn phase_margin(&self) -> Option<MarkedPlace> {
        let crossings = self
            .margins
            .crossings
            .iter()
            .filter(|_| self.margins.stable);
        let size = |crossing: &Crossing| crossing.phase_margin_deg.abs();
        let crossing = crossings.min_by(|a, b| size(a).total_cmp(&size(b)))?;
        let (frequency_hz, margin_deg) = (hz(crossing.rad_s), crossing.phase_margin_deg);
        let (sine, cosine) = libm::sincos(margin_deg.to_radians());
        Some(MarkedPlace {
            frequency_hz,
            loop_gain: -Complex::new(cosine, sine),
            text: format!(
                "phase margin {margin_deg:.1}° at {}",
                frequency_text(frequency_hz)
            ),
        })
    }

    /// The crossing of the negative real axis with the smallest gain margin, in a stable loop.
    fn gain_margin(&self) -> Option<MarkedPlace> {
        let margins = Some(self.margins).filter(|margins| margins.stable)?;
        let (margin_db, rad_s) = (margins.gain_margin_db?, margins.gain_margin_rad_s?);
        let frequency_hz = hz(rad_s);
        Some(MarkedPlace {
            frequency_hz,
            loop_gain: Complex::new(-libm::pow(10.0, -margin_db / 20.0), 0.0),
            text: format!(
                "gain margin {margin_db:.1} dB at {}",
                frequency_text(frequency_hz)
            ),
        })
    }

    /// Frequency in hertz and value of the peak of S, in a stable loop.
    fn sensitivity_peak(&self) -> Option<(f64, f64)> {
        let margins = Some(self.margins).filter(|margins| margins.stable)?;
        let frequency_hz = hz(margins.sensitivity_peak_rad_s);
        (frequency_hz > 0.0).then(|| (frequency_hz, 1.0 / margins.modulus_margin))
    }

    fn frequencies(&self) -> Scale {
        let ends = self.frequency_hz.first().zip(self.frequency_hz.last());
        let (low_hz, high_hz) = ends.map_or((1.0, 1.0), |(low, high)| (*low, *high));
        Scale::frequency((low_hz, high_hz))
    }

    /// A horizontal line over all frequencies.
    fn level(&self, value: f64) -> Vec<(f64, f64)> {
        level(self.frequency_hz, value)
    }
}

/// The Bode plot of L, with phase margin and gain margin, as an SVG document.
///
/// # Errors
/// When there is nothing to draw, or a value is not finite.
pub fn loop_bode_svg(
    plot: &LoopPlot<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    sheet_svg(title, subtitle, &bode_rows(plot)?)
}

fn bode_rows(plot: &LoopPlot<'_>) -> Result<[Row; 2], ReportError> {
    let traces = [Trace::model("L", plot.frequency_hz, plot.loop_gain)];
    let lines = trace::lines(&traces)?;
    let [line] = &lines[..] else {
        return Err(ReportError::NoTrace);
    };
    Ok([
        Row::new(MAGNITUDE_HEIGHT, vec![magnitude(plot, line)]),
        Row::new(PHASE_HEIGHT, vec![phase(plot, line)]),
    ])
}

/// Bode plot, Nyquist plot and sensitivities of a loop below each other, as an SVG document.
///
/// # Errors
/// When there is nothing to draw, or a value is not finite.
pub fn loop_svg(plot: &LoopPlot<'_>, title: &str, subtitle: &str) -> Result<String, ReportError> {
    let mut rows = bode_rows(plot)?.to_vec();
    rows.push(nyquist_row(plot));
    rows.push(Row::new(SENSITIVITY_HEIGHT, vec![sensitivities(plot)]));
    sheet_svg(title, subtitle, &rows)
}

fn magnitude(plot: &LoopPlot<'_>, line: &Line<'_>) -> Chart {
    let points = line
        .frequency_hz
        .iter()
        .copied()
        .zip(line.magnitude.iter().copied());
    let y = Scale::logarithmic("Magnitude").within(LEAST_MAGNITUDE, 1.0 / LEAST_MAGNITUDE);
    let mut chart = Chart::new("", plot.frequencies().unnumbered(), y)
        .line("", Pen::solid(GREY).thin(), plot.level(1.0))
        .line("L", Pen::solid(BLUE), points.collect());
    if let Some(place) = plot.phase_margin() {
        let dot = vec![(place.frequency_hz, 1.0)];
        chart = chart.points("|L| = 1", VERMILION, Symbol::Dot, dot);
    }
    if let Some(place) = plot.gain_margin() {
        let (frequency_hz, size) = (place.frequency_hz, place.loop_gain.norm());
        let distance = vec![(frequency_hz, size), (frequency_hz, 1.0)];
        chart = chart
            .line(&place.text, Pen::solid(ORANGE), distance)
            .points("", ORANGE, Symbol::Dot, vec![(frequency_hz, size)]);
    }
    chart
}

fn phase(plot: &LoopPlot<'_>, line: &Line<'_>) -> Chart {
    let points: Vec<(f64, f64)> = line
        .frequency_hz
        .iter()
        .copied()
        .zip(line.phase_deg.iter().copied())
        .collect();
    let (low, high) = phase_range(&line.phase_deg);
    let y = Scale::degrees("Phase (deg)").within(low, high);
    let mut chart = Chart::new("", plot.frequencies(), y);
    for limit_deg in critical_phases_deg(low, high) {
        chart = chart.line("", Pen::solid(GREY).thin(), plot.level(limit_deg));
    }
    chart = chart.line("", Pen::solid(BLUE), points.clone());
    if let Some(place) = plot.phase_margin() {
        let phase_deg = value_at(&points, place.frequency_hz);
        let limit_deg = nearest_critical_deg(phase_deg);
        let distance = vec![
            (place.frequency_hz, phase_deg),
            (place.frequency_hz, limit_deg),
        ];
        chart = chart
            .line(&place.text, Pen::solid(VERMILION), distance)
            .points(
                "",
                VERMILION,
                Symbol::Dot,
                vec![(place.frequency_hz, phase_deg)],
            );
    }
    if let Some(place) = plot.gain_margin() {
        let phase_deg = value_at(&points, place.frequency_hz);
        chart = chart.points(
            "",
            ORANGE,
            Symbol::Dot,
            vec![(place.frequency_hz, phase_deg)],
        );
    }
    chart
}

/// The range of some phases with a margin: at least from -180 to 0 degrees.
fn phase_range(phases_deg: &[f64]) -> (f64, f64) {
    let (low, high) = phases_deg
        .iter()
        .fold((-180.0_f64, 0.0_f64), |(low, high), phase| {
            (low.min(*phase), high.max(*phase))
        });
    let room = MARGIN * (high - low);
    (low - room, high + room)
}

/// -180 degrees and its whole turns within a range.
fn critical_phases_deg(low: f64, high: f64) -> impl Iterator<Item = f64> {
    let first = libm::ceil((low - 180.0) / 360.0);
    let places = (0..).map(move |k| 180.0 + 360.0 * (first + f64::from(k)));
    places.take_while(move |phase| *phase <= high)
}

/// The phase of the negative real axis that is nearest to a phase.
fn nearest_critical_deg(phase_deg: f64) -> f64 {
    180.0 + 360.0 * libm::round((phase_deg - 180.0) / 360.0)
}

/// The value at a place between the points of a curve, by linear interpolation.
fn value_at(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.partition_point(|point| point.0 < x);
    match (
        after.checked_sub(1).and_then(|k| points.get(k)),
        points.get(after),
    ) {
        (Some(a), Some(b)) => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(point), None) | (None, Some(point)) => point.1,
        (None, None) => f64::NAN,
    }
}

/// The Nyquist plot of L with -1, as an SVG document: around -1, and at a smaller scale.
///
/// # Errors
/// When there is nothing to draw.
pub fn loop_nyquist_svg(
    plot: &LoopPlot<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if plot.loop_gain.is_empty() {
        return Err(ReportError::NoTrace);
    }
    sheet_svg(title, subtitle, &[nyquist_row(plot)])
}

fn nyquist_row(plot: &LoopPlot<'_>) -> Row {
    let far = far_half_width(plot);
    let charts = vec![
        nyquist(plot, "Around -1", NEAR_MIDDLE, NEAR),
        nyquist(plot, "Resonances", 0.0, far).without_legend(),
    ];
    Row::new(NYQUIST_HEIGHT, charts)
}

/// Half the width that shows the largest |L| beyond the crossover.
fn far_half_width(plot: &LoopPlot<'_>) -> f64 {
    let crossover_hz = plot.margins.crossover_rad_s.map_or(0.0, hz);
    let points = plot.frequency_hz.iter().zip(plot.loop_gain);
    let beyond = points.filter(|(frequency_hz, _)| **frequency_hz >= crossover_hz);
    let largest = beyond.map(|(_, l)| l.norm()).fold(0.0, f64::max);
    (1.2 * largest).clamp(FAR.0, FAR.1)
}

fn nyquist(plot: &LoopPlot<'_>, heading: &str, middle: f64, half: f64) -> Chart {
    let real = (middle - half, middle + half);
    let curve = plot.loop_gain.iter().map(|l| (l.re, l.im)).collect();
    let mut chart = with_unit_circle(plane(heading, real, (-half, half)), "|L| = 1");
    if plot.min_modulus_margin > 0.0 {
        let circle = circle(CRITICAL, plot.min_modulus_margin);
        let name = format!("least modulus margin {}", plot.min_modulus_margin);
        chart = chart.area(&name, ORANGE, 0.25, circle);
    }
    if let Some((frequency_hz, peak)) = plot.sensitivity_peak() {
        let margin = 1.0 / peak;
        let name = format!(
            "modulus margin {margin:.3} at {}",
            frequency_text(frequency_hz)
        );
        let circle = circle(CRITICAL, margin);
        chart = chart.line(&name, Pen::dashed(GREEN), circle);
    }
    chart = chart.directed("L, rising frequency", Pen::solid(BLUE), curve);
    for (place, colour) in [
        (plot.phase_margin(), VERMILION),
        (plot.gain_margin(), ORANGE),
    ] {
        if let Some(place) = place {
            let at = (place.loop_gain.re, place.loop_gain.im);
            chart = chart.points(&place.text, colour, Symbol::Dot, vec![at]);
        }
    }
    with_critical_point(chart)
}

/// |S| and |T| with the limit of |S|, as an SVG document.
///
/// # Errors
/// When there is nothing to draw.
pub fn sensitivity_svg(
    plot: &LoopPlot<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if plot.loop_gain.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let chart = sensitivities(plot);
    sheet_svg(
        title,
        subtitle,
        &[Row::new(SENSITIVITY_HEIGHT, vec![chart])],
    )
}

fn sensitivities(plot: &LoopPlot<'_>) -> Chart {
    let curve = |value: fn(Complex<f64>) -> f64| -> Vec<(f64, f64)> {
        let points = plot.frequency_hz.iter().copied().zip(plot.loop_gain);
        points
            .map(|(frequency_hz, l)| (frequency_hz, value(*l)))
            .collect()
    };
    let y = Scale::logarithmic("Magnitude").within(LEAST_MAGNITUDE, 10.0);
    let mut chart = Chart::new("", plot.frequencies(), y)
        .line("", Pen::solid(GREY).thin(), plot.level(1.0))
        .line("|S|", Pen::solid(BLUE), curve(|l| (l + 1.0).inv().norm()))
        .line("|T|", Pen::solid(ORANGE), curve(|l| (l / (l + 1.0)).norm()));
    if plot.min_modulus_margin > 0.0 {
        let limit = 1.0 / plot.min_modulus_margin;
        let name = format!("limit of |S|: 1/{}", plot.min_modulus_margin);
        chart = chart.line(&name, Pen::dashed(VERMILION), plot.level(limit));
    }
    if let Some((frequency_hz, peak)) = plot.sensitivity_peak() {
        let name = format!("peak of |S| {peak:.2} at {}", frequency_text(frequency_hz));
        chart = chart.points(&name, VERMILION, Symbol::Dot, vec![(frequency_hz, peak)]);
    }
    let bandwidth_rad_s = plot.margins.sensitivity_bandwidth_rad_s;
    if let Some(bandwidth_rad_s) = bandwidth_rad_s.filter(|_| plot.margins.stable) {
        let bandwidth_hz = hz(bandwidth_rad_s);
        let name = format!("|S| = 0.707 at {}", frequency_text(bandwidth_hz));
        let dot = vec![(bandwidth_hz, std::f64::consts::FRAC_1_SQRT_2)];
        chart = chart.points(&name, GREEN, Symbol::Ring, dot);
    }
    chart
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn critical_phases_are_odd_multiples_of_180_degrees() {
        let found: Vec<f64> = critical_phases_deg(-600.0, 200.0).collect();
        assert_eq!(found, [-540.0, -180.0, 180.0]);
        assert_eq!(critical_phases_deg(-170.0, 100.0).count(), 0);
        for (phase_deg, nearest) in [
            (-146.0, -180.0),
            (-200.0, -180.0),
            (-500.0, -540.0),
            (10.0, 180.0),
        ] {
            assert_eq!(nearest_critical_deg(phase_deg), nearest, "{phase_deg}");
        }
    }

    #[test]
    fn interpolates_between_the_points_of_a_curve() {
        let points = [(1.0, 10.0), (3.0, 20.0)];
        for (x, y) in [(0.5, 10.0), (1.0, 10.0), (2.0, 15.0), (4.0, 20.0)] {
            assert_eq!(value_at(&points, x), y);
        }
        assert!(value_at(&[], 1.0).is_nan());
    }
}

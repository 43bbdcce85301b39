//! A measured response in the plane, and its coherence.

use nalgebra::Complex;

use super::chart::{Chart, Mark, Pen, Scale, Symbol};
use super::colours::{BLUE, INK, VERMILION};
use super::ellipse::SIGMAS_95_PLANE;
use super::sheet::{Row, sheet_svg};
use super::trace::gap;
use super::{Curve, ReportError, Trace};
use crate::identify::{Frf, Unit};

/// Magnitudes below so many sigmas are left out of a Nyquist plot: their direction is not known.
const KNOWN: f64 = 2.0;
/// Circles of confidence drawn at most.
const CIRCLES: usize = 90;
/// Circles smaller than this part of the picture are not seen and not drawn.
const SEEN: f64 = 0.004;
/// Metres to micrometres.
const MICRO: f64 = 1e6;

/// The Nyquist plot as an SVG document: the whole response in um/A, or as it is in another unit, and beside it a part of the
/// frequencies, with circles that hold the truth with 95 %.
///
/// # Errors
/// When there is nothing measured, or a trace is not sound: see [`ReportError`].
pub fn nyquist_svg(
    unit: Unit,
    traces: &[Trace],
    part_hz: Option<(f64, f64)>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    super::trace::lines(traces)?;
    let all = (0.0, f64::INFINITY);
    let whole = nyquist(unit, "All frequencies", traces, all);
    let heading = |(low, high): (f64, f64)| format!("{low:.1} to {high:.1} Hz");
    let part = part_hz.map(|part| nyquist(unit, &heading(part), traces, part));
    sheet_svg(
        title,
        subtitle,
        &[Row::new(
            400.0,
            std::iter::once(whole).chain(part).collect(),
        )],
    )
}

fn nyquist(unit: Unit, heading: &str, traces: &[Trace], band_hz: (f64, f64)) -> Chart {
    let (name, factor) = match unit {
        Unit::MetresPerAmpere => (" (um/A)", MICRO),
        Unit::Bare => ("", 1.0),
    };
    let scale = |part: &str| Scale::linear(&format!("{part} part of H{name}"));
    let mut chart = Chart::new(heading, scale("Real"), scale("Imaginary")).equal();
    let mut pens = [Pen::dashed(VERMILION), Pen::dotted(INK)]
        .into_iter()
        .cycle();
    for trace in traces {
        chart = match trace.curve {
            Curve::Measured(frf) => measured(chart, trace.name, frf, band_hz, factor),
            Curve::Model {
                frequency_hz,
                response,
            } => {
                let pen = pens.next().unwrap_or(Pen::dashed(VERMILION));
                let within = frequency_hz
                    .iter()
                    .zip(response)
                    .filter(|(f, _)| **f >= band_hz.0 && **f <= band_hz.1);
                chart.line(
                    trace.name,
                    pen,
                    within.map(|(_, h)| point(&(h * factor))).collect(),
                )
            }
        };
    }
    chart.points("origin", INK, Symbol::Cross, vec![(0.0, 0.0)])
}

fn measured(chart: Chart, name: &str, frf: &Frf, (low, high): (f64, f64), factor: f64) -> Chart {
    let within = |k: &usize| frf.frequency_hz[*k] >= low && frf.frequency_hz[*k] <= high;
    let shown: Vec<usize> = (0..frf.len()).filter(within).collect();
    let largest = shown
        .iter()
        .map(|k| frf.response[*k].norm())
        .fold(0.0, f64::max);
    let mut chart = chart;
    let mut circle_name = "95 % circles";
    let mut drawn: Vec<Complex<f64>> = Vec::new();
    for k in shown.iter().step_by(shown.len().div_ceil(CIRCLES).max(1)) {
        let radius = SIGMAS_95_PLANE * frf.magnitude_sigma[*k];
        // Many upon each other would hide what lies below them.
        let free = drawn
            .iter()
            .all(|other| (frf.response[*k] - other).norm() >= radius);
        if radius > SEEN * largest && known(frf, *k) && free {
            drawn.push(frf.response[*k]);
            let outline = circle(point(&(frf.response[*k] * factor)), factor * radius);
            chart = chart.mark(Mark::Area {
                name: circle_name.into(),
                colour: BLUE,
                strength: 0.13,
                outline,
            });
            circle_name = "";
        }
    }
    chart.line(name, Pen::solid(BLUE), line(frf, &shown, factor))
}

/// The points with gaps where frequencies, or magnitudes that can be told from noise, are missing.
fn line(frf: &Frf, shown: &[usize], factor: f64) -> Vec<(f64, f64)> {
    let nothing = (f64::NAN, f64::NAN);
    let of = |k: &usize| {
        let before = (*k > 0 && gap(frf, *k)).then_some(nothing);
        before.into_iter().chain([if known(frf, *k) {
            point(&(frf.response[*k] * factor))
        } else {
            nothing
        }])
    };
    shown.iter().flat_map(of).collect()
}

fn known(frf: &Frf, k: usize) -> bool {
    frf.response[k].norm() > KNOWN * frf.magnitude_sigma[k]
}

fn point(h: &Complex<f64>) -> (f64, f64) {
    (h.re, h.im)
}

fn circle((x, y): (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let at = |k: i32| 2.0 * std::f64::consts::PI * f64::from(k) / 24.0;
    (0..24)
        .map(|k| (x + radius * libm::cos(at(k)), y + radius * libm::sin(at(k))))
        .collect()
}

/// The coherence over frequency as an SVG document, and below it what is missing to 1 on a logarithmic axis.
///
/// # Errors
/// When there is no frequency.
pub fn coherence_svg(frf: &Frf, title: &str, subtitle: &str) -> Result<String, ReportError> {
    super::trace::lines(&[Trace {
        name: "coherence",
        curve: Curve::Measured(frf),
    }])?;
    let ends = frf
        .frequency_hz
        .first()
        .zip(frf.frequency_hz.last())
        .filter(|(first, last)| first < last);
    let frequency = || Scale {
        range: ends.map(|(first, last)| (*first, *last)),
        ..Scale::logarithmic("Frequency (Hz)")
    };
    let series = |of: fn(f64) -> f64| {
        let point = |k: usize| (frf.frequency_hz[k], of(frf.coherence[k]));
        let gapped = |k: usize| {
            (k > 0 && gap(frf, k))
                .then_some((f64::NAN, f64::NAN))
                .into_iter()
                .chain([point(k)])
        };
        (0..frf.len()).flat_map(gapped).collect::<Vec<_>>()
    };
    let whole = Chart::new(
        "",
        frequency(),
        Scale::linear("Coherence (ratio)").within(0.0, 1.05),
    )
    .line(
        "",
        Pen {
            width: 1.2,
            ..Pen::solid(BLUE)
        },
        series(|c| c),
    );
    let rest = Chart::new(
        "What the input does not explain",
        frequency(),
        Scale::logarithmic("1 less coherence (ratio)"),
    )
    .line(
        "",
        Pen {
            width: 1.2,
            ..Pen::solid(BLUE)
        },
        series(|c| 1.0 - c),
    );
    sheet_svg(
        title,
        subtitle,
        &[Row::new(250.0, vec![whole]), Row::new(250.0, vec![rest])],
    )
}

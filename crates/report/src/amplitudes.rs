//! Modes, noise and distortion over the amplitude of the excitation.

use super::ReportError;
use super::chart::colours::{BLUE, Colour, GREY, VERMILION};
use super::chart::{Chart, Mark, Pen, Row, Scale, SeriesPoint, sheet_svg};
use super::labels::frequency_text;
use bench_experiment::linearity::ModeOverAmplitude;
use bench_identify::linearity::{BandLinearity, Linearity};
use bench_identify::modal::{Estimate, FittedMode, SIGMAS_95};

const HEIGHT: f64 = 270.0;
const PERCENT: f64 = 100.0;

/// The same excitation at several amplitudes.
#[derive(Clone, Copy, Debug)]
pub struct AmplitudeOverview<'a> {
    /// Amplitudes as ratios of the planned one, rising.
    pub scales: &'a [f64],
    /// The modes of the smallest amplitude in all runs.
    pub modes: &'a [ModeOverAmplitude],
    /// Noise and distortion of each run, if it has an analysis.
    pub linearity: &'a [Option<&'a Linearity>],
}

/// The power of a part of the output over that of the output.
type PowerRatio = fn(&BandLinearity) -> Option<f64>;

/// A parameter of a mode.
type Parameter = fn(&FittedMode) -> Estimate;

/// Frequency and compliance of each mode as deviations from those at the smallest amplitude, the damping ratios, each with its 95 %
/// confidence interval, and the amplitudes of noise and distortion as ratios of the output, as an SVG document.
///
/// The compliance of a mode is its residue over the square of its frequency, r/w^2 in m/N.
///
/// # Errors
/// When there are no amplitudes.
pub fn amplitudes_svg(
    overview: &AmplitudeOverview<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if overview.scales.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let frequency = deviations(
        overview,
        "Frequency: deviation (%)",
        FittedMode::frequency_hz,
    );
    let compliance = deviations(overview, "Compliance r/ω²: deviation (%)", compliance);
    let rows = [
        Row::new(HEIGHT, vec![frequency, compliance.without_legend()]),
        Row::new(
            HEIGHT,
            vec![damping(overview).without_legend(), levels(overview)],
        ),
    ];
    sheet_svg(title, subtitle, &rows)
}

fn amplitude_axis(overview: &AmplitudeOverview<'_>) -> Scale {
    const ROOM: f64 = 1.15;
    let (first, last) = (
        overview.scales[0],
        overview.scales[overview.scales.len() - 1],
    );
    Scale::logarithmic("Amplitude (ratio of the planned one)").within(first / ROOM, last * ROOM)
}

/// r/w^2 with the standard deviation that residue and frequency give it, as if they were independent.
fn compliance(mode: &FittedMode) -> Estimate {
    let (residue, omega) = (mode.residue_per_kg, mode.omega_rad_s);
    let value = residue.value / (omega.value * omega.value);
    let relative = libm::hypot(
        residue.sigma / residue.value,
        2.0 * omega.sigma / omega.value,
    );
    Estimate {
        value,
        sigma: (value * relative).abs(),
    }
}

/// A parameter of each mode, relative to its value in the first run that has the mode.
fn deviations(overview: &AmplitudeOverview<'_>, label: &str, parameter: Parameter) -> Chart {
    let mut chart = chart(overview, label).line("", Pen::solid(GREY).thin(), zero(overview));
    for (index, mode) in overview.modes.iter().enumerate() {
        let first = mode.by_run.iter().flatten().next().map(parameter);
        let Some(reference) = first.filter(|first| first.value != 0.0) else {
            continue;
        };
        let relative = |fitted: &FittedMode| {
            let estimate = parameter(fitted);
            Estimate {
                value: PERCENT * (estimate.value / reference.value - 1.0),
                sigma: PERCENT * (estimate.sigma / reference.value).abs(),
            }
        };
        chart = chart.mark(series(overview, index, mode, &relative));
    }
    chart
}

fn damping(overview: &AmplitudeOverview<'_>) -> Chart {
    let percent = |fitted: &FittedMode| Estimate {
        value: PERCENT * fitted.damping_ratio.value,
        sigma: PERCENT * fitted.damping_ratio.sigma,
    };
    overview.modes.iter().enumerate().fold(
        chart(overview, "Damping ratio (%)"),
        |chart, (index, mode)| chart.mark(series(overview, index, mode, &percent)),
    )
}

fn chart(overview: &AmplitudeOverview<'_>, label: &str) -> Chart {
    Chart::new("", amplitude_axis(overview), Scale::linear(label))
}

fn zero(overview: &AmplitudeOverview<'_>) -> Vec<(f64, f64)> {
    let ends = overview
        .scales
        .first()
        .into_iter()
        .chain(overview.scales.last());
    ends.map(|scale| (*scale, 0.0)).collect()
}

/// A parameter of a mode over the amplitude.
fn series(
    overview: &AmplitudeOverview<'_>,
    index: usize,
    mode: &ModeOverAmplitude,
    parameter: &dyn Fn(&FittedMode) -> Estimate,
) -> Mark {
    let runs = overview.scales.iter().zip(&mode.by_run);
    let mut points = Vec::new();
    let mut starts = true;
    for (scale, fitted) in runs {
        if let Some(estimate) = fitted.as_ref().map(parameter) {
            let half = SIGMAS_95 * estimate.sigma;
            points.push(SeriesPoint {
                x: *scale,
                y: estimate.value,
                band: (estimate.value - half, estimate.value + half),
                faint: false,
                starts,
            });
        }
        starts = fitted.is_none();
    }
    Mark::Series {
        name: format!(
            "mode at {} (band: 95 %)",
            frequency_text(mode.frequency_hz())
        ),
        pen: Pen::of_series(index),
        points,
        dots: true,
    }
}

/// Amplitudes of noise and distortion as ratios of that of the output, over the whole band.
fn levels(overview: &AmplitudeOverview<'_>) -> Chart {
    let label = Scale::logarithmic("Noise and distortion / output (%)");
    let chart = Chart::new("", amplitude_axis(overview), label);
    let kinds: [(&str, Colour, PowerRatio); 3] = [
        ("noise", GREY, |band| Some(band.noise_ratio)),
        ("odd distortion", VERMILION, |band| {
            band.odd_distortion_ratio
        }),
        ("even distortion", BLUE, |band| band.even_distortion_ratio),
    ];
    kinds
        .into_iter()
        .fold(chart, |chart, (name, colour, ratio)| {
            let runs = overview.scales.iter().zip(overview.linearity);
            let points = runs.map(|(scale, linearity)| {
                let power = linearity.and_then(|linearity| ratio(&linearity.whole));
                // An estimate without bias may be negative: below what can be seen.
                let power = power.filter(|power| *power > 0.0);
                (
                    *scale,
                    power.map_or(f64::NAN, |power| PERCENT * power.sqrt()),
                )
            });
            let points: Vec<(f64, f64)> = points.collect();
            let places: Vec<(f64, f64)> =
                points.iter().copied().filter(|p| p.1.is_finite()).collect();
            chart.line(name, Pen::solid(colour), points).points(
                "",
                colour,
                super::Symbol::Dot,
                places,
            )
        })
}

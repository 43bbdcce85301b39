//! The plots of a record.

use std::f64::consts::TAU;

use nalgebra::Complex;

use super::RecordReport;
use crate::html::{picture, section};
use crate::{
    Identification, OrderedMode, PoleZeroMap, ReportError, StabilityChart, Trace, UncertainPoint,
    coherence_svg, identification_svg, nyquist_svg, pole_zero_svg, stability_svg,
};
use bench_experiment::outputs::PlotKind;
use bench_identify::modal::{ModalFit, ModelOrder, UncertainPole};
use bench_identify::verdict::{self, UncertainZero};
use bench_plant::zeros::ModalTerm;

/// The part of a Nyquist plot around two close modes extends by this multiple of their distance to either side.
const SURROUNDINGS_RATIO: f64 = 1.5;

const BODE_CAPTION: &str = "Magnitude, phase and coherence: measured (wide line) with a band of two sigma, the model of the \
    configuration and the fit of modes, where they exist. The line is faint where the band reaches zero magnitude.";
const RESIDUAL_CAPTION: &str = " The residual is the distance of the measured response from the fit; noise alone leaves 95 % of it \
    in the band. It is smaller where few points determine a mode, because the fit follows their noise.";
const COHERENCE_CAPTION: &str = "The part of the output power that the input explains. Below: 1 − coherence, which is due to \
    noise, leakage and nonlinearity.";
const NYQUIST_CAPTION: &str = "The response in the complex plane, where its magnitude exceeds two sigma; on the right the \
    closest modes. Arrows point to rising frequency; some frequencies are given. Circles are 95 % confidence regions. Delay, hold and amplifier turn the curve clockwise with frequency.";
const STABILITY_CAPTION: &str = "The modes at each model order that the fit visited. A mode of the stage persists from one \
    order to the next; a mode of noise or of the search moves. Behind them: the measured magnitude. The first orders are fitted with larger tolerances.";

/// A plot of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Its kind.
    pub kind: PlotKind,
    /// Its caption.
    pub caption: String,
    /// The SVG document.
    pub svg: String,
}

impl Plot {
    /// A plot with its caption.
    pub fn new(kind: PlotKind, caption: impl Into<String>, svg: String) -> Plot {
        Plot {
            kind,
            caption: caption.into(),
            svg,
        }
    }

    /// The section of the plot on a page, as HTML.
    pub(super) fn section(&self) -> String {
        let heading = heading(self.kind);
        section(heading, &picture(&self.svg, heading, &self.caption))
    }
}

/// The heading of a plot on the page.
fn heading(kind: PlotKind) -> &'static str {
    match kind {
        PlotKind::Bode => "Frequency response",
        PlotKind::Coherence => "Coherence",
        PlotKind::Nyquist => "Nyquist plot",
        PlotKind::PoleZero => "Poles and zeros",
        PlotKind::Stability => "Stability chart",
        PlotKind::Loop => "Loop",
        PlotKind::LoopNyquist => "Nyquist plot of the loop",
        PlotKind::Sensitivity => "Sensitivities",
        PlotKind::Linearity => "Distortion and noise",
        PlotKind::Signals => "Signals",
        PlotKind::Step => "Step response",
        PlotKind::Spectrum => "Spectrum of the error",
    }
}

/// All plots that a record has data for.
///
/// # Errors
/// When a response is invalid.
pub fn plots(report: &RecordReport<'_>) -> Result<Vec<Plot>, ReportError> {
    let map = report.fit.map(|fit| pole_zero_map(report, fit));
    let curves = Curves::of(report);
    let mut plots = vec![
        bode(report, &curves)?,
        coherence(report)?,
        nyquist(report, &curves, map.as_ref())?,
    ];
    if let (Some(fit), Some(map)) = (report.fit, &map) {
        plots.push(pole_zero(report, map)?);
        plots.push(stability(report, fit)?);
    }
    plots.extend(report.further_plots.iter().cloned());
    Ok(plots)
}

/// Model and fit on a fine grid, and the fit at the measured frequencies.
struct Curves {
    grid_hz: Vec<f64>,
    model: Option<Vec<Complex<f64>>>,
    fit: Option<FitCurve>,
}

struct FitCurve {
    name: String,
    on_grid: Vec<Complex<f64>>,
    at_measured: Vec<Complex<f64>>,
}

impl Curves {
    fn of(report: &RecordReport<'_>) -> Curves {
        let grid_hz = fine_grid_hz(report);
        Curves {
            model: report.model.map(|model| model.at(&grid_hz)),
            fit: report.fit.map(|fit| FitCurve::of(report, fit, &grid_hz)),
            grid_hz,
        }
    }

    fn traces(&self) -> Vec<Trace<'_>> {
        let model = self.model.iter();
        let fit = self.fit.iter();
        model
            .map(|model| Trace::model("model", &self.grid_hz, model))
            .chain(fit.map(|fit| Trace::fit(&fit.name, &self.grid_hz, &fit.on_grid)))
            .collect()
    }
}

impl FitCurve {
    fn of(report: &RecordReport<'_>, fit: &ModalFit, grid_hz: &[f64]) -> FitCurve {
        FitCurve {
            name: format!("fit of {} modes", fit.parameters.modes.len()),
            on_grid: fit.response(&report.chain, grid_hz),
            at_measured: fit.response(&report.chain, &report.frf.frequency_hz),
        }
    }
}

/// Frequencies over the measured band, dense at the modes and at the zeros of the fit. A record may have a few lines only.
fn fine_grid_hz(report: &RecordReport<'_>) -> Vec<f64> {
    let frequency_hz = &report.frf.frequency_hz;
    let ends = frequency_hz.first().zip(frequency_hz.last());
    let Some((low_hz, high_hz)) = ends.filter(|(low, high)| low < high) else {
        return frequency_hz.clone();
    };
    let mut features = report.fit.map_or(Vec::new(), features_of);
    features.extend(report.model.iter().flat_map(|model| model.resonances()));
    let grid_rad_s = bench_control::grid(TAU * low_hz, TAU * high_hz, &features);
    let mut grid_hz: Vec<f64> = grid_rad_s.into_iter().map(|w| w / TAU).collect();
    // Two neighbours can be equal after the division by 2 pi.
    grid_hz.dedup();
    grid_hz
}

/// Magnitude in rad/s and damping ratio of the poles and zeros of a fit.
fn features_of(fit: &ModalFit) -> Vec<(f64, f64)> {
    let poles = fit.parameters.modes.iter();
    let zeros = verdict::zeros(fit).unwrap_or_default();
    poles
        .map(|term| (term.omega_rad_s, term.damping_ratio))
        .chain(zeros.iter().map(|zero| {
            let magnitude_rad_s = zero.s.norm();
            (magnitude_rad_s, (zero.s.re / magnitude_rad_s).abs())
        }))
        .filter(|(omega_rad_s, _)| *omega_rad_s > 0.0)
        .collect()
}

fn bode(report: &RecordReport<'_>, curves: &Curves) -> Result<Plot, ReportError> {
    let fit = curves.fit.as_ref();
    let plot = Identification {
        unit: report.unit,
        magnitude_axis: report.magnitude_axis,
        measured: report.frf,
        curves: &curves.traces(),
        fitted: fit.map(|fit| &fit.at_measured[..]),
    };
    let svg = identification_svg(&plot, &report.title, &report.subtitle)?;
    Ok(Plot::new(PlotKind::Bode, bode_caption(report), svg))
}

fn bode_caption(report: &RecordReport<'_>) -> String {
    let residual = report.fit.map_or("", |_| RESIDUAL_CAPTION);
    [BODE_CAPTION, residual].concat()
}

fn coherence(report: &RecordReport<'_>) -> Result<Plot, ReportError> {
    let svg = coherence_svg(report.frf, &report.title, &report.subtitle)?;
    Ok(Plot::new(PlotKind::Coherence, COHERENCE_CAPTION, svg))
}

fn nyquist(
    report: &RecordReport<'_>,
    curves: &Curves,
    map: Option<&PoleZeroMap>,
) -> Result<Plot, ReportError> {
    let part_hz = map.and_then(PoleZeroMap::close_pair).map(surroundings_hz);
    let mut traces = vec![Trace::measured("measured", report.frf)];
    traces.extend(curves.traces());
    let (title, subtitle) = (&report.title, &report.subtitle);
    let svg = nyquist_svg(report.unit, &traces, part_hz, title, subtitle)?;
    Ok(Plot::new(PlotKind::Nyquist, NYQUIST_CAPTION, svg))
}

/// The frequencies around two close modes, in hertz.
fn surroundings_hz((low, high): (f64, f64)) -> (f64, f64) {
    let room = SURROUNDINGS_RATIO * (high - low);
    ((low - room).max(0.0) / TAU, (high + room) / TAU)
}

/// Poles and zeros of the fit.
fn pole_zero_map(report: &RecordReport<'_>, fit: &ModalFit) -> PoleZeroMap {
    let judged = &report.verdict.zeros;
    // Without zeros of the fit the verdict has none either.
    let zeros = verdict::zeros(fit).unwrap_or_default();
    let others = zeros.iter().filter(|other| !judged.contains(other));
    PoleZeroMap {
        poles: fit.poles().iter().map(pole).collect(),
        zeros: judged.iter().map(zero).collect(),
        others: others.map(zero).collect(),
        up_to_rad_s: report.judged_up_to_rad_s,
    }
}

fn pole(pole: &UncertainPole) -> UncertainPoint {
    UncertainPoint {
        s: pole.s,
        covariance: pole.covariance,
    }
}

fn zero(zero: &UncertainZero) -> UncertainPoint {
    UncertainPoint {
        s: zero.s,
        covariance: zero.covariance,
    }
}

fn pole_zero(report: &RecordReport<'_>, map: &PoleZeroMap) -> Result<Plot, ReportError> {
    let svg = pole_zero_svg(map, &report.title, &report.subtitle)?;
    Ok(Plot::new(
        PlotKind::PoleZero,
        pole_zero_caption(map.up_to_rad_s),
        svg,
    ))
}

fn pole_zero_caption(limit_rad_s: f64) -> String {
    format!(
        "Poles and zeros of the fit, with damping, above the real axis; hold, amplifier and delays are not included. Ellipses \
         are 95 % confidence regions of zeros, bars 95 % confidence intervals of poles. The verdict uses those below \
         {limit_rad_s:.0} rad/s ({:.1} Hz). Zeros of the verdict are enlarged below, those nearest to the axis first.",
        limit_rad_s / TAU
    )
}

fn stability(report: &RecordReport<'_>, fit: &ModalFit) -> Result<Plot, ReportError> {
    let orders: Vec<Vec<OrderedMode>> = fit.orders.iter().map(ordered_modes).collect();
    let fit_modes = fit.parameters.modes.iter();
    let fit_hz: Vec<f64> = fit_modes.map(|term| term.omega_rad_s / TAU).collect();
    let chart = StabilityChart {
        orders: &orders,
        fit_hz: &fit_hz,
        band_hz: fit.band_hz,
        measured: report.frf,
        unit: report.unit,
    };
    let svg = stability_svg(&chart, &report.title, &report.subtitle)?;
    Ok(Plot::new(PlotKind::Stability, STABILITY_CAPTION, svg))
}

fn ordered_modes(order: &ModelOrder) -> Vec<OrderedMode> {
    order.parameters.modes.iter().map(ordered_mode).collect()
}

fn ordered_mode(term: &ModalTerm) -> OrderedMode {
    OrderedMode {
        frequency_hz: term.omega_rad_s / TAU,
        damping_ratio: term.damping_ratio,
    }
}

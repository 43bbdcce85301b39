//! The Bode plot: magnitude, phase and coherence over one logarithmic frequency axis.

use plotters::style::text_anchor::{HPos, VPos};

use super::ReportError;
use super::axis::{Axis, Tick};
use super::canvas::{self, Canvas, TextForm};
use super::header::Header;
use super::panel::{INK, Panel, Ticks};
use super::trace::{self, Line, Shown, Trace};
use crate::identify::Unit;

/// Size of the page in pixels.
const SIZE: (f64, f64) = (1000.0, 880.0);
const LEFT: f64 = 84.0;
const RIGHT: f64 = 974.0;
const GAP: f64 = 16.0;
/// Room for the frequencies and their unit below the lowest panel.
const FOOT: f64 = 52.0;
/// Heights of the panels for magnitude, phase and coherence, relative to each other.
const HEIGHTS: [f64; 3] = [0.46, 0.35, 0.19];
/// Part of an axis left free above and below the curves.
const MARGIN: f64 = 0.06;

/// The Bode plot of some responses, as an SVG document.
///
/// Magnitude in `unit` on a logarithmic axis, phase in degrees, unwrapped from the lowest frequency on, where it is within
/// +-180, and the coherence of measured traces, if there are any. Around measured curves lies their band of +-2 sigma;
/// where that reaches zero magnitude the curve is drawn faint and has no say in the axes. Models are drawn on top,
/// dashed where there is something measured below.
///
/// # Errors
/// When there is nothing to draw, or a trace is not sound: see [`ReportError`].
pub fn bode_svg(
    unit: Unit,
    traces: &[Trace],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let mut lines = trace::lines(traces)?;
    // Stable: measured traces first, so that models come to lie on top.
    lines.sort_by_key(|line| line.measured.is_none());
    let header = Header::new(title, subtitle, &lines, (LEFT, RIGHT));
    let magnitudes = magnitude_range(&lines).ok_or(ReportError::NoMagnitude)?;
    let plot = Plot {
        frequencies: frequency_range(&lines),
        magnitudes,
        phases: phase_range(&lines),
        lines,
        header,
        unit,
    };
    canvas::page(SIZE, |canvas| plot.draw(canvas))
}

struct Plot<'a> {
    lines: Vec<Line<'a>>,
    header: Header,
    unit: Unit,
    frequencies: (f64, f64),
    magnitudes: (f64, f64),
    phases: (f64, f64),
}

impl Plot<'_> {
    fn draw(&self, canvas: &Canvas) -> Result<(), ReportError> {
        self.header.draw(canvas, &self.lines)?;
        let coherent = self.lines.iter().any(|line| line.measured.is_some());
        let panels = if coherent { 3 } else { 2 };
        self.magnitude(canvas, self.rows(0, panels))?;
        self.phase(canvas, self.rows(1, panels), !coherent)?;
        if coherent {
            self.coherence(canvas, self.rows(2, panels))?;
        }
        let anchor = (HPos::Center, VPos::Bottom);
        let form = TextForm {
            size: 13.0,
            colour: INK,
            bold: false,
            anchor,
            upward: false,
        };
        canvas.text(
            "Frequency (Hz)",
            ((LEFT + RIGHT) / 2.0, SIZE.1 - 12.0),
            form,
        )
    }

    /// Top and bottom of a panel.
    fn rows(&self, index: usize, panels: usize) -> (f64, f64) {
        let room = SIZE.1 - FOOT - self.header.bottom - GAP * (panels - 1) as f64;
        let total: f64 = HEIGHTS[..panels].iter().sum();
        let above: f64 = HEIGHTS[..index].iter().sum();
        let top = self.header.bottom + room * above / total + GAP * index as f64;
        (top, top + room * HEIGHTS[index] / total)
    }

    fn panel(&self, (top, bottom): (f64, f64), y: Axis) -> (Panel, Vec<Tick>) {
        let x = Axis::logarithmic(self.frequencies, (LEFT, RIGHT));
        (
            Panel {
                left: LEFT,
                right: RIGHT,
                top,
                bottom,
                x,
                y,
            },
            x.frequency_ticks(),
        )
    }

    fn magnitude(&self, canvas: &Canvas, (top, bottom): (f64, f64)) -> Result<(), ReportError> {
        let (panel, x) = self.panel(
            (top, bottom),
            Axis::logarithmic(self.magnitudes, (bottom, top)),
        );
        let label = match self.unit {
            Unit::MetresPerAmpere => "Magnitude (m/A)",
            Unit::Bare => "Magnitude",
        };
        let y = panel.y.magnitude_ticks();
        panel.frame(
            canvas,
            &Ticks {
                x: &x,
                y: &y,
                label,
                frequencies: false,
            },
        )?;
        self.lines
            .iter()
            .try_for_each(|line| panel.curve(canvas, line, |k| line.magnitude(k)))
    }

    fn phase(
        &self,
        canvas: &Canvas,
        (top, bottom): (f64, f64),
        frequencies: bool,
    ) -> Result<(), ReportError> {
        let (panel, x) = self.panel((top, bottom), Axis::linear(self.phases, (bottom, top)));
        let y = panel.y.phase_ticks();
        panel.frame(
            canvas,
            &Ticks {
                x: &x,
                y: &y,
                label: "Phase (deg)",
                frequencies,
            },
        )?;
        self.lines
            .iter()
            .try_for_each(|line| panel.curve(canvas, line, |k| line.phase(k)))
    }

    fn coherence(&self, canvas: &Canvas, (top, bottom): (f64, f64)) -> Result<(), ReportError> {
        let (panel, x) = self.panel((top, bottom), Axis::linear((0.0, 1.05), (bottom, top)));
        let y = panel.y.linear_ticks(0.5, |value| value.to_string());
        panel.frame(
            canvas,
            &Ticks {
                x: &x,
                y: &y,
                label: "Coherence",
                frequencies: true,
            },
        )?;
        let measured = self
            .lines
            .iter()
            .filter_map(|line| Some((line, line.measured?)));
        for (line, frf) in measured {
            let shown = |value| Shown {
                value,
                low: value,
                high: value,
                faint: false,
            };
            panel.curve(canvas, line, |k| shown(frf.coherence[k]))?;
        }
        Ok(())
    }
}

/// Of all lines; a single frequency gets a third of an octave to either side.
fn frequency_range(lines: &[Line]) -> (f64, f64) {
    let frequencies = || {
        lines
            .iter()
            .flat_map(|line| line.frequency_hz.iter().copied())
    };
    let (low, high) = range(frequencies()).unwrap_or((1.0, 1.0));
    if low < high {
        (low, high)
    } else {
        (low / 1.26, high * 1.26)
    }
}

/// Of the magnitudes drawn in full, or of all where none is, with a margin, and a decade at least.
fn magnitude_range(lines: &[Line]) -> Option<(f64, f64)> {
    let logs = |all: bool| {
        let shown =
            move |line: &'_ Line, k: usize| (all || line.firm[k]) && line.magnitude[k] > 0.0;
        let log =
            move |line: &Line, k: usize| shown(line, k).then(|| libm::log10(line.magnitude[k]));
        range(
            lines
                .iter()
                .flat_map(|line| (0..line.magnitude.len()).filter_map(move |k| log(line, k))),
        )
    };
    let (low, high) = with_margin(logs(false).or_else(|| logs(true))?, 1.0);
    Some((libm::pow(10.0, low), libm::pow(10.0, high)))
}

/// Of the phases drawn in full, likewise, and half a turn at least.
fn phase_range(lines: &[Line]) -> (f64, f64) {
    let phases = |all: bool| {
        let shown = move |line: &Line, k: usize| (all || line.firm[k]).then_some(line.phase_deg[k]);
        range(
            lines
                .iter()
                .flat_map(|line| (0..line.phase_deg.len()).filter_map(move |k| shown(line, k))),
        )
    };
    with_margin(
        phases(false).or_else(|| phases(true)).unwrap_or((0.0, 0.0)),
        180.0,
    )
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

/// Widened to both sides by the margin, and about its middle to the least width.
fn with_margin((low, high): (f64, f64), least: f64) -> (f64, f64) {
    let half = (high - low).max(least) * (0.5 + MARGIN);
    let middle = (low + high) / 2.0;
    (middle - half, middle + half)
}

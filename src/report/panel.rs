//! One panel of a plot: frame, grid, labels and curves.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::ReportError;
use super::axis::{Axis, Tick};
use super::canvas::{Canvas, TextForm};
use super::curve::{self, Sample};
use super::trace::{Line, Shown};

const FRAME: RGBColor = RGBColor(90, 90, 90);
const GRID: RGBColor = RGBColor(205, 205, 205);
const FINE_GRID: RGBColor = RGBColor(234, 234, 234);
pub(super) use super::colours::INK;
/// From the frame to the middle of what stands along the vertical axis.
const LABEL_LEFT: f64 = 66.0;
const LABEL_SIZE: f64 = 12.0;
pub(super) const LINE_WIDTH: f64 = 1.4;
/// Radius of the dots that mark points.
const DOT: f64 = 2.0;
/// How much of a faint stroke, and of a band, covers what is below.
const FAINT: f64 = 0.3;
pub(super) const BAND: f64 = 0.22;
/// Fewer points than this are marked one by one.
const MARKED_POINTS: usize = 150;

/// A rectangle with axes.
pub(super) struct Panel {
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
    pub x: Axis,
    pub y: Axis,
}

/// Which ticks carry what.
pub(super) struct Ticks<'a> {
    pub x: &'a [Tick],
    pub y: &'a [Tick],
    /// What stands along the vertical axis.
    pub label: &'a str,
    /// Whether the frequencies are written below this panel.
    pub frequencies: bool,
}

impl Panel {
    /// Grid, frame, ticks and labels.
    pub fn frame(&self, canvas: &Canvas, ticks: &Ticks) -> Result<(), ReportError> {
        for labelled in [false, true] {
            self.grid(canvas, ticks, labelled)?;
        }
        let (l, r, t, b) = (self.left, self.right, self.top, self.bottom);
        canvas.line(
            &[(l, t), (r, t), (r, b), (l, b), (l, t), (r, t)],
            FRAME.to_rgba(),
            0.8,
        )?;
        for tick in ticks.y {
            let position = (self.left - 6.0, self.y.pixel(tick.value));
            write(canvas, tick, position, (HPos::Right, VPos::Center))?;
        }
        for tick in ticks.x.iter().filter(|_| ticks.frequencies) {
            write(
                canvas,
                tick,
                (self.x.pixel(tick.value), b + 6.0),
                (HPos::Center, VPos::Top),
            )?;
        }
        let middle = (self.left - LABEL_LEFT, (t + b) / 2.0);
        let anchor = (HPos::Center, VPos::Center);
        canvas.text(
            ticks.label,
            middle,
            TextForm {
                size: 13.0,
                colour: INK,
                bold: false,
                anchor,
                upward: true,
            },
        )
    }

    fn grid(&self, canvas: &Canvas, ticks: &Ticks, labelled: bool) -> Result<(), ReportError> {
        let (colour, width) = if labelled {
            (GRID, 0.8)
        } else {
            (FINE_GRID, 0.6)
        };
        for tick in ticks
            .x
            .iter()
            .filter(|tick| tick.label.is_some() == labelled)
        {
            let x = self.x.pixel(tick.value);
            canvas.line(&[(x, self.top), (x, self.bottom)], colour.to_rgba(), width)?;
        }
        for tick in ticks
            .y
            .iter()
            .filter(|tick| tick.label.is_some() == labelled)
        {
            let y = self.y.pixel(tick.value);
            canvas.line(&[(self.left, y), (self.right, y)], colour.to_rgba(), width)?;
        }
        Ok(())
    }

    /// A line of a trace, of which `shown` gives the k-th value.
    pub fn curve(
        &self,
        canvas: &Canvas,
        line: &Line,
        shown: impl Fn(usize) -> Shown,
    ) -> Result<(), ReportError> {
        let samples = self.samples(line, shown);
        let columns = curve::columns(&samples);
        if samples.iter().any(|sample| sample.band.0 < sample.band.1) {
            for outline in curve::bands(&columns) {
                canvas.area(&outline, line.colour.mix(BAND))?;
            }
        }
        for stroke in curve::strokes(&columns) {
            let strength = if stroke.faint { FAINT } else { 1.0 };
            for dash in dashes(line, &stroke.points) {
                canvas.line(&dash, line.colour.mix(strength), LINE_WIDTH)?;
            }
        }
        self.marks(canvas, line, &samples)
    }

    /// Dots where measured points are few, or stand alone between gaps.
    fn marks(&self, canvas: &Canvas, line: &Line, samples: &[Sample]) -> Result<(), ReportError> {
        let few = line.measured.is_some() && samples.len() < MARKED_POINTS;
        let alone =
            |k: usize| samples[k].begins && samples.get(k + 1).is_none_or(|next| next.begins);
        for (k, sample) in samples.iter().enumerate().filter(|(k, _)| few || alone(*k)) {
            let strength = if samples[k].faint { FAINT } else { 1.0 };
            canvas.dot((sample.x, sample.y), DOT, line.colour.mix(strength))?;
        }
        Ok(())
    }

    fn samples(&self, line: &Line, shown: impl Fn(usize) -> Shown) -> Vec<Sample> {
        let sample = |k: usize| {
            let shown = shown(k);
            let band = (self.y.pixel(shown.high), self.y.pixel(shown.low));
            let (x, y) = (
                self.x.pixel(line.frequency_hz[k]),
                self.y.pixel(shown.value),
            );
            Sample {
                x,
                y,
                band,
                faint: shown.faint,
                begins: line.begins[k],
            }
        };
        (0..line.frequency_hz.len()).map(sample).collect()
    }
}

/// A line as it is drawn for a trace: in one, or in dashes.
pub(super) fn dashes(line: &Line, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    line.dashes.map_or_else(
        || vec![points.to_vec()],
        |dashes| curve::dashed(points, dashes),
    )
}

fn write(
    canvas: &Canvas,
    tick: &Tick,
    position: (f64, f64),
    anchor: (HPos, VPos),
) -> Result<(), ReportError> {
    let form = TextForm {
        size: LABEL_SIZE,
        colour: INK,
        bold: false,
        anchor,
        upward: false,
    };
    tick.label
        .as_ref()
        .map_or(Ok(()), |label| canvas.text(label, position, form))
}

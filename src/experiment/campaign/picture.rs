//! The measured dots over the model's map (Fig 5-10), and how likely each offset is.

use super::offset::CHI2_95;
use super::{Answer, Offset};
use crate::identify::verdict::Cnmp;
use crate::model::plant::PlantError;
use crate::model::zeros::cnmp_map;
use crate::report::colours::{BLUE, Colour, GREEN, INK, PAPER, VERMILION};
use crate::report::{Chart, Mark, Pen, ReportError, Row, Scale, Symbol, sheet_svg};

/// Cells of the map along the asymmetries.
const COLUMNS: usize = 161;
/// With CNMP zeros.
const WITH: Colour = Colour(244, 196, 160);
/// With CNMP zeros only where there were no damping.
const UNDAMPED: Colour = Colour(252, 234, 218);

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PictureError {
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// It cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// The map as configured and, where an offset is known, as it is with that; the likelihood of the offsets. SVG.
pub fn picture(title: &str, answer: &Answer<'_>) -> Result<String, PictureError> {
    let mut maps = vec![map(answer, "(a) The model as configured", 0.0)?];
    let mut rows = Vec::new();
    if let Some(offset) = &answer.offset {
        let heading = format!(
            "(b) The model with {:+.2} % of initial asymmetry",
            100.0 * offset.best
        );
        maps.push(map(answer, &heading, offset.best)?);
        rows.push(Row::new(150.0, vec![likelihood(offset)]));
    }
    rows.insert(0, Row::new(400.0, maps));
    let subtitle = "one chirp at each point; the asymmetry is what was put on, without the initial one of the stage";
    Ok(sheet_svg(title, subtitle, &rows)?)
}

fn map(answer: &Answer<'_>, heading: &str, offset: f64) -> Result<Chart, PictureError> {
    let [(left, right), (low, high)] = frame(answer).map(|(low, high)| (100.0 * low, 100.0 * high));
    let x = Scale::linear("Intended mass asymmetry (%)").within(left, right);
    let y = Scale::linear("Operating point (% of L)").within(low, high);
    let mut chart = Chart::new(heading, x, y).mark(cells(answer, offset)?);
    for (cnmp, colour, symbol) in [
        (Cnmp::Detected, VERMILION, Symbol::Dot),
        (Cnmp::Excluded, BLUE, Symbol::Ring),
        (Cnmp::Undecided, INK, Symbol::Cross),
    ] {
        chart = chart.points(cnmp.name(), colour, symbol, dots(answer, cnmp));
    }
    if let Some(best) = &answer.recommendation {
        let (low, high) = ends(&answer.grid.operating_points);
        let at = 100.0 * best.asymmetry;
        chart = chart.line(
            "recommended",
            Pen::dashed(GREEN),
            vec![(at, 100.0 * low), (at, 100.0 * high)],
        );
    }
    Ok(chart)
}

/// Where a verdict was given, in per cent.
fn dots(answer: &Answer<'_>, cnmp: Cnmp) -> Vec<(f64, f64)> {
    let told = answer.points.iter().filter(|told| told.point.cnmp == cnmp);
    told.map(|told| (100.0 * told.asymmetry, 100.0 * told.operating_point))
        .collect()
}

fn cells(answer: &Answer<'_>, offset: f64) -> Result<Mark, PictureError> {
    let [(low, high), _] = frame(answer);
    let width = high - low;
    let asymmetries: Vec<f64> = (0..COLUMNS)
        .map(|k| low + width * (k as f64 + 0.5) / COLUMNS as f64)
        .collect();
    let shifted: Vec<f64> = asymmetries
        .iter()
        .map(|asymmetry| asymmetry + offset)
        .collect();
    let undamped = cnmp_map(
        answer.settings,
        &answer.region.operating_points,
        &shifted,
        1,
    )?;
    let cell = |row: usize, column: usize| match answer.region.contains(row, shifted[column]) {
        true => 2,
        false => usize::from(undamped[row][column] > 0),
    };
    Ok(Mark::Cells {
        x: (0..=COLUMNS)
            .map(|k| 100.0 * (low + width * k as f64 / COLUMNS as f64))
            .collect(),
        y: edges(&answer.region.operating_points),
        rows: (0..undamped.len())
            .map(|row| (0..COLUMNS).map(|column| cell(row, column)).collect())
            .collect(),
        colours: vec![
            (String::new(), PAPER),
            ("CNMP zeros without damping only".into(), UNDAMPED),
            ("CNMP zeros".into(), WITH),
        ],
    })
}

/// Ends of both axes, ratios: the asymmetries of the grid with a margin, the operating points of the map.
fn frame(answer: &Answer<'_>) -> [(f64, f64); 2] {
    let (low, high) = ends(&answer.grid.asymmetries);
    let margin = 0.05 * (high - low);
    [
        (low - margin, high + margin),
        ends(&answer.region.operating_points),
    ]
}

/// Edges of the cells around rising values, in per cent.
fn edges(values: &[f64]) -> Vec<f64> {
    let (low, high) = ends(values);
    let half = 0.5 * (high - low) / (values.len().max(2) - 1) as f64;
    values
        .iter()
        .map(|value| 100.0 * (value - half))
        .chain([100.0 * (high + half)])
        .collect()
}

fn ends(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(*x), high.max(*x))
        })
}

fn likelihood(offset: &Offset) -> Chart {
    let highest = offset
        .steps
        .iter()
        .map(|step| step.log_likelihood)
        .fold(f64::NEG_INFINITY, f64::max);
    let level = |step: &super::Step| step.log_likelihood - highest;
    let corners = |step: &super::Step| {
        [
            (100.0 * step.from, level(step)),
            (100.0 * step.to, level(step)),
        ]
    };
    let lowest = offset.steps.iter().map(level).fold(-3.0, f64::min);
    let limit = -0.5 * CHI2_95;
    let [low, high] = offset.interval.map(|end| 100.0 * end);
    let (from, to) = (100.0 * offset.searched[0], 100.0 * offset.searched[1]);
    Chart::new(
        "(c) Which initial asymmetry fits the verdicts best",
        Scale::linear("Initial asymmetry (%)").within(from, to),
        Scale::linear("log likelihood").within(1.08 * lowest, -0.05 * lowest),
    )
    .mark(Mark::Area {
        name: "interval of 95 %".into(),
        colour: GREEN,
        strength: 0.25,
        outline: vec![
            (low, 1.08 * lowest),
            (high, 1.08 * lowest),
            (high, 0.0),
            (low, 0.0),
        ],
    })
    .line(
        "",
        Pen::dotted(INK).thin(),
        vec![(from, limit), (to, limit)],
    )
    .line(
        "",
        Pen::solid(BLUE),
        offset.steps.iter().flat_map(corners).collect(),
    )
}

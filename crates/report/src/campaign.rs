//! The verdicts of a campaign over the map of the model (Fig 5-10), and the likelihood of the offsets.

use super::chart::{Chart, Mark, Pen, Row, Scale, Symbol, colours, sheet_svg};
use super::error::ReportError;
use colours::{BLUE, Colour, GREEN, INK, PAPER, VERMILION};

use bench_base::decimal::Decimal;
use bench_experiment::campaign::{CHI2_95, Evaluation, Offset, ends};
use bench_identify::verdict::Cnmp;
use bench_plant::PlantError;
use bench_plant::zeros::cnmp_map;

/// Number of cells of the map along the asymmetries.
const COLUMNS: usize = 161;
/// Cells without CNMP zeros, with CNMP zeros only without damping, and with CNMP zeros.
const CELL_COLOURS: [(&str, Colour); 3] = [
    ("", PAPER),
    ("CNMP zeros without damping only", Colour(252, 234, 218)),
    ("CNMP zeros", Colour(244, 196, 160)),
];

/// How the verdicts are drawn.
const VERDICTS: [(Cnmp, Colour, Symbol); 3] = [
    (Cnmp::Detected, VERMILION, Symbol::Dot),
    (Cnmp::Excluded, BLUE, Symbol::Ring),
    (Cnmp::Undecided, INK, Symbol::Cross),
];

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// It cannot be drawn.
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// The map as configured and, if an offset is estimated, with the offset; the likelihood of the offsets. SVG.
pub fn campaign_picture(title: &str, evaluation: &Evaluation<'_>) -> Result<String, PictureError> {
    let mut maps = vec![map(evaluation, "(a) The model as configured", 0.0)?];
    let mut rows = Vec::new();
    if let Some(offset) = &evaluation.offset {
        let heading = format!(
            "(b) The model with {:+.2} % of initial asymmetry",
            Decimal(100.0 * offset.best)
        );
        maps.push(map(evaluation, &heading, offset.best)?);
        rows.push(Row::new(150.0, vec![likelihood(offset)]));
    }
    rows.insert(0, Row::new(400.0, maps));
    let subtitle = "a verdict at each measured point; the asymmetry is the intended one, without the initial asymmetry of the stage";
    Ok(sheet_svg(title, subtitle, &rows)?)
}

fn map(evaluation: &Evaluation<'_>, heading: &str, offset: f64) -> Result<Chart, PictureError> {
    let [(left, right), (low, high)] =
        frame(evaluation).map(|(low, high)| (100.0 * low, 100.0 * high));
    let x = Scale::linear("Intended mass asymmetry (%)").within(left, right);
    let y = Scale::linear("Operating point (% of L)").within(low, high);
    let mut chart = Chart::new(heading, x, y).mark(cells(evaluation, offset)?);
    for (cnmp, colour, symbol) in VERDICTS {
        chart = chart.points(cnmp.name(), colour, symbol, dots(evaluation, cnmp));
    }
    Ok(with_recommendation(chart, evaluation))
}

/// The recommended asymmetry, if there is one.
fn with_recommendation(chart: Chart, evaluation: &Evaluation<'_>) -> Chart {
    let Some(best) = &evaluation.recommendation else {
        return chart;
    };
    let x = 100.0 * best.asymmetry;
    let (low, high) = ends(&evaluation.grid.operating_points);
    let line = vec![(x, 100.0 * low), (x, 100.0 * high)];
    chart.line("recommended", Pen::dashed(GREEN), line)
}

/// The points with a verdict, in per cent.
fn dots(evaluation: &Evaluation<'_>, cnmp: Cnmp) -> Vec<(f64, f64)> {
    let points = evaluation
        .points
        .iter()
        .filter(|point| point.result.cnmp == cnmp);
    points
        .map(|point| (100.0 * point.asymmetry, 100.0 * point.operating_point))
        .collect()
}

fn cells(evaluation: &Evaluation<'_>, offset: f64) -> Result<Mark, PictureError> {
    let [(low, high), _] = frame(evaluation);
    let at = |column: f64| low + (high - low) * column / COLUMNS as f64;
    let shifted: Vec<f64> = (0..COLUMNS).map(|k| at(k as f64 + 0.5) + offset).collect();
    let operating_points = &evaluation.region.operating_points;
    let undamped = cnmp_map(evaluation.stage, operating_points, &shifted, 1)?;
    let rows = undamped.iter().enumerate();
    let rows = rows.map(|(row, pairs)| cell_row(evaluation, row, &shifted, pairs));
    Ok(Mark::Cells {
        x: (0..=COLUMNS).map(|k| 100.0 * at(k as f64)).collect(),
        y: edges(operating_points),
        rows: rows.collect(),
        colours: CELL_COLOURS
            .map(|(name, colour)| (name.into(), colour))
            .to_vec(),
    })
}

/// Colours of a row of cells, from the asymmetries in their middle and their numbers of CNMP pairs without damping.
fn cell_row(
    evaluation: &Evaluation<'_>,
    row: usize,
    asymmetries: &[f64],
    undamped_pairs: &[u8],
) -> Vec<usize> {
    let cells = asymmetries.iter().zip(undamped_pairs);
    cells
        .map(|(asymmetry, pairs)| {
            if evaluation.region.contains(row, *asymmetry) {
                2
            } else {
                usize::from(*pairs > 0)
            }
        })
        .collect()
}

/// Ends of both axes, ratios: the asymmetries of the grid with a margin, the operating points of the map.
fn frame(evaluation: &Evaluation<'_>) -> [(f64, f64); 2] {
    let (low, high) = ends(&evaluation.grid.asymmetries);
    let margin = 0.05 * (high - low);
    [
        (low - margin, high + margin),
        ends(&evaluation.region.operating_points),
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

fn likelihood(offset: &Offset) -> Chart {
    let curve = likelihood_curve(offset);
    let lowest = curve.iter().map(|(_, level)| *level).fold(-3.0, f64::min);
    let (bottom, top) = (1.08 * lowest, -0.05 * lowest);
    let limit = -0.5 * CHI2_95;
    let [from, to] = offset.searched.map(|end| 100.0 * end);
    let x = Scale::linear("Initial asymmetry (%)").within(from, to);
    let y = Scale::linear("log likelihood").within(bottom, top);
    Chart::new("(c) Likelihood of the initial asymmetry", x, y)
        .mark(interval(offset, bottom))
        .line(
            "95 % limit",
            Pen::dotted(INK).thin(),
            vec![(from, limit), (to, limit)],
        )
        .line("", Pen::solid(BLUE), curve)
}

/// Offsets in per cent and log likelihoods relative to the highest one, as a line with steps.
fn likelihood_curve(offset: &Offset) -> Vec<(f64, f64)> {
    let likelihoods = offset.steps.iter().map(|step| step.log_likelihood);
    let highest = likelihoods.fold(f64::NEG_INFINITY, f64::max);
    let steps = offset.steps.iter();
    steps
        .flat_map(|step| [step.from, step.to].map(|at| (100.0 * at, step.log_likelihood - highest)))
        .collect()
}

fn interval(offset: &Offset, bottom: f64) -> Mark {
    let [low, high] = offset.interval.map(|end| 100.0 * end);
    Mark::Area {
        name: "95 % interval".into(),
        colour: GREEN,
        strength: 0.25,
        outline: vec![(low, bottom), (high, bottom), (high, 0.0), (low, 0.0)],
    }
}

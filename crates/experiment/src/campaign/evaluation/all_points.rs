//! The evaluation of all points of a campaign.

use serde::Serialize;

use super::offset::{Judgement, Offset, disagreeing, estimate_offset};
use super::recommend::{Recommendation, Tolerances, recommend};
use super::region::Region;
use crate::campaign::error::CampaignError;
use crate::campaign::grid::{Grid, GridPoint, stage_settings};
use crate::campaign::point::PointResult;
use bench_config::{Config, Sr4dofSettings};
use bench_identify::verdict::Cnmp;
use bench_plant::PlantError;
use bench_plant::zeros::cnmp_map;

/// Offsets are searched this far on both sides of the asymmetries of the grid, and the region of the model equally far.
const SEARCH_RANGE: f64 = 0.1;
/// Smallest asymmetry that a stage may have.
const MIN_ASYMMETRY: f64 = -0.9;
/// Number of operating points of the map.
const MAP_ROWS: usize = 81;
/// A point farther away than this many tolerances of the operating point does not affect a recommendation.
const MAX_TOLERANCES: f64 = 3.0;

/// A point with the prediction of the model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedPoint<'a> {
    /// Y1o/L.
    pub operating_point: f64,
    /// m2/m3 - 1 as intended.
    #[serde(rename = "mass_asymmetry")]
    pub asymmetry: f64,
    /// The verdict of the chirp.
    #[serde(flatten)]
    pub result: &'a PointResult,
    /// CNMP pairs of the model as configured, without damping.
    #[serde(rename = "model_cnmp_pairs")]
    pub model_pairs: u8,
    /// CNMP pairs of the model with damping.
    #[serde(rename = "model_damped_cnmp_pairs")]
    pub model_pairs_damped: u8,
    /// Whether the verdict disagrees with the zeros with damping of the simulated stage.
    #[serde(skip)]
    pub is_wrong: bool,
}

/// All points of a campaign, the offset and the recommendation.
#[derive(Clone, Debug)]
pub struct Evaluation<'a> {
    /// The model as configured.
    pub stage: &'a Sr4dofSettings,
    /// The grid.
    pub grid: &'a Grid,
    /// All points in the order of the grid.
    pub points: Vec<ComparedPoint<'a>>,
    /// The region with CNMP zeros by the model with damping, over the operating points of the map.
    pub region: Region,
    /// Number of verdicts that disagree with the model as configured.
    pub contradicted: usize,
    /// The estimated offset.
    pub offset: Option<Offset>,
    /// How exactly asymmetry and operating point can be set.
    pub tolerances: Tolerances,
    /// The recommended asymmetry.
    pub recommendation: Option<Recommendation>,
}

impl<'a> Evaluation<'a> {
    /// Evaluates the points of a campaign.
    pub fn of(
        config: &'a Config,
        grid: &'a Grid,
        done: &'a [(GridPoint, PointResult)],
        tolerances: Tolerances,
    ) -> Result<Evaluation<'a>, CampaignError> {
        let stage = stage_settings(config)?;
        let searched = searched(grid);
        let measured = Region::of(stage, &grid.operating_points, searched)?;
        let region = Region::of(stage, &map_rows(grid, tolerances), searched)?;
        let judgements = judgements(grid, done);
        let offset = estimate_offset(&measured, &judgements);
        // Asymmetries in whole mass steps within those of the grid.
        let (low, high) = ends(&grid.asymmetries);
        let candidates = mass_steps(low, high, grid.mass_step(stage));
        let (first, last) = ends(&grid.operating_points);
        let recommendation = recommend(
            &region,
            [first, last],
            &candidates,
            offset.as_ref().map_or([0.0, 0.0], |offset| offset.interval),
            tolerances,
            &judgements,
        );
        Ok(Evaluation {
            stage,
            grid,
            points: compared(stage, config.sim.asymmetry_offset, grid, done, &measured)?,
            region,
            contradicted: disagreeing(&measured, &judgements, 0.0),
            offset,
            tolerances,
            recommendation,
        })
    }

    /// The number of points with a verdict.
    pub fn count(&self, cnmp: Cnmp) -> usize {
        let equal = self.points.iter().filter(|point| point.result.cnmp == cnmp);
        equal.count()
    }
}

/// The verdict at a point, if it is decided.
fn judgement(grid: &Grid, point: GridPoint, result: &PointResult) -> Option<Judgement> {
    (result.cnmp != Cnmp::Undecided).then_some(Judgement {
        row: point.row,
        asymmetry: grid.asymmetries[point.column],
        detected: result.cnmp == Cnmp::Detected,
    })
}

fn judgements(grid: &Grid, done: &[(GridPoint, PointResult)]) -> Vec<Judgement> {
    let decided = done
        .iter()
        .filter_map(|(point, result)| judgement(grid, *point, result));
    decided.collect()
}

fn compared<'a>(
    stage: &Sr4dofSettings,
    simulated_offset: f64,
    grid: &Grid,
    done: &'a [(GridPoint, PointResult)],
    region: &Region,
) -> Result<Vec<ComparedPoint<'a>>, PlantError> {
    let pairs = cnmp_map(stage, &grid.operating_points, &grid.asymmetries, 1)?;
    let points = done.iter().map(|(point, result)| {
        let asymmetry = grid.asymmetries[point.column];
        let judgement = judgement(grid, *point, result);
        ComparedPoint {
            operating_point: grid.operating_points[point.row],
            asymmetry,
            result,
            model_pairs: pairs[point.row][point.column],
            model_pairs_damped: u8::from(region.contains(point.row, asymmetry)),
            is_wrong: judgement
                .is_some_and(|one| disagreeing(region, &[one], simulated_offset) > 0),
        }
    });
    Ok(points.collect())
}

/// The whole mass steps from low to high, as asymmetries.
fn mass_steps(low: f64, high: f64, step: f64) -> Vec<f64> {
    // A relative margin of 1e-9 includes both ends in spite of rounding.
    let first = libm::ceil(low / step - 1e-9) as i64;
    let last = libm::floor(high / step + 1e-9) as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

/// The range of asymmetries in which regions are searched.
fn searched(grid: &Grid) -> [f64; 2] {
    let (low, high) = ends(&grid.asymmetries);
    [(low - SEARCH_RANGE).max(MIN_ASYMMETRY), high + SEARCH_RANGE]
}

/// The operating points of the map: those of the grid, and those near enough to affect a recommendation.
fn map_rows(grid: &Grid, tolerances: Tolerances) -> Vec<f64> {
    let (first, last) = ends(&grid.operating_points);
    let margin = MAX_TOLERANCES * tolerances.operating_point;
    let (low, high) = (first - margin, last + margin);
    let row = |k: usize| low + (high - low) * k as f64 / (MAP_ROWS - 1) as f64;
    (0..MAP_ROWS).map(row).collect()
}

/// Smallest and largest value.
pub fn ends(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (low, high)
}

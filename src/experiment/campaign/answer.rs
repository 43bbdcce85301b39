//! What all points of a campaign say together.

use super::grid::settings;
use super::{
    CampaignError, Grid, Offset, Place, Point, Recommendation, Region, Said, Tolerances,
    contradicted, offset, recommend,
};
use crate::config::{Config, Sr4dofSettings};
use crate::identify::verdict::Cnmp;
use crate::model::plant::PlantError;
use crate::model::zeros::cnmp_map;

/// Offsets are looked for so far to both sides of the grid's asymmetries, and the model's region as far beyond them.
const REACH: f64 = 0.1;
/// The least asymmetry that a stage may have.
const LEAST: f64 = -0.9;
/// Operating points of the map.
const ROWS: usize = 81;
/// Beyond so many tolerances of the operating point nothing bears on a recommendation.
const BEYOND: f64 = 3.0;

/// A point, with what the model says of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Told<'a> {
    /// Where.
    pub place: Place,
    /// Y1o/L.
    pub operating_point: f64,
    /// m2/m3 - 1 as intended.
    pub asymmetry: f64,
    /// What the chirp said.
    pub point: &'a Point,
    /// CNMP pairs of the model as configured, without damping.
    pub model_pairs: u8,
    /// The same with damping.
    pub model_pairs_damped: u8,
    /// Whether the verdict is wrong: by the zeros with damping of the stage that was simulated.
    pub wrong: bool,
}

/// The whole campaign.
#[derive(Clone, Debug)]
pub struct Answer<'a> {
    /// The model as configured.
    pub settings: &'a Sr4dofSettings,
    /// Where was measured.
    pub grid: &'a Grid,
    /// All points in the order of the grid.
    pub points: Vec<Told<'a>>,
    /// Where the model with damping has CNMP zeros, over the operating points of the map.
    pub region: Region,
    /// Verdicts that the model as configured contradicts.
    pub contradicted: usize,
    /// The offset that fits best.
    pub offset: Option<Offset>,
    /// How exactly a person sets both.
    pub tolerances: Tolerances,
    /// The asymmetry to put on.
    pub recommendation: Option<Recommendation>,
}

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AnswerError {
    /// The model has no map.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
}

impl<'a> Answer<'a> {
    /// Of the points of a campaign.
    pub fn of(
        config: &'a Config,
        grid: &'a Grid,
        done: &'a [(Place, Point)],
        tolerances: Tolerances,
    ) -> Result<Answer<'a>, AnswerError> {
        let settings = settings(config)?;
        let (low, high) = ends(&grid.asymmetries);
        let searched = [(low - REACH).max(LEAST), high + REACH];
        let measured = Region::of(settings, &grid.operating_points, searched)?;
        let (first, last) = ends(&grid.operating_points);
        let beyond = BEYOND * tolerances.operating_point;
        let region = Region::of(
            settings,
            &even(first - beyond, last + beyond, ROWS),
            searched,
        )?;
        let said: Vec<Said> = done
            .iter()
            .filter_map(|(place, point)| said(grid, *place, point))
            .collect();
        let offset = offset(&measured, &said);
        let interval = offset.as_ref().map_or([0.0, 0.0], |offset| offset.interval);
        let candidates = steps(low, high, grid.mass_step(config));
        let recommendation = recommend(
            &region,
            [first, last],
            &candidates,
            interval,
            tolerances,
            &said,
        );
        let points = told(config, settings, grid, done, &measured)?;
        let contradicted = contradicted(&measured, &said, 0.0);
        Ok(Answer {
            settings,
            grid,
            points,
            region,
            contradicted,
            offset,
            tolerances,
            recommendation,
        })
    }

    /// How many points were judged so.
    pub fn count(&self, cnmp: Cnmp) -> usize {
        self.points
            .iter()
            .filter(|told| told.point.cnmp == cnmp)
            .count()
    }
}

/// A verdict that says yes or no.
fn said(grid: &Grid, place: Place, point: &Point) -> Option<Said> {
    let decided = point.cnmp != Cnmp::Undecided;
    let asymmetry = grid.asymmetries[place.column];
    decided.then_some(Said {
        row: place.row,
        asymmetry,
        detected: point.cnmp == Cnmp::Detected,
    })
}

fn told<'a>(
    config: &Config,
    settings: &Sr4dofSettings,
    grid: &Grid,
    done: &'a [(Place, Point)],
    measured: &Region,
) -> Result<Vec<Told<'a>>, PlantError> {
    let pairs = cnmp_map(settings, &grid.operating_points, &grid.asymmetries, 1)?;
    let made = config.sim.asymmetry_offset;
    let one = |(place, point): &'a (Place, Point)| Told {
        place: *place,
        operating_point: grid.operating_points[place.row],
        asymmetry: grid.asymmetries[place.column],
        point,
        model_pairs: pairs[place.row][place.column],
        model_pairs_damped: u8::from(measured.contains(place.row, grid.asymmetries[place.column])),
        wrong: said(grid, *place, point)
            .is_some_and(|one| contradicted(measured, &[one], made) > 0),
    };
    Ok(done.iter().map(one).collect())
}

/// Whole steps from low to high: what masses can make.
fn steps(low: f64, high: f64, step: f64) -> Vec<f64> {
    // A step of rounding more reaches both ends.
    let first = libm::ceil(low / step - 1e-9) as i64;
    let last = libm::floor(high / step + 1e-9) as i64;
    (first..=last).map(|k| k as f64 * step).collect()
}

fn even(low: f64, high: f64, count: usize) -> Vec<f64> {
    (0..count)
        .map(|k| low + (high - low) * k as f64 / (count - 1) as f64)
        .collect()
}

fn ends(values: &[f64]) -> (f64, f64) {
    values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(*x), high.max(*x))
        })
}

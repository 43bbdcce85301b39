//! The grid of a campaign.

use serde::{Deserialize, Serialize};

use super::error::CampaignError;
use bench_config::{Config, PlantSettings, Sr4dofSettings, validate};

/// Largest number of points; the chirp of each point takes minutes.
const MAX_POINTS: usize = 10_000;
/// Masses are added in these steps (section 5.2.1), in kilograms.
pub(super) const MASS_STEP_KG: f64 = 0.0005;
/// Number of seeds that a configuration allows.
const SEEDS: u64 = 1 << 63;

/// Operating points, one row each, by mass asymmetries, one column each.
///
/// ```
/// use bench_config::{Source, load};
/// use bench_experiment::campaign::Grid;
///
/// let config = load(&Source::default()).unwrap();
/// let grid = Grid::new(vec![0.0, 0.04, 0.08], vec![-0.05, 0.05], &config).unwrap();
/// assert_eq!(grid.points().count(), 6);
/// assert!(Grid::new(vec![2.0], vec![0.0], &config).is_err(), "beyond the length of the beams");
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Y1o/L, ratios.
    pub operating_points: Vec<f64>,
    /// m2/m3 - 1 as intended, ratios.
    pub asymmetries: Vec<f64>,
}

/// A point of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct GridPoint {
    /// Index of its operating point.
    pub row: usize,
    /// Index of its asymmetry.
    pub column: usize,
}

impl Grid {
    /// A grid for the stage of a configuration. Refuses a model without operating point and asymmetry, more than 10,000
    /// points, and values that the configuration does not allow.
    pub fn new(
        operating_points: Vec<f64>,
        asymmetries: Vec<f64>,
        config: &Config,
    ) -> Result<Grid, CampaignError> {
        let grid = Grid {
            operating_points,
            asymmetries,
        };
        let count = grid.operating_points.len() * grid.asymmetries.len();
        if !(1..=MAX_POINTS).contains(&count) {
            return Err(CampaignError::Grid(format!(
                "the grid has {count} points, a campaign has from 1 to {MAX_POINTS}; use fewer values"
            )));
        }
        stage_settings(config)?;
        // Every range of a setting is an interval: if the corners are allowed, so are all points between them.
        for corner in grid.corners() {
            grid.config_at(config, corner)?;
        }
        Ok(grid)
    }

    fn corners(&self) -> impl Iterator<Item = GridPoint> {
        let (last_row, last_column) = (self.operating_points.len() - 1, self.asymmetries.len() - 1);
        let rows = [0, last_row].into_iter();
        rows.flat_map(move |row| [0, last_column].map(|column| GridPoint { row, column }))
    }

    /// The asymmetry of one mass step, as a ratio of m3.
    pub fn mass_step(&self, stage: &Sr4dofSettings) -> f64 {
        MASS_STEP_KG / stage.secondary_stage_mass_kg
    }

    /// All points, row by row.
    pub fn points(&self) -> impl Iterator<Item = GridPoint> + '_ {
        let columns = self.asymmetries.len();
        (0..self.operating_points.len())
            .flat_map(move |row| (0..columns).map(move |column| GridPoint { row, column }))
    }

    /// The configuration at a point: that of the campaign, with a seed that depends on the point alone.
    pub fn config_at(&self, config: &Config, point: GridPoint) -> Result<Config, CampaignError> {
        let stage = stage_settings(config)?;
        let mut there = config.clone();
        there.plant = PlantSettings::Sr4dof(Sr4dofSettings {
            operating_point_m: self.operating_points[point.row] * stage.beam_length_m,
            mass_asymmetry: self.asymmetries[point.column],
            ..stage.clone()
        });
        let index = point.row * self.asymmetries.len() + point.column;
        there.sim.seed = config.sim.seed.wrapping_add(index as u64) % SEEDS;
        validate(&there).map_err(|error| {
            CampaignError::Grid(format!(
                "the grid exceeds an allowed range; narrow it: {error}"
            ))
        })?;
        Ok(there)
    }
}

/// The settings of SR4DoF, the only model with operating point and mass asymmetry.
pub fn stage_settings(config: &Config) -> Result<&Sr4dofSettings, CampaignError> {
    match &config.plant {
        PlantSettings::Sr4dof(settings) => Ok(settings),
        other => Err(CampaignError::Grid(format!(
            "a campaign varies operating point and mass asymmetry, but the model `{}` does not have both; use a profile with \
             the model `sr4dof` (--config stage, --config chapter2)",
            other.model()
        ))),
    }
}

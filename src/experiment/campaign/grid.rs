//! Where a campaign measures.

use serde::{Deserialize, Serialize};

use super::CampaignError;
use crate::config::{Config, PlantSettings, Sr4dofSettings, validate};

/// Points, at most: each takes a chirp of minutes.
const MOST: usize = 10_000;
/// Masses are put on in such steps (section 5.2.1), in kilograms.
pub(super) const MASS_STEP_KG: f64 = 0.0005;
/// Seeds that a configuration may have.
const SEEDS: u64 = 1 << 63;

/// Operating points, a row each, by mass asymmetries, a column each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Grid {
    /// Y1o/L, ratios.
    pub operating_points: Vec<f64>,
    /// m2/m3 - 1 as intended, ratios.
    pub asymmetries: Vec<f64>,
}

/// A point of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Place {
    /// Index of its operating point.
    pub row: usize,
    /// Index of its asymmetry.
    pub column: usize,
}

impl Grid {
    /// A grid for the stage of a configuration: refuses a model without operating point and asymmetry, more than 10,000
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
        if !(1..=MOST).contains(&count) {
            return Err(CampaignError::Grid(format!(
                "{count} points; a campaign has from 1 to {MOST}: take fewer"
            )));
        }
        settings(config)?;
        // Every range of a setting is an interval: what the values at the ends may be, those between may be.
        for place in grid.places() {
            if (place.row == 0 || place.row + 1 == grid.operating_points.len())
                && (place.column == 0 || place.column + 1 == grid.asymmetries.len())
            {
                grid.config(config, place)?;
            }
        }
        Ok(grid)
    }

    /// The asymmetry that the smallest mass makes, a ratio of m3.
    pub fn mass_step(&self, config: &Config) -> f64 {
        settings(config).map_or(MASS_STEP_KG, |settings| {
            MASS_STEP_KG / settings.secondary_stage_mass_kg
        })
    }

    /// All points, row by row.
    pub fn places(&self) -> impl Iterator<Item = Place> + '_ {
        let columns = self.asymmetries.len();
        (0..self.operating_points.len())
            .flat_map(move |row| (0..columns).map(move |column| Place { row, column }))
    }

    /// The configuration of a point: that of the campaign there, with a seed of its own, which is the point's alone.
    pub fn config(&self, config: &Config, place: Place) -> Result<Config, CampaignError> {
        let mut there = config.clone();
        let settings = Sr4dofSettings {
            operating_point_m: self.operating_points[place.row] * settings(config)?.beam_length_m,
            mass_asymmetry: self.asymmetries[place.column],
            ..settings(config)?.clone()
        };
        there.plant = PlantSettings::Sr4dof(settings);
        let index = place.row * self.asymmetries.len() + place.column;
        there.sim.seed = config.sim.seed.wrapping_add(index as u64) % SEEDS;
        validate(&there).map_err(|error| {
            CampaignError::Grid(format!("the grid leaves what is allowed: {error}"))
        })?;
        Ok(there)
    }
}

/// The settings of the one model that has operating point and asymmetry.
pub(super) fn settings(config: &Config) -> Result<&Sr4dofSettings, CampaignError> {
    of_plant(&config.plant)
}

/// The same of a model by itself.
pub(super) fn of_plant(plant: &PlantSettings) -> Result<&Sr4dofSettings, CampaignError> {
    match plant {
        PlantSettings::Sr4dof(settings) => Ok(settings),
        other => Err(CampaignError::Grid(format!(
            "a campaign is over operating point and mass asymmetry, which the model `{}` does not have both; take one of \
             `sr4dof` (--config stage, --config chapter2)",
            other.model()
        ))),
    }
}

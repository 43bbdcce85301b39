//! The plants of the model for which `bench tune` designs.

use super::error::CliError;
use bench_base::quantity::{OperatingPoint, QuantityError};
use bench_config::{Config, OptionSetting, Purpose};
use bench_control::tuning::NamedPlant;
use bench_order::BenchOptions;

/// Name of the plant of a model without operating points.
const ONLY_PLANT: &str = "the plant";
/// Operating points, from 0 to the configured one, if none are given.
const DEFAULT_POINTS: u32 = 5;

/// Options that choose the plants.
#[derive(Clone, Copy, Debug)]
pub(super) struct ModelOptions<'a> {
    /// Configuration and its options.
    pub bench: &'a BenchOptions,
    /// The operating points of `--operating-points`.
    pub operating_points: &'a [OperatingPoint],
}

/// The plant at each operating point, or the configured one if it has none; `more` are further settings.
pub(super) fn model_plants(
    options: &ModelOptions<'_>,
    config: &Config,
    more: &[OptionSetting],
) -> Result<Vec<NamedPlant>, CliError> {
    if options.bench.operating_point.is_some() {
        return Err(CliError::Usage(
            "--operating-point is one point, but a design is for several ones; use --operating-points".into(),
        ));
    }
    let points_m = points_m(options, config)?;
    if points_m.is_empty() {
        let plant = options.bench.load(Purpose::Model, more)?.plant;
        return Ok(vec![NamedPlant::of(ONLY_PLANT, &plant)?]);
    }
    let plants = points_m
        .into_iter()
        .map(|point_m| plant_at(options, point_m, more));
    plants.collect()
}

/// The operating points in metres; none for a plant without them.
fn points_m(options: &ModelOptions<'_>, config: &Config) -> Result<Vec<f64>, CliError> {
    let configured = config.plant.operating_point_m();
    let usage = |error: QuantityError| CliError::Usage(error.to_string());
    match (options.operating_points.is_empty(), configured) {
        (true, Some(end_m)) => {
            let parts = f64::from(DEFAULT_POINTS - 1);
            Ok((0..DEFAULT_POINTS)
                .map(|i| end_m * f64::from(i) / parts)
                .collect())
        }
        (true, None) => Ok(Vec::new()),
        (false, None) => Err(CliError::Usage(format!(
            "--operating-points is not for the model `{}`, which has no operating point; leave it out",
            config.plant.model()
        ))),
        (false, Some(_)) => {
            let length_m = config.plant.beam_length_m();
            let points = options.operating_points.iter();
            points
                .map(|point| point.metres(length_m).map_err(usage))
                .collect()
        }
    }
}

fn plant_at(
    options: &ModelOptions<'_>,
    point_m: f64,
    more: &[OptionSetting],
) -> Result<NamedPlant, CliError> {
    let mut settings = more.to_vec();
    settings.push(OptionSetting::new(
        "plant.operating_point_m",
        point_m,
        "--operating-points",
    ));
    let plant = options.bench.load(Purpose::Model, &settings)?.plant;
    let name = plant.operating_point_name();
    let name = name.unwrap_or_else(|| ONLY_PLANT.into());
    Ok(NamedPlant::of(&name, &plant)?)
}

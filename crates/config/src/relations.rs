//! Relations between the settings of the plant and those of the simulated stage.

use super::{Config, Geometry, PlantSettings};
use bench_base::finding::Finding;

/// Errors in the relations between the settings of a plant and those of its simulation.
pub(super) fn plant(config: &Config) -> Vec<Finding> {
    let mut findings = config.plant.check();
    if config.sim.geometry == Geometry::Quadratic
        && !matches!(config.plant, PlantSettings::Sr4dof(_))
    {
        let model = config.plant.model();
        let what = format!(
            "is \"quadratic\", which is simulated only for the model `sr4dof`, not for `{model}`; use \"linear\""
        );
        findings.push(Finding::new("sim.geometry", what));
    }
    findings.extend(asymmetry_offset(config));
    findings.extend(frequency_ratio(config));
    findings
}

fn frequency_ratio(config: &Config) -> Option<Finding> {
    let ratio = config.sim.frequency_ratio;
    let is_refused = ratio != 1.0 && config.sim.geometry == Geometry::Quadratic;
    let what = format!("is {ratio}, which is simulated only with sim.geometry = \"linear\"; set 1");
    is_refused.then(|| Finding::new("sim.frequency_ratio", what))
}

/// Smallest m2/m3 - 1 of the simulated stage: the lower limit of `plant.mass_asymmetry`.
const MIN_ASYMMETRY: f64 = -0.9;

fn asymmetry_offset(config: &Config) -> Option<Finding> {
    let offset = config.sim.asymmetry_offset;
    let model = config.plant.model();
    let Some(asymmetry) = config.plant.mass_asymmetry() else {
        let what = format!("is {offset}, but the model `{model}` has no mass asymmetry; set 0");
        return (offset != 0.0).then(|| Finding::new("sim.asymmetry_offset", what));
    };
    let what = format!(
        "is {offset}, which together with plant.mass_asymmetry = {asymmetry} is below {MIN_ASYMMETRY}, where m2 is too small; raise one of the two"
    );
    (asymmetry + offset < MIN_ASYMMETRY).then(|| Finding::new("sim.asymmetry_offset", what))
}

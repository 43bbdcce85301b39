//! What no single setting of a plant can say.

use super::check::Finding;
use super::{
    Config, ConfigError, Geometry, LumpedSettings, ModalSettings, PlantSettings, SpringSettings,
};
use crate::util::nearest::nearest;

/// The name that no node may have.
pub(crate) const GROUND: &str = "ground";

/// All that is wrong between the settings of a plant.
pub(super) fn plant(config: &Config) -> Vec<Finding> {
    let mut findings = of(&config.plant);
    if config.sim.geometry == Geometry::Quadratic
        && !matches!(config.plant, PlantSettings::Sr4dof(_))
    {
        let model = config.plant.model();
        let what = format!(
            "is \"quadratic\", which is simulated for the model `sr4dof` alone, not for `{model}`; take \"linear\""
        );
        findings.push(finding("sim.geometry", what));
    }
    findings.extend(asymmetry_offset(config));
    findings
}

/// Least m2/m3 - 1 of the simulated stage: the least that `plant.mass_asymmetry` may be.
const LEAST_ASYMMETRY: f64 = -0.9;

fn asymmetry_offset(config: &Config) -> Option<Finding> {
    let offset = config.sim.asymmetry_offset;
    let model = config.plant.model();
    let Some(asymmetry) = config.plant.mass_asymmetry() else {
        let what = format!("is {offset}, but the model `{model}` has no mass asymmetry; set 0");
        return (offset != 0.0).then(|| finding("sim.asymmetry_offset", what));
    };
    let what = format!(
        "is {offset}, which with plant.mass_asymmetry = {asymmetry} is below {LEAST_ASYMMETRY}: too little is left of m2"
    );
    (asymmetry + offset < LEAST_ASYMMETRY).then(|| finding("sim.asymmetry_offset", what))
}

/// Refuses a plant whose settings, each within its range, do not go together.
pub(crate) fn check_plant_relations(plant: &PlantSettings) -> Result<(), ConfigError> {
    let findings = of(plant);
    let line = |finding: &Finding| format!("  `{}` {}", finding.path, finding.what);
    if findings.is_empty() {
        Ok(())
    } else {
        Err(ConfigError::Refused(findings.iter().map(line).collect()))
    }
}

fn of(plant: &PlantSettings) -> Vec<Finding> {
    let mut findings = operating_point(plant);
    match plant {
        PlantSettings::Lumped(plant) => findings.extend(lumped(plant)),
        PlantSettings::Modal(plant) => findings.extend(modal(plant)),
        PlantSettings::Sr4dof(_) | PlantSettings::Xy(_) => {}
    }
    findings
}

fn finding(path: &str, what: String) -> Finding {
    Finding {
        path: path.into(),
        what,
        missing: false,
    }
}

fn operating_point(plant: &PlantSettings) -> Vec<Finding> {
    let (Some(point_m), Some(length_m)) = (plant.operating_point_m(), plant.beam_length_m()) else {
        return Vec::new();
    };
    let what = || format!("is {point_m} m, beyond the length of the beams, {length_m} m");
    if point_m.abs() <= length_m {
        Vec::new()
    } else {
        vec![finding("plant.operating_point_m", what())]
    }
}

fn lumped(plant: &LumpedSettings) -> Vec<Finding> {
    let mut findings: Vec<Finding> = plant
        .nodes
        .iter()
        .filter_map(|(name, node)| massless(name, node.mass_kg))
        .collect();
    findings.extend(
        plant
            .springs
            .iter()
            .flat_map(|(name, spring)| ends(plant, name, spring)),
    );
    for (key, weight, all_zero) in [
        (
            "actuator",
            "force",
            plant.nodes.values().all(|node| node.actuator == 0.0),
        ),
        (
            "sensor",
            "displacement",
            plant.nodes.values().all(|node| node.sensor == 0.0),
        ),
    ] {
        if all_zero {
            let what =
                format!("give no node a part in the {weight}; set `{key}` of at least one node");
            findings.push(finding("plant.nodes", what));
        }
    }
    if findings.is_empty() {
        free_bodies(plant)
    } else {
        findings
    }
}

fn massless(name: &str, mass_kg: f64) -> Option<Finding> {
    let path = format!("plant.nodes.{name}");
    if name == GROUND {
        return Some(finding(
            &path,
            "has the name of what does not move; call the node something else".into(),
        ));
    }
    let what = "is 0: where a node without mass goes is not defined; give it a mass, or join the springs that meet there";
    (mass_kg == 0.0).then(|| finding(&format!("{path}.mass_kg"), what.into()))
}

fn ends(plant: &LumpedSettings, name: &str, spring: &SpringSettings) -> Vec<Finding> {
    let path = format!("plant.springs.{name}.between");
    let known = || plant.nodes.keys().map(String::as_str).chain([GROUND]);
    let unknown = spring
        .between
        .iter()
        .filter(|end| !known().any(|node| node == end.as_str()))
        .map(|end| {
            let hint = nearest(end, known()).unwrap_or(GROUND);
            finding(
                &path,
                format!("names the node `{end}`, which is not there; the nearest is `{hint}`"),
            )
        });
    let mut findings: Vec<Finding> = unknown.collect();
    if spring.between[0] == spring.between[1] {
        findings.push(finding(
            &path,
            format!("joins `{}` to itself", spring.between[0]),
        ));
    }
    findings
}

fn free_bodies(plant: &LumpedSettings) -> Vec<Finding> {
    let free = plant.free();
    if free.len() == plant.free_bodies {
        return Vec::new();
    }
    let bodies: Vec<String> = free
        .iter()
        .map(|body| format!("[{}]", body.join(" ")))
        .collect();
    let there = if bodies.is_empty() {
        "every node is held by ground".into()
    } else {
        format!("free are {}", bodies.join(", "))
    };
    let remedy = "join them to ground by a spring, or state how many are meant to be free";
    let what = format!(
        "is {}, but {} hang on no spring to ground: {there}; {remedy}",
        plant.free_bodies,
        free.len()
    );
    vec![finding("plant.free_bodies", what)]
}

fn modal(plant: &ModalSettings) -> Vec<Finding> {
    let mut findings = Vec::new();
    if plant.modes.values().all(|mode| mode.residue_per_kg == 0.0) {
        let what = "have no residue that is not zero: no force would reach the probe; give at least one `residue_per_kg`";
        findings.push(finding("plant.modes", what.into()));
    }
    for (name, mode) in &plant.modes {
        if mode.omega_rad_s == 0.0 && mode.damping_ratio != 0.0 {
            let path = format!("plant.modes.{name}.damping_ratio");
            findings.push(finding(
                &path,
                format!(
                    "is {}, but a double integrator has none; set 0",
                    mode.damping_ratio
                ),
            ));
        }
    }
    findings
}

impl LumpedSettings {
    /// The bodies that no spring holds to ground, each as the names of its nodes. A spring of 0 N/m joins nothing.
    pub(crate) fn free(&self) -> Vec<Vec<&str>> {
        let mut left: Vec<&str> = self.nodes.keys().map(String::as_str).collect();
        let mut free = Vec::new();
        while let Some(first) = left.first().copied() {
            let body = self.joined_to(first);
            left.retain(|node| !body.contains(node));
            if !body.contains(&GROUND) {
                free.push(body);
            }
        }
        free
    }

    /// What springs join to `start`, itself included. The search ends at ground, which moves with nothing.
    fn joined_to<'a>(&'a self, start: &'a str) -> Vec<&'a str> {
        let mut body = vec![start];
        let mut next = 0;
        while next < body.len() {
            let node = body[next];
            next += 1;
            let joins = |spring: &&SpringSettings| spring.stiffness_n_per_m > 0.0 && node != GROUND;
            for [one, other] in self
                .springs
                .values()
                .filter(joins)
                .map(|spring| &spring.between)
            {
                let end = if one == node {
                    other.as_str()
                } else if other == node {
                    one.as_str()
                } else {
                    continue;
                };
                if !body.contains(&end) {
                    body.push(end);
                }
            }
        }
        body
    }
}

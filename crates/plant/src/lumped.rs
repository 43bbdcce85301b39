//! Masses that move along one line, joined by springs: M diagonal, K = sum of k d d^T with d = e_i - e_j (or e_i, to ground).
//!
//! Coordinates in the order of the nodes' names. The floor moves along the same line.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::structure::Assembly;
use super::{DampingSettings, PlantModel, Port, Structure};
use bench_base::finding::Finding;
use bench_base::nearest::nearest;

/// The name of the fixed end of a spring, which no node may have.
const GROUND: &str = "ground";

/// Masses that move along one line, and springs between them or to ground. Coordinates in the order of the names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LumpedSettings {
    /// The masses by name, each with its part in force and displacement.
    pub nodes: BTreeMap<String, NodeSettings>,
    /// The springs by name.
    pub springs: BTreeMap<String, SpringSettings>,
    /// Number of bodies without a spring to ground; each moves freely, at a frequency of zero.
    #[serde(default)]
    #[schemars(range(min = 0, max = 64))]
    pub free_bodies: usize,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

/// A mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeSettings {
    /// Mass in kilograms, above zero.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub mass_kg: f64,
    /// Force on it per newton of the actuator.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub actuator: f64,
    /// Displacement at the probe per metre of displacement of this mass.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub sensor: f64,
}

/// A spring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringSettings {
    /// The two ends, each a node or `ground`.
    pub between: [String; 2],
    /// Stiffness in newtons per metre; 0 is no connection.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub stiffness_n_per_m: f64,
}

impl LumpedSettings {
    fn node_index(&self, name: &str) -> Option<usize> {
        self.nodes.keys().position(|node| node == name)
    }

    fn weights(&self, weight: fn(&NodeSettings) -> f64) -> Vec<f64> {
        self.nodes.values().map(weight).collect()
    }

    /// e_i of a node.
    fn unit(&self, index: usize) -> Vec<f64> {
        let mut row = vec![0.0; self.nodes.len()];
        row[index] = 1.0;
        row
    }

    /// d of a spring. A name that is not a node is ground; the configuration check has rejected all other names.
    fn elongation(&self, spring: &SpringSettings) -> Vec<f64> {
        let mut along = vec![0.0; self.nodes.len()];
        for (end, sign) in spring.between.iter().zip([1.0, -1.0]) {
            if let Some(index) = self.node_index(end) {
                along[index] += sign;
            }
        }
        along
    }

    /// The bodies that no spring holds to ground, each as the names of its nodes. A spring of 0 N/m joins nothing.
    fn free(&self) -> Vec<Vec<&str>> {
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

    /// All nodes that springs join to `start`, itself included. The search ends at ground.
    fn joined_to<'a>(&'a self, start: &'a str) -> Vec<&'a str> {
        let mut body = vec![start];
        let mut next = 0;
        while next < body.len() {
            for end in self.neighbours(body[next]) {
                if !body.contains(&end) {
                    body.push(end);
                }
            }
            next += 1;
        }
        body
    }

    /// The other ends of all springs at a node; none of ground.
    fn neighbours<'a>(&'a self, node: &'a str) -> impl Iterator<Item = &'a str> {
        let springs = self.springs.values();
        let joining = springs.filter(move |s| s.stiffness_n_per_m > 0.0 && node != GROUND);
        joining.filter_map(move |spring| match &spring.between {
            [one, other] if one == node => Some(other.as_str()),
            [one, other] if other == node => Some(one.as_str()),
            _ => None,
        })
    }

    fn check_nodes(&self) -> Vec<Finding> {
        let nodes = self.nodes.iter();
        let mut findings: Vec<Finding> = nodes
            .filter_map(|(name, node)| check_node(name, node.mass_kg))
            .collect();
        let weights = [
            ("actuator", "force", self.weights(|node| node.actuator)),
            ("sensor", "displacement", self.weights(|node| node.sensor)),
        ];
        for (key, quantity, weights) in weights {
            if weights.iter().all(|weight| *weight == 0.0) {
                findings.push(Finding::new(
                    "plant.nodes",
                    format!("assign the {quantity} to no node; set `{key}` of at least one node"),
                ));
            }
        }
        findings
    }

    fn check_spring(&self, name: &str, spring: &SpringSettings) -> Vec<Finding> {
        let path = format!("plant.springs.{name}.between");
        let [one, other] = &spring.between;
        let unknown = spring.between.iter().filter_map(|end| self.check_end(end));
        let looped = (one == other).then(|| format!("joins `{one}` to itself; name two ends"));
        let findings = unknown.chain(looped);
        findings.map(|what| Finding::new(&path, what)).collect()
    }

    /// The error of a spring's end that is neither a node nor ground.
    fn check_end(&self, end: &str) -> Option<String> {
        let mut known = self.nodes.keys().map(String::as_str).chain([GROUND]);
        let hint = nearest(end, known.clone()).unwrap_or(GROUND);
        (!known.any(|node| node == end)).then(|| {
            format!("names the node `{end}`, which does not exist; check the spelling (the nearest is `{hint}`)")
        })
    }

    fn check_free_bodies(&self) -> Option<Finding> {
        let (stated, free) = (self.free_bodies, self.free());
        let (count, found) = (free.len(), named_bodies(&free));
        (count != stated).then(|| {
            Finding::new(
                "plant.free_bodies",
                format!(
                    "is {stated}, but {count} bodies have no spring to ground: {found}; \
                     join them to ground by a spring, or set this to the number of bodies that are meant to be free"
                ),
            )
        })
    }
}

fn named_bodies(bodies: &[Vec<&str>]) -> String {
    if bodies.is_empty() {
        return "springs join every node to ground".into();
    }
    let names: Vec<String> = bodies
        .iter()
        .map(|body| format!("[{}]", body.join(" ")))
        .collect();
    format!("free are {}", names.join(", "))
}

fn check_node(name: &str, mass_kg: f64) -> Option<Finding> {
    let path = format!("plant.nodes.{name}");
    if name == GROUND {
        let what = "has the name of the fixed end of a spring; give the node another name";
        return Some(Finding::new(&path, what));
    }
    let what = "is 0, which leaves the motion of the node undefined; give it a mass, or join the springs that meet there";
    (mass_kg == 0.0).then(|| Finding::new(&format!("{path}.mass_kg"), what))
}

impl PlantModel for LumpedSettings {
    fn coordinates(&self) -> Vec<&str> {
        self.nodes.keys().map(String::as_str).collect()
    }

    fn check(&self) -> Vec<Finding> {
        let mut findings = self.check_nodes();
        for (name, spring) in &self.springs {
            findings.extend(self.check_spring(name, spring));
        }
        if findings.is_empty() {
            findings.extend(self.check_free_bodies());
        }
        findings
    }

    fn undamped(&self) -> Structure {
        let mut parts = Assembly::new(self.nodes.len());
        let still = vec![0.0; self.nodes.len()];
        for (index, node) in self.nodes.values().enumerate() {
            parts.add_mass(node.mass_kg, &self.unit(index), &still);
        }
        for spring in self.springs.values() {
            parts.add_spring(spring.stiffness_n_per_m, &self.elongation(spring));
        }
        let force = self.weights(|node| node.actuator);
        let sensor = self.weights(|node| node.sensor);
        Structure {
            free_bodies: self.free().len(),
            ..parts.into_structure(&force, &sensor)
        }
    }

    fn damping_settings(&self) -> Option<&DampingSettings> {
        Some(&self.damping)
    }

    /// The displacement of each node.
    fn ports(&self) -> Vec<Port> {
        let names = self.nodes.keys().enumerate();
        names
            .map(|(index, name)| Port::new(name, &self.unit(index)))
            .collect()
    }
}

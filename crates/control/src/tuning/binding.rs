//! The requirements that limit a design, and where.

use std::fmt;

use serde::Serialize;

use super::requirement::{Kind, Slack};
use super::sampled::SampledPlant;

/// A requirement that is fulfilled with almost no slack.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Binding {
    /// What is required.
    pub requirement: Kind,
    /// The plant.
    pub plant: String,
    /// The frequency in rad/s; `None` of a requirement on the whole spectrum.
    pub frequency_rad_s: Option<f64>,
    /// The slack relative to the limit.
    pub slack: f64,
}

impl Binding {
    /// Whether another one has another kind, or is at another frequency (by more than 5 %).
    pub fn differs(&self, other: &Binding) -> bool {
        let far = match (self.frequency_rad_s, other.frequency_rad_s) {
            (Some(a), Some(b)) => (a / b - 1.0).abs() > 0.05,
            (a, b) => a.is_some() != b.is_some(),
        };
        self.requirement != other.requirement || far
    }
}

impl fmt::Display for Binding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {}", self.requirement, self.plant)?;
        match self.frequency_rad_s {
            Some(w) => write!(f, " at {w:.1} rad/s"),
            None => Ok(()),
        }
    }
}

/// The requirements with a slack below `limit`, the tightest first: one for each valley over frequency, and of the same kind and
/// frequency only the tightest plant.
pub fn tightest(slacks: &[Slack], plants: &[SampledPlant], limit: f64) -> Vec<Binding> {
    let mut tight: Vec<&Slack> = valleys(slacks)
        .filter(|slack| slack.value < limit)
        .collect();
    tight.sort_by(|a, b| a.value.total_cmp(&b.value));
    tight
        .into_iter()
        .map(|slack| {
            let plant = &plants[slack.plant];
            Binding {
                requirement: slack.kind,
                plant: plant.name.clone(),
                frequency_rad_s: plant.omega_rad_s.get(slack.point).copied(),
                slack: slack.value,
            }
        })
        .collect()
}

/// The slacks that are not above those at the neighbouring frequencies of the same kind and plant.
pub fn valleys(slacks: &[Slack]) -> impl Iterator<Item = &Slack> {
    let mut sorted: Vec<&Slack> = slacks.iter().collect();
    sorted.sort_by_key(|slack| (slack.kind, slack.plant, slack.point));
    let is_lower = |a: &Slack, b: Option<&&Slack>| {
        b.is_none_or(|b| (a.kind, a.plant) != (b.kind, b.plant) || a.value <= b.value)
    };
    let indices = (0..sorted.len()).filter(|i| {
        let before = i.checked_sub(1).and_then(|before| sorted.get(before));
        is_lower(sorted[*i], before) && is_lower(sorted[*i], sorted.get(i + 1))
    });
    let lowest: Vec<&Slack> = indices.map(|i| sorted[i]).collect();
    lowest.into_iter()
}

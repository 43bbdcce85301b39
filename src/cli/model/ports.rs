//! Places of actuator and probe as typed: `x4`, or weights `u=0.117,b=0.5606`.

use nalgebra::DVector;

use super::super::error::CliError;
use crate::model::plant::Port;

/// A sum of ports with their weights, by place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Weights(Vec<(usize, f64)>);

impl Weights {
    /// Reads what `option` was given.
    pub fn parse(option: &str, text: &str, ports: &[Port]) -> Result<Weights, CliError> {
        let weights = text
            .split(',')
            .map(|part| one(option, part.trim(), ports))
            .collect::<Result<Vec<_>, _>>()?;
        if weights.iter().all(|(_, weight)| *weight == 0.0) {
            return Err(CliError::Usage(format!(
                "{option} {text}: a vector of zeros reaches nothing; give some weight other than 0"
            )));
        }
        Ok(Weights(weights))
    }

    /// The vector over the degrees of freedom.
    pub fn row(&self, ports: &[Port]) -> DVector<f64> {
        let zero = DVector::zeros(ports.first().map_or(0, |port| port.row.len()));
        self.0.iter().fold(zero, |sum, (place, weight)| {
            sum + *weight * &ports[*place].row
        })
    }
}

fn one(option: &str, part: &str, ports: &[Port]) -> Result<(usize, f64), CliError> {
    let (name, weight) = part.split_once('=').unwrap_or((part, "1"));
    let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
    let place = names
        .iter()
        .position(|known| *known == name)
        .ok_or_else(|| {
            let nearest = names
                .iter()
                .max_by(|a, b| strsim::jaro(a, name).total_cmp(&strsim::jaro(b, name)));
            let hint = nearest.map_or(String::new(), |nearest| {
                format!("; did you mean {nearest}?")
            });
            CliError::Usage(format!(
                "{option} {name}: no such place, this plant has {}{hint}",
                names.join(" ")
            ))
        })?;
    let weight = weight
        .parse()
        .ok()
        .filter(|weight: &f64| weight.is_finite());
    let weight = weight.ok_or_else(|| {
        CliError::Usage(format!(
            "{option} {part}: a weight is a number, as in {name}=0.5"
        ))
    })?;
    Ok((place, weight))
}

//! Places where a force may act and a probe may measure.

use nalgebra::DVector;

use bench_base::nearest::nearest;

/// The displacement row^T z of a stage. A force along it is the generalised force row.
#[derive(Clone, Debug, PartialEq)]
pub struct Port {
    /// Stage or node, with the axis where it has two: `x4`, `y_ms`, `m2`.
    pub name: String,
    /// Coefficients of the degrees of freedom; all zero where the stage cannot move.
    pub row: DVector<f64>,
}

impl Port {
    pub(super) fn new(name: &str, row: &[f64]) -> Port {
        Port {
            name: name.into(),
            row: DVector::from_row_slice(row),
        }
    }
}

/// A weighted sum of ports, as in `x4` or `u=0.117,b=0.5606`.
#[derive(Clone, Debug, PartialEq)]
pub struct PortWeights(Vec<(usize, f64)>);

impl PortWeights {
    /// Reads `NAME` or `NAME=WEIGHT`, separated by commas. The error states the reason and the remedy.
    pub fn parse(text: &str, ports: &[Port]) -> Result<PortWeights, String> {
        let weights = text
            .split(',')
            .map(|part| parse_weight(part.trim(), ports))
            .collect::<Result<Vec<_>, _>>()?;
        if weights.iter().all(|(_, weight)| *weight == 0.0) {
            return Err(format!(
                "{text}: all weights are 0; give at least one weight other than 0"
            ));
        }
        Ok(PortWeights(weights))
    }

    /// The row over the degrees of freedom.
    pub fn row(&self, ports: &[Port]) -> DVector<f64> {
        let zero = DVector::zeros(ports.first().map_or(0, |port| port.row.len()));
        let add = |sum, (place, weight): &(usize, f64)| sum + *weight * &ports[*place].row;
        self.0.iter().fold(zero, add)
    }
}

fn parse_weight(part: &str, ports: &[Port]) -> Result<(usize, f64), String> {
    let (name, weight) = part.split_once('=').unwrap_or((part, "1"));
    let place = ports.iter().position(|port| port.name == name);
    let place = place.ok_or_else(|| unknown_port(name, ports))?;
    let weight = weight
        .parse()
        .ok()
        .filter(|weight: &f64| weight.is_finite());
    let weight = weight.ok_or_else(|| {
        format!("{part}: the weight is not a number; write for example {name}=0.5")
    })?;
    Ok((place, weight))
}

fn unknown_port(name: &str, ports: &[Port]) -> String {
    let names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
    let nearest = nearest(name, names.iter().copied());
    let hint = nearest.map_or(String::new(), |nearest| {
        format!(" (did you mean {nearest}?)")
    });
    format!(
        "{name}: no such place; choose one of {}{hint}",
        names.join(" ")
    )
}

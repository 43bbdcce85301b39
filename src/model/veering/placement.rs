//! What becomes of the zeros with actuator and probe elsewhere: one placement tried on the model, and foretold by the picture.

use nalgebra::DVector;

use super::conditions::c4_1;
use super::{ModesAt, QuadrantDiagram, ZeroConfiguration, station};
use crate::model::plant::PlantError;
use crate::model::zeros::cnmp_pairs;

/// A placement, over a range of values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// The size of aR at the middle value, in 1/kg: how much of what is to be controlled shows.
    pub remainder_per_kg: f64,
    /// Values tried.
    pub values: usize,
    /// Of these, those with CNMP zeros of the two modes, and with any.
    pub with_cnmp: usize,
    /// Likewise, of any modes.
    pub with_any_cnmp: usize,
    /// Those where C4-1 holds.
    pub alternating: usize,
    /// The largest margin of C4-1: above 0 the signs alternate somewhere, below 0 how far they are from it.
    pub margin: f64,
    /// Whether the picture at the veering point says that the signs alternate somewhere in the range.
    pub picture: bool,
}

impl Trial {
    /// Whether the picture rules CNMP zeros of the two modes out, and the model has them.
    pub fn differs(&self) -> bool {
        !self.picture && self.with_cnmp > 0
    }

    /// What to prefer: no CNMP zeros, then none of the close modes, then signs that are far from alternating.
    pub fn rank(&self) -> (usize, usize, bool, f64) {
        (
            self.with_any_cnmp,
            self.with_cnmp,
            self.picture,
            self.margin,
        )
    }
}

/// Tries actuator and probe at each value, given as force and sensor vectors in the values' order; `closest` is the place of the
/// veering point among them. `None` where some value has no response at all.
pub fn trial(
    path: &[&ModesAt],
    ports: &[[DVector<f64>; 2]],
    closest: usize,
    pair: [usize; 2],
) -> Result<Option<Trial>, PlantError> {
    let silent = |(at, [force, sensor]): (&&ModesAt, &[DVector<f64>; 2])| {
        at.terms(force, sensor)
            .iter()
            .all(|term| term.residue_per_kg == 0.0)
    };
    if path.iter().zip(ports).any(silent) {
        return Ok(None);
    }
    let stations = path
        .iter()
        .zip(ports)
        .map(|(at, ports)| station(at, pair, ports.clone()));
    let stations = stations.collect::<Result<Vec<_>, _>>()?;
    let signs = || {
        stations
            .iter()
            .filter_map(|station| station.modes)
            .map(|modes| c4_1(&modes))
    };
    let count =
        |of: &dyn Fn(&super::Sample) -> bool| stations.iter().filter(|station| of(station)).count();
    let middle = stations[stations.len() / 2]
        .modes
        .map_or(0.0, |modes| modes.remainder.residue_per_kg.abs());
    Ok(Some(Trial {
        remainder_per_kg: middle,
        values: stations.len(),
        with_cnmp: count(&|station| station.plant == ZeroConfiguration::Quartet),
        with_any_cnmp: count(&|station| cnmp_pairs(&station.zeros) > 0),
        alternating: signs().filter(|condition| condition.holds).count(),
        margin: signs()
            .map(|condition| condition.margin)
            .fold(f64::NEG_INFINITY, f64::max),
        picture: foretold(path, ports, closest, pair),
    }))
}

/// Whether the picture at the veering point alternates while the shapes turn as they do on either side. Where the modes cross
/// they do not turn but change places: the pictures of the values beside it are taken.
fn foretold(
    path: &[&ModesAt],
    ports: &[[DVector<f64>; 2]],
    closest: usize,
    pair: [usize; 2],
) -> bool {
    let picture =
        |index: usize| QuadrantDiagram::of(path[index], path[closest], pair, &ports[index]);
    let (first, last) = (picture(0), picture(path.len() - 1));
    let sides = if path[closest].are_equal(pair) {
        [
            (closest.saturating_sub(1), &first),
            ((closest + 1).min(path.len() - 1), &last),
        ]
    } else {
        [(closest, &first), (closest, &last)]
    };
    sides.into_iter().any(|(index, end)| {
        let here = picture(index);
        here.alternates_over(here.turn_rad(), end.turn_rad())
    })
}

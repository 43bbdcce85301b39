//! Where the model with damping has CNMP zeros, over operating point and asymmetry.

use crate::config::{PlantSettings, Sr4dofSettings};
use crate::model::plant::{self, PlantError};
use crate::model::zeros::{cnmp_pairs, damped_zeros};

/// Asymmetries are looked at so closely; a band that is narrower may be missed.
const STEP: f64 = 0.002;
/// Halvings of a step: a border is known to 2e-9.
const HALVINGS: usize = 20;

/// The asymmetries with CNMP zeros at each of some operating points.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Y1o/L, ratios.
    pub operating_points: Vec<f64>,
    /// For each of them the bands of asymmetries with CNMP zeros, rising, from and to.
    pub bands: Vec<Vec<[f64; 2]>>,
    /// Between which asymmetries they were looked for; a band that ends there has no border there.
    pub searched: [f64; 2],
}

impl Region {
    /// By the zeros with damping of `settings` at these operating points (ratios Y1o/L), between two asymmetries. Fails where
    /// the model cannot be analysed.
    pub fn of(
        settings: &Sr4dofSettings,
        operating_points: &[f64],
        searched: [f64; 2],
    ) -> Result<Region, PlantError> {
        let row = |&point: &f64| bands(searched, |asymmetry| has_pairs(settings, point, asymmetry));
        let bands = operating_points.iter().map(row).collect::<Result<_, _>>()?;
        Ok(Region {
            operating_points: operating_points.into(),
            bands,
            searched,
        })
    }

    /// Whether there are CNMP zeros at an operating point, by its index, and an asymmetry.
    pub fn contains(&self, row: usize, asymmetry: f64) -> bool {
        self.bands[row]
            .iter()
            .any(|[from, to]| (*from..*to).contains(&asymmetry))
    }

    /// The borders at an operating point, by its index: asymmetries.
    pub fn borders(&self, row: usize) -> impl Iterator<Item = f64> + '_ {
        self.bands[row]
            .iter()
            .flatten()
            .copied()
            .filter(|border| !self.searched.contains(border))
    }
}

/// Whether the zeros with damping of SR4DoF have a CNMP pair among them.
fn has_pairs(settings: &Sr4dofSettings, point: f64, asymmetry: f64) -> Result<bool, PlantError> {
    let operating_point_m = point * settings.beam_length_m;
    let there = Sr4dofSettings {
        operating_point_m,
        mass_asymmetry: asymmetry,
        ..settings.clone()
    };
    Ok(
        cnmp_pairs(&damped_zeros(&plant::build(&PlantSettings::Sr4dof(
            there,
        ))?)?)
            > 0,
    )
}

/// The bands in which `has` holds: by steps, and halvings where it changes between two.
fn bands(
    [low, high]: [f64; 2],
    has: impl Fn(f64) -> Result<bool, PlantError>,
) -> Result<Vec<[f64; 2]>, PlantError> {
    let steps = libm::ceil((high - low) / STEP).max(1.0) as usize;
    let at = |k: usize| {
        if k == steps {
            high
        } else {
            low + (high - low) * k as f64 / steps as f64
        }
    };
    let (mut bands, mut inside) = (Vec::new(), has(low)?.then_some(low));
    for k in 1..=steps {
        let now = has(at(k))?;
        if now == inside.is_some() {
            continue;
        }
        let border = halved([at(k - 1), at(k)], now, &has)?;
        match inside.take() {
            Some(from) => bands.push([from, border]),
            None => inside = Some(border),
        }
    }
    bands.extend(inside.map(|from| [from, high]));
    Ok(bands)
}

/// Where `has` becomes `after` between two values.
fn halved(
    [mut low, mut high]: [f64; 2],
    after: bool,
    has: &impl Fn(f64) -> Result<bool, PlantError>,
) -> Result<f64, PlantError> {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if has(middle)? == after {
            high = middle
        } else {
            low = middle
        }
    }
    Ok(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_found_wherever_they_begin_and_end() {
        let within =
            |bands: [[f64; 2]; 2]| move |x: f64| Ok(bands.iter().any(|[a, b]| x >= *a && x < *b));
        let near = |found: &[[f64; 2]], expected: &[[f64; 2]]| {
            assert_eq!(found.len(), expected.len(), "{found:?}");
            for (a, b) in found.iter().flatten().zip(expected.iter().flatten()) {
                assert!((a - b).abs() < 3e-9, "{found:?} {expected:?}");
            }
        };
        let inner = [[-0.0513, 0.0107], [0.03, 0.0777]];
        near(&bands([-0.1, 0.1], within(inner)).expect("bands"), &inner);
        let open = bands([-0.1, 0.1], within([[-1.0, -0.02], [0.05, 1.0]])).expect("bands");
        near(&open, &[[-0.1, -0.02], [0.05, 0.1]]);
        assert!(bands([-0.1, 0.1], |_| Ok(false)).expect("bands").is_empty());
        near(
            &bands([-0.1, 0.1], |_| Ok(true)).expect("bands"),
            &[[-0.1, 0.1]],
        );
    }
}

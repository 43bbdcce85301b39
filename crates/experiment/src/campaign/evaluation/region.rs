//! The region of operating points and asymmetries in which the model with damping has CNMP zeros.

use bench_config::{PlantSettings, Sr4dofSettings};
use bench_plant::PlantError;
use bench_plant::zeros::{cnmp_pairs, damped_zeros};

/// Step of the search over the asymmetries; a narrower band may be missed.
const STEP: f64 = 0.002;
/// Number of bisections of a step: a border has an error of 2e-9.
const BISECTIONS: usize = 20;

/// The asymmetries with CNMP zeros at several operating points.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Y1o/L, ratios.
    pub operating_points: Vec<f64>,
    /// For each operating point the bands of asymmetries with CNMP zeros, rising: start and end of each band.
    pub bands: Vec<Vec<[f64; 2]>>,
    /// The searched range of asymmetries. A band that reaches an end of the range has no border there.
    pub searched: [f64; 2],
}

impl Region {
    /// The region by the zeros with damping of `stage`, at these operating points (ratios Y1o/L) and between two asymmetries.
    /// Fails if the model cannot be analysed.
    pub fn of(
        stage: &Sr4dofSettings,
        operating_points: &[f64],
        searched: [f64; 2],
    ) -> Result<Region, PlantError> {
        let rows = operating_points.iter();
        let rows =
            rows.map(|&point| bands(searched, |asymmetry| has_pairs(stage, point, asymmetry)));
        let bands = rows.collect::<Result<_, _>>()?;
        Ok(Region {
            operating_points: operating_points.into(),
            bands,
            searched,
        })
    }

    /// Whether there are CNMP zeros at an operating point, by its index, and an asymmetry.
    pub fn contains(&self, row: usize, asymmetry: f64) -> bool {
        let mut bands = self.bands[row].iter();
        bands.any(|[from, to]| (*from..*to).contains(&asymmetry))
    }

    /// The borders at an operating point, by its index: asymmetries.
    pub fn borders(&self, row: usize) -> impl Iterator<Item = f64> + '_ {
        let ends = self.bands[row].iter().flatten().copied();
        ends.filter(|border| !self.searched.contains(border))
    }
}

/// Whether the zeros with damping of SR4DoF include a CNMP pair.
fn has_pairs(stage: &Sr4dofSettings, point: f64, asymmetry: f64) -> Result<bool, PlantError> {
    let plant = bench_plant::build(&PlantSettings::Sr4dof(Sr4dofSettings {
        operating_point_m: point * stage.beam_length_m,
        mass_asymmetry: asymmetry,
        ..stage.clone()
    }))?;
    Ok(cnmp_pairs(&damped_zeros(&plant)?) > 0)
}

/// The intervals in which `has` is true. The range is sampled in steps of [`STEP`]; each change of `has` is located
/// by bisection.
fn bands(
    [low, high]: [f64; 2],
    has: impl Fn(f64) -> Result<bool, PlantError>,
) -> Result<Vec<[f64; 2]>, PlantError> {
    let steps = libm::ceil((high - low) / STEP).max(1.0) as usize;
    let width = high - low;
    let (mut bands, mut previous) = (Vec::new(), low);
    let mut inside = has(low)?.then_some(low);
    for k in 1..=steps {
        let next = if k == steps {
            high
        } else {
            low + width * k as f64 / steps as f64
        };
        let now = has(next)?;
        if now != inside.is_some() {
            let border = border([previous, next], now, &has)?;
            match inside.take() {
                Some(from) => bands.push([from, border]),
                None => inside = Some(border),
            }
        }
        previous = next;
    }
    bands.extend(inside.map(|from| [from, high]));
    Ok(bands)
}

/// The value at which `has` changes to `after`.
fn border(
    [mut low, mut high]: [f64; 2],
    after: bool,
    has: &impl Fn(f64) -> Result<bool, PlantError>,
) -> Result<f64, PlantError> {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if has(middle)? == after {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_bands_anywhere_in_the_range() {
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

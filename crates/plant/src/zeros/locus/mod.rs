//! Migration of zeros as one number varies: followed by continuity, with the points where their kinds change.
//!
//! Without damping the zeros are followed as u = s^2: real u below 0 are MMP pairs, above 0 RMP-RNMP pairs, complex ones
//! quartets. With damping they are followed as s. Distances are those on Riemann's sphere, so that a zero may pass through
//! infinity. Between two values of the grid the step is halved where the assignment of zeros is ambiguous. Where the kinds
//! differ, the change is bisected. Where two real zeros approach each other and part again, the least distance between
//! them is searched, so that a band of complex zeros narrower than the grid is found.

mod census;
mod changes;
mod follower;
mod matching;

use nalgebra::Complex;

pub use self::census::LocusPlane;
pub use self::changes::{Crossing, KindChange};

use self::follower::Follower;
use super::kinds::Zero;

/// The zeros over the values of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Locus {
    /// The values.
    pub values: Vec<f64>,
    /// The position of each zero at each value; `None` at infinity. Without damping one of each pair s, -s, continuous: the
    /// zero above the origin on the imaginary axis, of a quartet two that mirror each other.
    pub tracks: Vec<Vec<Option<Complex<f64>>>>,
    /// The changes of kind, in the order of the values.
    pub changes: Vec<KindChange>,
}

impl Locus {
    /// Follows the zeros that `zeros` returns at a value. `values` are two at least, in one order.
    pub fn follow<E>(
        plane: LocusPlane,
        values: &[f64],
        zeros: impl FnMut(f64) -> Result<Vec<Zero>, E>,
    ) -> Result<Locus, E> {
        let mut follower = Follower::new(plane, zeros, values.len());
        let samples = values
            .iter()
            .map(|value| follower.sample(*value))
            .collect::<Result<Vec<_>, E>>()?;
        let tracks = follower.tracks(&samples)?;
        let mut changes = follower.all_changes(&samples, &tracks)?;
        if values.first() > values.last() {
            changes.reverse();
        }
        Ok(Locus {
            values: values.to_vec(),
            tracks: tracks.iter().map(|track| plane.places(track)).collect(),
            changes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlantError;
    use crate::zeros::{ModalSum, ModalTerm};
    use bench_base::numeric::linspace;

    fn grid(from: f64, to: f64, count: usize) -> Vec<f64> {
        linspace(from, to, count).collect()
    }

    fn section_3_2_4(a0: f64) -> Result<Vec<Zero>, PlantError> {
        let terms = vec![
            ModalTerm::undamped(0.0, 1.0),
            ModalTerm::undamped(10.0, -a0),
            ModalTerm::undamped(11.0, a0),
        ];
        ModalSum::new(terms, 0.0)?.undamped_zeros()
    }

    #[test]
    fn zeros_of_section_3_2_4_meet_at_1_21_and_21() {
        for count in [4, 50, 1001] {
            let locus = Locus::follow(
                LocusPlane::Undamped,
                &grid(1e-3, 30.0, count),
                section_3_2_4,
            )
            .unwrap();
            let [first, second] = locus.changes.as_slice() else {
                panic!("{:?}", locus.changes)
            };
            assert_eq!(
                (first.crossing, second.crossing),
                (Crossing::ImaginaryAxis, Crossing::RealAxis)
            );
            // Two zeros count as one below 1e-7 of their size: 1e-14 in the value, and rounding.
            assert!(
                (first.value * 21.0 - 1.0).abs() < 1e-11
                    && (second.value / 21.0 - 1.0).abs() < 1e-11
            );
            assert_eq!(
                [&first.before, &first.after, &second.before, &second.after],
                ["dual MMP", "CMP-CNMP", "CMP-CNMP", "dual RMP-RNMP"]
            );
            // N = x^2 + (221 - 21 a0) x + 12100: the double root is -+ 110.
            for change in [first, second] {
                assert!((change.s.norm_sqr() - 110.0).abs() < 1e-4, "{change:?}");
            }
        }
    }

    #[test]
    fn finds_a_band_of_complex_zeros_narrower_than_the_grid() {
        // x^2 + (221 - 21 a0) x + 12100 with a0 = 1/21 + 1e-6 - (v - 0.5137)^2: complex within 1e-3 of v = 0.5137 only.
        let bump = |v: f64| section_3_2_4(1.0 / 21.0 + 1e-6 - (v - 0.5137) * (v - 0.5137) * 0.05);
        let locus = Locus::follow(LocusPlane::Undamped, &grid(0.0, 1.0, 24), bump).unwrap();
        let half_width = (1e-6f64 / 0.05).sqrt();
        let values: Vec<f64> = locus.changes.iter().map(|change| change.value).collect();
        assert_eq!(values.len(), 2, "{:?}", locus.changes);
        for (value, expected) in values
            .iter()
            .zip([0.5137 - half_width, 0.5137 + half_width])
        {
            assert!((value - expected).abs() < 1e-9, "{value} for {expected}");
        }
    }

    #[test]
    fn follows_a_pair_through_infinity() {
        // Fig 3-2: aR = 1, av from 0 to -3; the pair on the imaginary axis goes to infinity at av = -1 and comes back on the
        // real one. x = -wv^2/(1 + av).
        let zeros = |av: f64| {
            ModalSum::new(
                vec![ModalTerm::undamped(0.0, 1.0), ModalTerm::undamped(3.0, av)],
                0.0,
            )?
            .undamped_zeros()
        };
        let locus =
            Locus::follow::<PlantError>(LocusPlane::Undamped, &grid(-0.01, -3.0, 60), zeros)
                .unwrap();
        let [change] = locus.changes.as_slice() else {
            panic!("{:?}", locus.changes)
        };
        assert_eq!(change.crossing, Crossing::Infinity);
        assert!((change.value + 1.0).abs() < 1e-11, "{change:?}");
        assert_eq!(locus.tracks.len(), 1);
        for (value, s) in locus.values.iter().zip(&locus.tracks[0]) {
            let square = s.unwrap() * s.unwrap();
            assert!(
                (square * (1.0 + value) + 9.0).norm() < 1e-9,
                "{square} at {value}"
            );
        }
    }

    #[test]
    fn finds_each_crossing_of_damped_zeros() {
        // Eq. (3-15) below the touching damping of wu = 0.9, wv = 1.1, ratio 2.
        let mode = |omega_rad_s, residue_per_kg| ModalTerm {
            omega_rad_s,
            damping_ratio: 0.2,
            residue_per_kg,
        };
        let zeros = |av: f64| {
            ModalSum::new(
                vec![
                    ModalTerm::undamped(0.0, 1.0),
                    mode(0.9, -2.0 * av),
                    mode(1.1, av),
                ],
                0.0,
            )?
            .damped_zeros()
        };
        let locus =
            Locus::follow::<PlantError>(LocusPlane::Damped, &grid(0.01, 0.9, 90), zeros).unwrap();
        let crossings: Vec<Crossing> = locus.changes.iter().map(|change| change.crossing).collect();
        assert_eq!(
            crossings,
            [Crossing::ImaginaryAxis, Crossing::ImaginaryAxis],
            "{:?}",
            locus.changes
        );
        for change in &locus.changes {
            let on_axis = zeros(change.value).unwrap();
            assert!(
                on_axis.iter().any(|z| (z.s - change.s).norm() < 1e-9),
                "{change:?}: {on_axis:?}"
            );
        }
    }
}

//! Coordinates that follow from the degrees of freedom by parallelograms, to second order about an operating point.
//!
//! ```text
//!  w(z) = w0 + row z + z^T curve z/2
//! ```
//!
//! A parallelogram joins two stages P and S along an axis a, with t across it: beams that keep their length bring S nearer
//! to P by c (t_S - t_P)^2, c = 0.6/L (Eq. 2-1). With S on side s = +-1 of P along a:
//!
//! ```text
//!  a_S = a_P - c s (t_S - t_P)^2
//! ```
//!
//! Masses and springs go by the rows (M = sum of m row^T row). The curves tell how a static force f along w stiffens the
//! mechanism as it moves: by f curve (the geometric stiffness).

use nalgebra::{DMatrix, DVector};

/// A displacement as a function of the degrees of freedom, metres over metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coordinate {
    /// Its static value in metres.
    pub at_m: f64,
    /// Its gradient.
    pub row: DVector<f64>,
    /// Its second derivatives, 1/m, where they are wanted: they are most of the work.
    pub curve: Option<DMatrix<f64>>,
}

impl Coordinate {
    /// What does not move, at zero.
    pub fn ground(degrees_of_freedom: usize, curved: bool) -> Coordinate {
        let n = degrees_of_freedom;
        Coordinate {
            at_m: 0.0,
            row: DVector::zeros(n),
            curve: curved.then(|| DMatrix::zeros(n, n)),
        }
    }

    /// A degree of freedom itself.
    pub fn free(degrees_of_freedom: usize, curved: bool, index: usize, at_m: f64) -> Coordinate {
        let mut free = Coordinate {
            at_m,
            ..Coordinate::ground(degrees_of_freedom, curved)
        };
        free.row[index] = 1.0;
        free
    }

    /// How far this coordinate is beyond another.
    pub fn from(&self, other: &Coordinate) -> Coordinate {
        let curve = self
            .curve
            .as_ref()
            .zip(other.curve.as_ref())
            .map(|(mine, theirs)| mine - theirs);
        Coordinate {
            at_m: self.at_m - other.at_m,
            row: &self.row - &other.row,
            curve,
        }
    }

    /// Along a parallelogram's axis: a_S of this a_P, with `across` = t_S - t_P, S on `side` s, and c in 1/m.
    pub fn joined(&self, across: &Coordinate, side: f64, shortening_per_m: f64) -> Coordinate {
        let scale = shortening_per_m * side;
        let slope = 2.0 * scale * across.at_m;
        Coordinate {
            at_m: self.at_m - scale * across.at_m * across.at_m,
            row: &self.row - slope * &across.row,
            curve: self
                .curve
                .as_ref()
                .zip(across.curve.as_ref())
                .map(|(mine, theirs)| {
                    mine - (2.0 * scale * &across.row * across.row.transpose() + slope * theirs)
                }),
        }
    }
}

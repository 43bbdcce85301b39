//! Coordinates that follow from the degrees of freedom through parallelograms, to second order about an operating point.
//!
//! ```text
//!  w(z) = w0 + row z + z^T curve z/2
//! ```
//!
//! A parallelogram joins two stages P and S along an axis a, with t across it. Its beams keep their length, which brings S
//! nearer to P by c (t_S - t_P)^2, c = 0.6/L (Eq. 2-1). With S on side s = +-1 of P along a:
//!
//! ```text
//!  a_S = a_P - c s (t_S - t_P)^2
//! ```
//!
//! Masses and springs depend on the rows alone (M = sum of m row^T row). A static force f along w adds f curve to the
//! stiffness matrix: the geometric stiffness.

use nalgebra::{DMatrix, DVector};

/// A displacement as a function of the degrees of freedom, metres over metres.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Coordinate {
    /// Static value in metres.
    pub at_m: f64,
    /// Gradient.
    pub row: DVector<f64>,
    /// Second derivatives in 1/m, where they are needed: they are most of the work.
    pub curve: Option<DMatrix<f64>>,
}

impl Coordinate {
    /// A fixed point at zero.
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

    /// The gradient as a slice.
    pub fn slice(&self) -> &[f64] {
        self.row.as_slice()
    }

    /// The difference of this coordinate from another.
    pub fn from(&self, other: &Coordinate) -> Coordinate {
        let curves = self.curve.as_ref().zip(other.curve.as_ref());
        Coordinate {
            at_m: self.at_m - other.at_m,
            row: &self.row - &other.row,
            curve: curves.map(|(curve, other)| curve - other),
        }
    }

    /// a_S along a parallelogram's axis, with this as a_P, `across` = t_S - t_P, S on `side` s, and c in 1/m.
    pub fn joined(&self, across: &Coordinate, side: f64, shortening_per_m: f64) -> Coordinate {
        let scale = shortening_per_m * side;
        let slope = 2.0 * scale * across.at_m;
        let curves = self.curve.as_ref().zip(across.curve.as_ref());
        Coordinate {
            at_m: self.at_m - scale * across.at_m * across.at_m,
            row: &self.row - slope * &across.row,
            curve: curves.map(|(curve, bent)| {
                curve - (2.0 * scale * &across.row * across.row.transpose() + slope * bent)
            }),
        }
    }
}

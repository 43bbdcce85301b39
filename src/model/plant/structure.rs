//! A linear structure with one force and one displacement: M z'' + C z' + K z = q F - g a, x = c^T z.

use nalgebra::{DMatrix, DVector};

/// Matrices and vectors of a linear structure with n degrees of freedom, in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// M, n x n, symmetric positive definite.
    pub mass: DMatrix<f64>,
    /// C, n x n, symmetric.
    pub damping: DMatrix<f64>,
    /// K, n x n, symmetric.
    pub stiffness: DMatrix<f64>,
    /// q: generalised force per newton of the actuator.
    pub force: DVector<f64>,
    /// c: displacement that the probe sees per unit of each coordinate.
    pub sensor: DVector<f64>,
    /// g: generalised force per m/s^2 of the floor, against its acceleration; coordinates are relative to the floor.
    pub floor: DVector<f64>,
    /// Bodies that no spring holds to ground: as many of the slowest modes have the frequency zero, not just nearly so.
    pub free_bodies: usize,
}

/// Collects masses and springs on coordinates that follow from the degrees of freedom, x_i = row_i z:
/// M = sum of m row^T row, K = sum of k row^T row (that is J^T M J with diagonal M).
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    floor: DVector<f64>,
}

impl Assembly {
    pub(super) fn new(degrees_of_freedom: usize) -> Self {
        let square = DMatrix::zeros(degrees_of_freedom, degrees_of_freedom);
        Assembly {
            mass: square.clone(),
            stiffness: square,
            floor: DVector::zeros(degrees_of_freedom),
        }
    }

    /// A mass that moves along `x` (in the direction of the floor's acceleration) and along `y` (across it).
    pub(super) fn mass(&mut self, kilograms: f64, x: &[f64], y: &[f64]) {
        let (x, y) = (DVector::from_row_slice(x), DVector::from_row_slice(y));
        self.mass += kilograms * (&x * x.transpose() + &y * y.transpose());
        self.floor += kilograms * x;
    }

    /// A spring that lengthens by `along` times z.
    pub(super) fn spring(&mut self, newtons_per_metre: f64, along: &[f64]) {
        let along = DVector::from_row_slice(along);
        self.stiffness += newtons_per_metre * &along * along.transpose();
    }

    pub(super) fn finish(self, force: &[f64], sensor: &[f64]) -> Structure {
        let n = self.mass.nrows();
        Structure {
            mass: self.mass,
            damping: DMatrix::zeros(n, n),
            stiffness: self.stiffness,
            force: DVector::from_row_slice(force),
            sensor: DVector::from_row_slice(sensor),
            floor: self.floor,
            free_bodies: 0,
        }
    }
}

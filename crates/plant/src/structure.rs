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
    /// c: displacement at the probe per unit of each coordinate.
    pub sensor: DVector<f64>,
    /// g: generalised force per m/s^2 of floor acceleration, against it; coordinates are relative to the floor.
    pub floor: DVector<f64>,
    /// Number of bodies that no spring holds to ground: as many of the slowest modes have exactly the frequency zero.
    pub free_bodies: usize,
}

/// Sums up masses and springs on coordinates x_i = row_i z: M = sum of m row^T row, K = sum of k row^T row. Each row has one number
/// for each degree of freedom.
#[derive(Clone, Debug)]
pub struct Assembly {
    mass: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    floor: DVector<f64>,
}

impl Assembly {
    /// Without masses and springs.
    pub fn new(degrees_of_freedom: usize) -> Self {
        let square = DMatrix::zeros(degrees_of_freedom, degrees_of_freedom);
        Assembly {
            mass: square.clone(),
            stiffness: square,
            floor: DVector::zeros(degrees_of_freedom),
        }
    }

    /// Adds a mass that moves along `x`, the direction of the floor's acceleration, and along `y` across it.
    pub fn add_mass(&mut self, kilograms: f64, x: &[f64], y: &[f64]) {
        let (x, y) = (DVector::from_row_slice(x), DVector::from_row_slice(y));
        self.mass += kilograms * (&x * x.transpose() + &y * y.transpose());
        self.floor += kilograms * x;
    }

    /// Adds a spring whose elongation is `along` times z.
    pub fn add_spring(&mut self, newtons_per_metre: f64, along: &[f64]) {
        let along = DVector::from_row_slice(along);
        self.stiffness += newtons_per_metre * &along * along.transpose();
    }

    /// The structure without damping, with the rows of force and displacement.
    pub fn into_structure(self, force: &[f64], sensor: &[f64]) -> Structure {
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

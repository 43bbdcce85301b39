//! The two eigenvalue problems of a plant: its modes and its zeros.

use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::PlantError;

/// An eigenvalue iteration that takes more steps has failed; at these sizes it takes some ten.
const MAX_ITERATIONS: usize = 10_000;
/// A root of a pencil is infinite where its reciprocal is below this ratio of the largest.
const INFINITE_RATIO: f64 = 1e-12;

/// Solves K v = w2 M v, normalised to V^T M V = I. Returns the eigenvalues w2 in ascending order and the eigenvectors
/// as the columns of V.
pub(super) fn modes(
    mass: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
) -> Result<(DVector<f64>, DMatrix<f64>), PlantError> {
    let singular = PlantError::SingularMass;
    let lower = mass.clone().cholesky().ok_or(singular.clone())?.unpack();
    let symmetric = mass_normalised(&lower, stiffness).ok_or(singular.clone())?;
    let eigen = symmetric
        .try_symmetric_eigen(f64::EPSILON, MAX_ITERATIONS)
        .ok_or(PlantError::NoConvergence { what: "the modes" })?;
    let shapes = lower
        .tr_solve_lower_triangular(&eigen.eigenvectors)
        .ok_or(singular)?;
    let order = ascending(&eigen.eigenvalues);
    let values = eigen.eigenvalues.select_rows(&order);
    Ok((values, shapes.select_columns(&order)))
}

/// L^-1 K L^-T, symmetric.
fn mass_normalised(lower: &DMatrix<f64>, stiffness: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let half = lower.solve_lower_triangular(stiffness)?;
    let full = lower.solve_lower_triangular(&half.transpose())?;
    Some(0.5 * (&full + full.transpose()))
}

fn ascending(values: &DVector<f64>) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    order
}

/// The finite numbers u for which `constant` + u `linear` is singular.
///
/// They are computed as 1/mu from the eigenvalues mu of -constant^-1 linear, or directly where `constant` is singular.
pub(crate) fn pencil_roots(
    constant: &DMatrix<f64>,
    linear: &DMatrix<f64>,
) -> Result<Vec<Complex<f64>>, PlantError> {
    let no_convergence = PlantError::NoConvergence { what: "the zeros" };
    if constant.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(reciprocal) = constant.clone().lu().solve(linear) {
        let values = eigenvalues(-reciprocal).ok_or(no_convergence)?;
        return Ok(finite_reciprocals(&values));
    }
    let direct = linear.clone().lu().solve(constant);
    direct
        .and_then(|direct| eigenvalues(-direct))
        .ok_or(no_convergence)
}

fn finite_reciprocals(values: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let largest = values.iter().map(|mu| mu.norm()).fold(0.0, f64::max);
    let finite = values
        .iter()
        .filter(|mu| mu.norm() > INFINITE_RATIO * largest);
    finite.map(|mu| mu.inv()).collect()
}

fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let schur = Schur::try_new(matrix, f64::EPSILON, MAX_ITERATIONS)?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

/// An orthonormal basis of the vectors orthogonal to `vector`, n x (n - 1): the last columns of the Householder reflection
/// that turns `vector` into the first axis.
pub(crate) fn orthogonal_complement(vector: &DVector<f64>) -> DMatrix<f64> {
    let n = vector.len();
    let norm = vector.norm();
    let mut v = vector.clone();
    v[0] += if vector[0] < 0.0 { -norm } else { norm };
    let scale = v.norm_squared();
    let projection = match scale > 0.0 {
        true => (2.0 / scale) * &v * v.transpose(),
        false => DMatrix::zeros(n, n),
    };
    let reflection = DMatrix::identity(n, n) - projection;
    reflection.columns(1, n - 1).into_owned()
}

//! The two eigenvalue problems of the plant, on top of nalgebra.

use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::PlantError;

/// Iterations after which an eigenvalue problem of these sizes counts as failed; they take some ten.
const MAX_ITERATIONS: usize = 10_000;

/// Solves K v = w2 M v with V^T M V = I, slowest first. Columns of V belong to the values.
pub(super) fn modes(
    mass: &DMatrix<f64>,
    stiffness: &DMatrix<f64>,
) -> Result<(DVector<f64>, DMatrix<f64>), PlantError> {
    let lower = mass
        .clone()
        .cholesky()
        .ok_or(PlantError::SingularMass)?
        .unpack();
    let half = lower
        .solve_lower_triangular(stiffness)
        .ok_or(PlantError::SingularMass)?;
    let full = lower
        .solve_lower_triangular(&half.transpose())
        .ok_or(PlantError::SingularMass)?;
    let symmetric = 0.5 * (&full + full.transpose());
    let eigen = symmetric
        .try_symmetric_eigen(f64::EPSILON, MAX_ITERATIONS)
        .ok_or(PlantError::NoConvergence { what: "the modes" })?;
    let shapes = lower
        .tr_solve_lower_triangular(&eigen.eigenvectors)
        .ok_or(PlantError::SingularMass)?;
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let values = DVector::from_iterator(order.len(), order.iter().map(|&i| eigen.eigenvalues[i]));
    Ok((values, shapes.select_columns(&order)))
}

/// The finite numbers u for which `constant` + u `linear` is singular. They are taken as 1/mu from the eigenvalues mu of
/// -constant^-1 linear, or directly where `constant` is the worse conditioned of the two; |mu| below 1e-12 of the
/// largest counts as an infinite u.
pub(crate) fn pencil(
    constant: &DMatrix<f64>,
    linear: &DMatrix<f64>,
) -> Result<Vec<Complex<f64>>, PlantError> {
    if constant.is_empty() {
        return Ok(Vec::new());
    }
    let what = "the zeros";
    if let Some(reciprocal) = constant.clone().lu().solve(linear) {
        let values = eigenvalues(-reciprocal).ok_or(PlantError::NoConvergence { what })?;
        let largest = values.iter().map(|mu| mu.norm()).fold(0.0, f64::max);
        return Ok(values
            .iter()
            .filter(|mu| mu.norm() > 1e-12 * largest)
            .map(|mu| mu.inv())
            .collect());
    }
    let direct = linear
        .clone()
        .lu()
        .solve(constant)
        .ok_or(PlantError::NoConvergence { what })?;
    eigenvalues(-direct).ok_or(PlantError::NoConvergence { what })
}

fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let schur = Schur::try_new(matrix, f64::EPSILON, MAX_ITERATIONS)?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

/// An orthonormal basis of what is orthogonal to `vector`, n x (n - 1): the last columns of the Householder reflection
/// that turns `vector` into the first axis.
pub(crate) fn complement(vector: &DVector<f64>) -> DMatrix<f64> {
    let n = vector.len();
    let norm = vector.norm();
    let mut v = vector.clone();
    v[0] += if vector[0] < 0.0 { -norm } else { norm };
    let scale = v.norm_squared();
    let reflection = DMatrix::identity(n, n)
        - if scale > 0.0 {
            (2.0 / scale) * &v * v.transpose()
        } else {
            DMatrix::zeros(n, n)
        };
    reflection.columns(1, n - 1).into_owned()
}

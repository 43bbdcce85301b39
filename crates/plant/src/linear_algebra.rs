//! Eigenvalue problems: the modes and the zeros of a plant, and the eigenvalues of any real matrix.

use nalgebra::{Complex, DMatrix, DVector, Schur};

use super::PlantError;

/// An eigenvalue iteration that takes more steps has failed; at these sizes it takes some ten.
const MAX_ITERATIONS: usize = 10_000;
/// Tolerances of the eigenvalue iteration, tried in this order: an entry below the diagonal is neglected if it is smaller, relative to
/// its neighbours on the diagonal. With repeated eigenvalues, rounding keeps such entries above some units in the last place: of
/// random matrices of order 10 with a threefold eigenvalue, 3 in 4 need more than the first, and all end with the last.
const EIGENVALUE_TOLERANCES: [f64; 6] = [
    f64::EPSILON,
    4.0 * f64::EPSILON,
    16.0 * f64::EPSILON,
    64.0 * f64::EPSILON,
    256.0 * f64::EPSILON,
    1024.0 * f64::EPSILON,
];
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
pub fn pencil_roots(
    constant: &DMatrix<f64>,
    linear: &DMatrix<f64>,
) -> Result<Vec<Complex<f64>>, PlantError> {
    let no_convergence = PlantError::NoConvergence { what: "the zeros" };
    if constant.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(reciprocal) = constant.clone().lu().solve(linear) {
        let values = eigenvalues(&-reciprocal).ok_or(no_convergence)?;
        return Ok(finite_reciprocals(&values));
    }
    let direct = linear.clone().lu().solve(constant);
    direct
        .and_then(|direct| eigenvalues(&-direct))
        .ok_or(no_convergence)
}

fn finite_reciprocals(values: &[Complex<f64>]) -> Vec<Complex<f64>> {
    let largest = values.iter().map(|mu| mu.norm()).fold(0.0, f64::max);
    let finite = values
        .iter()
        .filter(|mu| mu.norm() > INFINITE_RATIO * largest);
    finite.map(|mu| mu.inv()).collect()
}

/// The eigenvalues of a square matrix, those of another matrix that differs from it by the tolerance of the iteration at most. `None`
/// if an entry is not finite or the iteration does not end.
pub fn eigenvalues(matrix: &DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    if matrix.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let schur = EIGENVALUE_TOLERANCES
        .into_iter()
        .find_map(|tolerance| Schur::try_new(matrix.clone(), tolerance, MAX_ITERATIONS))?;
    Some(schur.complex_eigenvalues().iter().copied().collect())
}

/// An orthonormal basis of the vectors orthogonal to `vector`, n x (n - 1): the last columns of the Householder reflection
/// that turns `vector` into the first axis.
pub fn orthogonal_complement(vector: &DVector<f64>) -> DMatrix<f64> {
    let n = vector.len();
    let norm = vector.norm();
    let mut v = vector.clone();
    v[0] += if vector[0] < 0.0 { -norm } else { norm };
    let scale = v.norm_squared();
    let projection = if scale > 0.0 {
        (2.0 / scale) * &v * v.transpose()
    } else {
        DMatrix::zeros(n, n)
    };
    let reflection = DMatrix::identity(n, n) - projection;
    reflection.columns(1, n - 1).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers between -1 and 1 (linear congruential generator of Knuth, MMIX).
    fn random(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// Bauer and Fike: an eigenvalue is moved by the error of the matrix times the condition of the eigenvectors at most. Each of the nine
    /// neglected entries is at most 2 x 1024 units in the last place (4.6e-13) of the norm, and together 3 times that; the matrix itself
    /// is rounded by about 20 units times the condition.
    #[test]
    fn eigenvalues_of_matrices_with_a_threefold_eigenvalue_are_found() {
        for seed in 0..300 {
            let mut random = random(seed);
            let mut truth = [(); 8].map(|()| Complex::new(-500.0 + 300.0 * random(), 0.0));
            (truth[1], truth[2]) = (truth[0], truth[0]);
            let pair = Complex::new(-900.0, 3000.0);
            let mut diagonal = DMatrix::zeros(10, 10);
            for (k, value) in truth.iter().enumerate() {
                diagonal[(k, k)] = value.re;
            }
            diagonal
                .view_mut((8, 8), (2, 2))
                .copy_from_slice(&[pair.re, -pair.im, pair.im, pair.re]);
            let vectors = DMatrix::from_fn(10, 10, |_, _| random());
            let inverse = vectors.clone().try_inverse().expect("regular");
            let condition = vectors.norm() * inverse.norm();
            let matrix = vectors * &diagonal * inverse;
            let tolerance = (1.4e-12 + 4.4e-15 * condition) * condition * diagonal.norm();

            let mut found = eigenvalues(&matrix).expect("the iteration ends");
            for truth in truth.into_iter().chain([pair, pair.conj()]) {
                let distances = found.iter().map(|value| (value - truth).norm()).enumerate();
                let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
                let (index, distance) = nearest.expect("ten eigenvalues");
                assert!(distance < tolerance, "{seed}: {distance} of {tolerance}");
                found.swap_remove(index);
            }
            assert!(found.is_empty());
        }
    }

    #[test]
    fn eigenvalues_of_a_matrix_that_is_not_finite_are_refused() {
        assert_eq!(eigenvalues(&DMatrix::from_element(2, 2, f64::NAN)), None);
        assert_eq!(eigenvalues(&DMatrix::zeros(0, 0)), Some(Vec::new()));
    }
}

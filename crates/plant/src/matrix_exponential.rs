//! The matrix exponential of small matrices.

use nalgebra::SMatrix;

/// Terms of the series: with a norm of 1/16 at most the next one is below 16^-14/14!, 2e-28.
const TERMS: u32 = 13;

/// exp(A) by scaling and squaring: the Taylor series of A/2^s, squared s times.
///
/// nalgebra's own exponential needs its `std` feature, whose products are rounded differently on different processors.
pub fn matrix_exponential<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let squarings = squarings(norm(matrix));
    let scaled = matrix * libm::exp2(-f64::from(squarings));
    // Horner: I + A (I + A/2 (I + A/3 (...))).
    let mut sum = SMatrix::<f64, N, N>::identity();
    for term in (1..=TERMS).rev() {
        sum = SMatrix::identity() + scaled * sum / f64::from(term);
    }
    (0..squarings).fold(sum, |power, _| power * power)
}

/// The largest sum of the absolute values of a column.
fn norm<const N: usize>(matrix: &SMatrix<f64, N, N>) -> f64 {
    let columns = matrix.column_iter();
    let sums = columns.map(|column| column.iter().map(|x| x.abs()).sum::<f64>());
    sums.fold(0.0, f64::max)
}

/// s for which norm/2^s is 1/16 at most.
fn squarings(norm: f64) -> i32 {
    if norm > 0.0 {
        (libm::ceil(libm::log2(norm)) as i32 + 4).max(0)
    } else {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix2;

    #[test]
    fn matches_closed_forms_of_rotation_decay_and_shear() {
        for angle in [1e-9, 0.3, 2.0, 50.0] {
            let rotation = matrix_exponential(&Matrix2::new(0.0, angle, -angle, 0.0));
            let exact = Matrix2::new(angle.cos(), angle.sin(), -angle.sin(), angle.cos());
            // Each of log2(16 angle) squarings doubles the rounding: 16 angle times 1e-16, times a few sums.
            assert!(
                (rotation - exact).amax() < 1e-15 * (10.0 + 50.0 * angle),
                "{angle}"
            );
        }
        let decay = matrix_exponential(&Matrix2::new(-3.0, 0.0, 0.0, -700.0));
        // Scaled for the 700 by 2^14: as many roundings of 1e-16 in the slow element.
        assert!(
            (decay[(0, 0)] / f64::exp(-3.0) - 1.0).abs() < 4e-12 && decay[(1, 1)].abs() < 1e-300
        );
        let shear = matrix_exponential(&Matrix2::new(0.0, 5.0, 0.0, 0.0));
        assert!((shear - Matrix2::new(1.0, 5.0, 0.0, 1.0)).amax() < 1e-14);
    }
}

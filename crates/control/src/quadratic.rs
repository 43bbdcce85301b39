//! Roots of a polynomial of second order.

use nalgebra::Complex;

/// Roots of a x^2 + b x + c without cancellation.
pub(super) fn quadratic_roots(a: f64, b: f64, c: f64) -> [Complex<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        let (re, im) = (-b / (2.0 * a), (-discriminant).sqrt() / (2.0 * a));
        return [Complex::new(re, im), Complex::new(re, -im)];
    }
    let q = -0.5 * (b + discriminant.sqrt().copysign(b));
    if q == 0.0 {
        [Complex::new(0.0, 0.0); 2]
    } else {
        [q / a, c / q].map(|root| Complex::new(root, 0.0))
    }
}

//! A parabola through a few points of a response, by weighted least squares.

use nalgebra::{Complex, Matrix3, Vector3};

use super::point::ResponsePoint;

/// H(w) = h_0 + h_1 x + h_2 x^2 with complex h and x = (w - w_0)/(largest |w - w_0|), the weights being 1/E|error|^2.
pub(super) struct Quadratic {
    /// H(w_0).
    pub value: Complex<f64>,
    /// dH/dw at w_0.
    pub slope: Complex<f64>,
    /// E|error of the value|^2 if the errors of the points are independent.
    pub variance: f64,
    /// Sum of |residual|^2/E|error|^2. Its mean is the number of points minus 3 if the parabola describes the response.
    pub misfit: f64,
}

/// The parabola about `about_rad_s`; `None` if the points do not determine it.
pub(super) fn fit(points: &[ResponsePoint], about_rad_s: f64) -> Option<Quadratic> {
    let distance = |point: &ResponsePoint| (point.omega_rad_s - about_rad_s).abs();
    let scale_rad_s = points.iter().map(distance).fold(0.0, f64::max);
    let row = |point: &ResponsePoint| {
        let x = (point.omega_rad_s - about_rad_s) / scale_rad_s;
        Vector3::new(1.0, x, x * x)
    };
    let (mut normal, mut re, mut im) = (Matrix3::zeros(), Vector3::zeros(), Vector3::zeros());
    for point in points {
        let (x, weight) = (row(point), 1.0 / point.variance);
        normal += x * x.transpose() * weight;
        re += x * (weight * point.response.re);
        im += x * (weight * point.response.im);
    }
    let covariance = normal.try_inverse()?;
    let (re, im) = (covariance * re, covariance * im);
    let at = |x: &Vector3<f64>| Complex::new(re.dot(x), im.dot(x));
    let residual = |point: &ResponsePoint| (point.response - at(&row(point))).norm_sqr();
    let quadratic = Quadratic {
        value: Complex::new(re[0], im[0]),
        slope: Complex::new(re[1], im[1]) / scale_rad_s,
        variance: covariance[(0, 0)],
        misfit: points.iter().map(|p| residual(p) / p.variance).sum(),
    };
    let is_finite = quadratic.value.norm().is_finite() && quadratic.misfit.is_finite();
    (is_finite && quadratic.variance > 0.0).then_some(quadratic)
}

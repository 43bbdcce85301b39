//! Gain margin and phase margin of a loop on a grid of frequencies.

use nalgebra::Complex;

/// The smallest factor above 1 by which L may grow before it reaches -1: 1/|L| at the crossings of the negative real axis between
/// -1 and 0, interpolated between neighbouring frequencies. `None` without such a crossing.
pub fn gain_margin(open_loop: &[Complex<f64>]) -> Option<f64> {
    let crossings = open_loop.windows(2).filter_map(|pair| {
        let (a, b) = (pair[0], pair[1]);
        let crosses = (a.im > 0.0) != (b.im > 0.0);
        let at = a.re + (b.re - a.re) * a.im / (a.im - b.im);
        (crosses && at < 0.0 && at > -1.0).then_some(-1.0 / at)
    });
    crossings.reduce(f64::min)
}

/// The smallest angle in degrees between L and -1 where |L| = 1, interpolated in ln L. `None` if |L| is never 1.
pub fn phase_margin_deg(open_loop: &[Complex<f64>]) -> Option<f64> {
    let crossings = open_loop.windows(2).filter_map(|pair| {
        let (a, b) = (pair[0].norm().ln(), pair[1].norm().ln());
        let crosses = (a > 0.0) != (b > 0.0);
        // -L, so that the angle from -1 is the argument.
        let (first, turn) = ((-pair[0]).arg(), (pair[1] / pair[0]).arg());
        let angle = first + turn * a / (a - b);
        crosses.then_some(libm::remainder(angle, 2.0 * std::f64::consts::PI).abs())
    });
    crossings.reduce(f64::min).map(f64::to_degrees)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L = k/(s (s + 1)^2): |L| = 1 and arg L = -180 deg - PM in closed form.
    fn triple(k: f64) -> Vec<Complex<f64>> {
        let frequencies = (0..4000).map(|i| libm::pow(10.0, f64::from(i) / 1000.0 - 2.0));
        frequencies
            .map(|w| {
                let s = Complex::new(0.0, w);
                Complex::from(k) / (s * (s + 1.0) * (s + 1.0))
            })
            .collect()
    }

    #[test]
    fn margins_of_a_triple_pole_are_those_of_the_closed_form() {
        // arg L = -180 deg at w = 1, where |L| = k/2. With k = 0.5 |L| = 1 at w (1 + w^2) = 0.5, w = 0.42385.
        let l = triple(0.5);
        assert!((gain_margin(&l).unwrap() - 4.0).abs() < 1e-4);
        let expected = 90.0 - 2.0 * libm::atan(0.423_853_8_f64).to_degrees();
        assert!((phase_margin_deg(&l).unwrap() - expected).abs() < 1e-3);
    }

    #[test]
    fn loop_below_one_has_no_phase_margin() {
        let small = [Complex::new(0.1, -0.1), Complex::new(0.05, 0.02)];
        assert_eq!(phase_margin_deg(&small), None);
        assert_eq!(gain_margin(&small), None);
    }
}

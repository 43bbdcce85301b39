//! The acceleration of the floor: a sum of lines, each of which is band-passed white noise with a given RMS.
//!
//! p'' + 2 zeta w p' + w^2 p = white noise; the line is v = p', whose spectrum is a band-pass around w. In the steady state the
//! covariance of x = (w p, v) is rms^2 I. Exact samples are x+ = F x + L n with the matrix exponential F over a period and
//! L L^T = rms^2 (I - F F^T). RMS and spectrum therefore do not depend on the period of the ticks.

use nalgebra::{Matrix2, Vector2};

use super::noise::Gaussian;
use bench_plant::FloorLine;
use bench_plant::matrix_exponential;

/// One line of the acceleration.
#[derive(Clone, Debug)]
pub(super) struct Line {
    over_period: Matrix2<f64>,
    noise_gain: Matrix2<f64>,
    state: Vector2<f64>,
    noise: Gaussian,
}

impl Line {
    pub(super) fn new(line: &FloorLine, period_s: f64, mut noise: Gaussian) -> Self {
        let w = 2.0 * std::f64::consts::PI * line.frequency_hz;
        let rates = Matrix2::new(0.0, w, -w, -2.0 * line.damping_ratio * w);
        let over_period = matrix_exponential(&(rates * period_s));
        let rms = line.acceleration_rms_m_per_s2;
        let missing = Matrix2::identity() - over_period * over_period.transpose();
        let state = Vector2::new(noise.next(), noise.next()) * rms;
        Line {
            over_period,
            noise_gain: cholesky(&missing) * rms,
            state,
            noise,
        }
    }

    /// The acceleration in m/s^2 during the next period.
    pub(super) fn next(&mut self) -> f64 {
        let acceleration = self.state[1];
        let fresh = Vector2::new(self.noise.next(), self.noise.next());
        self.state = self.over_period * self.state + self.noise_gain * fresh;
        acceleration
    }
}

/// The lower triangular factor of a matrix that is positive semidefinite except for rounding.
fn cholesky(matrix: &Matrix2<f64>) -> Matrix2<f64> {
    let l11 = matrix[(0, 0)].max(0.0).sqrt();
    let l21 = if l11 > 0.0 { matrix[(1, 0)] / l11 } else { 0.0 };
    let l22 = (matrix[(1, 1)] - l21 * l21).max(0.0).sqrt();
    Matrix2::new(l11, 0.0, l21, l22)
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: FloorLine = FloorLine {
        frequency_hz: 70.0,
        damping_ratio: 0.1,
        acceleration_rms_m_per_s2: 2e-3,
    };

    #[test]
    fn the_rms_does_not_depend_on_the_tick() {
        for rate_hz in [500.0, 1000.0, 5000.0] {
            let mut line = Line::new(&LINE, 1.0 / rate_hz, Gaussian::new(3, 1));
            let n = (400.0 * rate_hz) as usize;
            let rms = ((0..n).map(|_| line.next().powi(2)).sum::<f64>() / n as f64).sqrt();
            // The square's correlation time is 1/(2 zeta w) = 11 ms: 18,000 independent values in 400 s, 0.5 % in RMS.
            assert!((rms / 2e-3 - 1.0).abs() < 0.025, "{rms} at {rate_hz} Hz");
        }
    }

    #[test]
    fn the_autocorrelation_is_that_of_the_band_pass() {
        let rate_hz = 5000.0;
        let mut line = Line::new(&LINE, 1.0 / rate_hz, Gaussian::new(4, 1));
        let values: Vec<f64> = (0..2_000_000).map(|_| line.next()).collect();
        let power = values.iter().map(|a| a * a).sum::<f64>();
        let (w, zeta) = (2.0 * std::f64::consts::PI * 70.0, 0.1f64);
        let damped = w * (1.0 - zeta * zeta).sqrt();
        for lag in [10usize, 25, 36, 71, 143] {
            let tau = lag as f64 / rate_hz;
            let exact = (-zeta * w * tau).exp()
                * ((damped * tau).cos() - zeta * w / damped * (damped * tau).sin());
            let ours = values
                .iter()
                .zip(&values[lag..])
                .map(|(a, b)| a * b)
                .sum::<f64>()
                / power;
            // 400 s again: the standard deviation of a correlation is 0.7 %; the tolerance is four of them.
            assert!((ours - exact).abs() < 0.03, "lag {lag}: {ours} for {exact}");
        }
    }
}

//! Amplifier and modes, exactly discretised for a set-point held over each period.
//!
//! The current follows the set-point through the amplifier's lag, i' = wa (u - i). Each mode is driven by the force of that
//! current, q'' + 2 zeta w q' + w^2 q = b Kf i + f, with f any other force on the mode (floor, stop), held as well. One
//! matrix exponential per mode advances its state over a period without error, whatever the period's length. With an infinite
//! bandwidth the force is that of the set-point, and the current state is the set-point of the period before.
//!
//! The states of a mode are q and q'/w, so that both are of one size; of a free body, w = 0, they are q and q' (over 1 rad/s).

use nalgebra::{Complex, DMatrix, Matrix5};

use super::{Mode, matrix_exponential};

/// One mode over one period: x+ = A x + current i + setpoint u + force f, y = output q.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteMode {
    /// A, row by row.
    pub a: [[f64; 2]; 2],
    /// Effect of the current at the period's start, per ampere.
    pub current: [f64; 2],
    /// Effect of the set-point held over the period, per ampere.
    pub setpoint: [f64; 2],
    /// Effect of another modal force held over the period.
    pub force: [f64; 2],
    /// Displacement at the probe per unit of q.
    pub output: f64,
    /// Velocity at the probe per unit of q'/w.
    pub output_rate: f64,
    /// Modal force per m/s^2 of floor acceleration.
    pub floor: f64,
}

/// State of amplifier and modes.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantState {
    /// The amplifier's current in amperes.
    pub current_a: f64,
    /// The states [q, q'/w] of each mode.
    pub states: Vec<[f64; 2]>,
}

/// Amplifier and modes over one period.
#[derive(Clone, Debug, PartialEq)]
pub struct DiscretePlant {
    /// Length of the period in seconds.
    pub period_s: f64,
    /// The part of the current that remains after a period: exp(-wa T).
    pub lag: f64,
    /// The modes.
    pub modes: Vec<DiscreteMode>,
}

impl DiscretePlant {
    /// Discretises `modes`, driven through an amplifier of `bandwidth_hz` and a motor of `force_constant_n_per_a`.
    pub fn new(
        modes: &[Mode],
        bandwidth_hz: f64,
        force_constant_n_per_a: f64,
        period_s: f64,
    ) -> DiscretePlant {
        let lag_rad_s = 2.0 * std::f64::consts::PI * bandwidth_hz;
        let modes = modes.iter().map(|mode| {
            let rates = rates(mode, lag_rad_s, force_constant_n_per_a);
            DiscreteMode::new(mode, &matrix_exponential(&(rates * period_s)))
        });
        DiscretePlant {
            period_s,
            lag: libm::exp(-lag_rad_s * period_s),
            modes: modes.collect(),
        }
    }

    /// Current per ampere of set-point at the period's start, at z = exp(j w T).
    pub fn current_response(&self, z: Complex<f64>) -> Complex<f64> {
        (z - self.lag).inv() * (1.0 - self.lag)
    }

    /// Response in metres per ampere from set-point to position at the period's start, at z = exp(j w T). Delays are those
    /// of [`super::LoopPlant`].
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let current = self.current_response(z);
        let modes = self.modes.iter();
        modes
            .map(|mode| mode.state_response([mode.output, 0.0], z, current))
            .sum()
    }

    /// The state at rest.
    pub fn at_rest(&self) -> PlantState {
        PlantState {
            current_a: 0.0,
            states: vec![[0.0; 2]; self.modes.len()],
        }
    }

    /// Advances the state by one period with the set-point held; `force` is another force on a mode, held as well.
    pub fn step(
        &self,
        state: &mut PlantState,
        setpoint_a: f64,
        force: impl Fn(&DiscreteMode) -> f64,
    ) {
        let current_a = state.current_a;
        for (mode, x) in self.modes.iter().zip(&mut state.states) {
            *x = mode.advanced(*x, current_a, setpoint_a, force(mode));
        }
        state.current_a = setpoint_a + (current_a - setpoint_a) * self.lag;
    }

    /// Displacement at the probe in metres.
    pub fn position_m(&self, state: &PlantState) -> f64 {
        let modes = self.modes.iter().zip(&state.states);
        modes.map(|(mode, x)| mode.output * x[0]).sum()
    }

    /// Velocity at the probe in metres per second.
    pub fn velocity_m_per_s(&self, state: &PlantState) -> f64 {
        let modes = self.modes.iter().zip(&state.states);
        modes.map(|(mode, x)| mode.output_rate * x[1]).sum()
    }

    /// x+ = A x + B u, y = C x with the states [i, q1, q1'/w1, q2, ...].
    pub fn state_space(&self) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let (mut a, mut b, mut c) = zero_system(1 + 2 * self.modes.len());
        a[(0, 0)] = self.lag;
        b[(0, 0)] = 1.0 - self.lag;
        for (index, mode) in self.modes.iter().enumerate() {
            let first = 1 + 2 * index;
            for row in 0..2 {
                a[(first + row, first)] = mode.a[row][0];
                a[(first + row, first + 1)] = mode.a[row][1];
                a[(first + row, 0)] = mode.current[row];
                b[(first + row, 0)] = mode.setpoint[row];
            }
            c[(0, first)] = mode.output;
        }
        (a, b, c)
    }
}

/// A, B and C of a system with n states, all zero.
pub(super) fn zero_system(n: usize) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
    (
        DMatrix::zeros(n, n),
        DMatrix::zeros(n, 1),
        DMatrix::zeros(1, n),
    )
}

/// F of x' = F x with the states [q, q'/scale, i, u, f] of a mode.
fn rates(mode: &Mode, lag_rad_s: f64, force_constant_n_per_a: f64) -> Matrix5<f64> {
    let (w, scale) = (mode.omega_rad_s, mode.rate_scale_rad_s());
    let mut rates = Matrix5::zeros();
    rates[(0, 1)] = scale;
    rates[(1, 0)] = -w;
    rates[(1, 1)] = -2.0 * mode.damping_ratio * w;
    rates[(1, 4)] = 1.0 / scale;
    let force = mode.force_gain * force_constant_n_per_a / scale;
    if lag_rad_s.is_finite() {
        rates[(1, 2)] = force;
        rates[(2, 2)] = -lag_rad_s;
        rates[(2, 3)] = lag_rad_s;
    } else {
        rates[(1, 3)] = force;
    }
    rates
}

impl DiscreteMode {
    /// The mode from exp(F T).
    fn new(mode: &Mode, over: &Matrix5<f64>) -> DiscreteMode {
        let column = |j: usize| [over[(0, j)], over[(1, j)]];
        DiscreteMode {
            a: [[over[(0, 0)], over[(0, 1)]], [over[(1, 0)], over[(1, 1)]]],
            current: column(2),
            setpoint: column(3),
            force: column(4),
            output: mode.sensor_gain,
            output_rate: mode.sensor_gain * mode.rate_scale_rad_s(),
            floor: mode.floor_gain,
        }
    }

    /// The state after a period.
    pub(super) fn advanced(
        &self,
        x: [f64; 2],
        current_a: f64,
        setpoint_a: f64,
        force: f64,
    ) -> [f64; 2] {
        [0, 1].map(|i| {
            self.a[i][0] * x[0]
                + self.a[i][1] * x[1]
                + self.current[i] * current_a
                + self.setpoint[i] * setpoint_a
                + self.force[i] * force
        })
    }

    /// row . [q, q'/w] per ampere of set-point at the period's start, at z = exp(j w T), with the current per ampere of
    /// [`DiscretePlant::current_response`].
    pub(super) fn state_response(
        &self,
        row: [f64; 2],
        z: Complex<f64>,
        current: Complex<f64>,
    ) -> Complex<f64> {
        self.along(row).at(z, current)
    }

    /// The response of row . [q, q'/w], to be evaluated at many z.
    pub(super) fn along(&self, row: [f64; 2]) -> RowResponse {
        let [[a11, a12], [a21, a22]] = self.a;
        // row . adj(z - A) b, for the effect b of the current or of the set-point.
        let numerator = |[first, second]: [f64; 2]| Linear {
            constant: first * (row[1] * a21 - row[0] * a22)
                + second * (row[0] * a12 - row[1] * a11),
            slope: row[0] * first + row[1] * second,
        };
        RowResponse {
            of_current: numerator(self.current),
            of_setpoint: numerator(self.setpoint),
            diagonal: [a11, a22],
            off_diagonal: a12 * a21,
        }
    }
}

/// row (z - A)^-1 (current I(z) + setpoint), with numerator and denominator as functions of z:
///
/// ```text
/// (I(z) (c0 + c1 z) + s0 + s1 z)/((z - a11) (z - a22) - a12 a21)
/// ```
///
/// The denominator is not multiplied out: at low frequencies that would be a difference of nearly equal numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct RowResponse {
    pub(super) of_current: Linear,
    pub(super) of_setpoint: Linear,
    /// a11 and a22.
    pub(super) diagonal: [f64; 2],
    /// a12 a21.
    pub(super) off_diagonal: f64,
}

/// constant + slope z.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    pub(super) constant: f64,
    pub(super) slope: f64,
}

impl Linear {
    fn at(&self, z: Complex<f64>) -> Complex<f64> {
        z * self.slope + self.constant
    }
}

impl RowResponse {
    /// As [`DiscreteMode::state_response`].
    pub(super) fn at(&self, z: Complex<f64>, current: Complex<f64>) -> Complex<f64> {
        let numerator = current * self.of_current.at(z) + self.of_setpoint.at(z);
        let denominator = (z - self.diagonal[0]) * (z - self.diagonal[1]) - self.off_diagonal;
        // One division in place of two.
        numerator * denominator.conj() * (1.0 / denominator.norm_sqr())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DVector;

    fn mode() -> Mode {
        let shape = DVector::zeros(1);
        Mode {
            omega_rad_s: 184.0,
            damping_ratio: 0.009,
            shape,
            force_gain: 0.7,
            sensor_gain: 0.6,
            floor_gain: 1.0,
        }
    }

    const BANDWIDTH_HZ: f64 = 1000.0;

    #[test]
    fn free_oscillation_matches_closed_form() {
        let (mode, period_s) = (mode(), 2e-4);
        let block =
            DiscretePlant::new(std::slice::from_ref(&mode), BANDWIDTH_HZ, 11.12, period_s).modes[0];
        // Released from a displacement: q(t) = exp(-zeta w t) (cos wd t + zeta/sqrt(1 - zeta^2) sin wd t).
        let (mut x, zeta) = ([1.0, 0.0], mode.damping_ratio);
        let damped = (1.0 - zeta * zeta).sqrt();
        for tick in 1..=10_000 {
            x = [0, 1].map(|row| block.a[row][0] * x[0] + block.a[row][1] * x[1]);
            let phase = mode.omega_rad_s * damped * period_s * f64::from(tick);
            let exact = (-zeta * mode.omega_rad_s * period_s * f64::from(tick)).exp()
                * (phase.cos() + zeta / damped * phase.sin());
            // Ten thousand steps, each rounded at 1e-16.
            assert!(
                (x[0] - exact).abs() < 1e-11,
                "tick {tick}: {} for {exact}",
                x[0]
            );
        }
    }

    #[test]
    fn is_exact_at_any_period() {
        let coarse = DiscretePlant::new(&[mode()], BANDWIDTH_HZ, 11.12, 1e-3);
        let fine = DiscretePlant::new(&[mode()], BANDWIDTH_HZ, 11.12, 1e-3 / 4.0);
        let ((a, b, _), (fa, fb, _)) = (coarse.state_space(), fine.state_space());
        let four = &fa * &fa * &fa * &fa;
        let held = (&fa * &fa * &fa + &fa * &fa + &fa + DMatrix::identity(3, 3)) * fb;
        assert!((four - a).amax() < 1e-14 && (held - &b).amax() < 1e-14 * b.amax().max(1.0));
    }

    #[test]
    fn response_equals_that_of_the_state_space() {
        let sampled = DiscretePlant::new(&[mode()], BANDWIDTH_HZ, 11.12, 2e-4);
        let (a, b, c) = sampled.state_space();
        let complex = |m: DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
        for angle in [1e-4, 0.03, 0.5, 3.0] {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let resolvent = (DMatrix::identity(3, 3) * z - complex(a.clone()))
                .lu()
                .solve(&complex(b.clone()))
                .unwrap();
            let direct = (complex(c.clone()) * resolvent)[(0, 0)];
            assert!(
                (sampled.response(z) - direct).norm() < 1e-9 * direct.norm(),
                "at {angle}"
            );
        }
    }

    #[test]
    fn low_frequency_response_is_the_static_compliance() {
        let sampled = DiscretePlant::new(&[mode()], BANDWIDTH_HZ, 11.12, 2e-4);
        let compliance = 0.7 * 0.6 * 11.12 / (184.0 * 184.0);
        let z = Complex::new(1.0, 1e-9);
        assert!((sampled.response(z).re / compliance - 1.0).abs() < 1e-6);
    }
}

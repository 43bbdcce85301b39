//! A loop of plant, amplifier, hold, delay and controller: its response, its poles, its step.

use nalgebra::{Complex, DMatrix, Schur};

use super::controller::continuous_response;
use super::margins::{Margins, grid, margins};
use super::{Controller, Section};
use crate::config::Config;
use crate::model::plant::{LoopPlant, Mode};

/// Everything that decides the margins of a loop.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    modes: Vec<Mode>,
    force_constant_n_per_a: f64,
    sections: Vec<Section>,
    chain: LoopPlant,
    controller: Controller,
}

impl ClosedLoop {
    /// The loop of a configuration around `modes`.
    pub fn new(config: &Config, modes: Vec<Mode>, sections: Vec<Section>) -> ClosedLoop {
        ClosedLoop {
            chain: LoopPlant::new(config, &modes),
            controller: Controller::new(&sections, config.servo.period_s()),
            modes,
            force_constant_n_per_a: config.motor.force_constant_n_per_a,
            sections,
        }
    }

    /// Hold, amplifier, modes, delays and the probe's rate.
    pub fn chain(&self) -> &LoopPlant {
        &self.chain
    }

    /// P in metres per ampere at z = exp(j w T): hold, amplifier, modes, delays and the probe's rate.
    pub fn sampled_plant(&self, omega_rad_s: f64) -> Complex<f64> {
        self.chain.response(omega_rad_s)
    }

    /// L = P C as the sampled loop has it.
    pub fn sampled_loop(&self, omega_rad_s: f64) -> Complex<f64> {
        self.chain.response(omega_rad_s) * self.controller.response(self.z(omega_rad_s))
    }

    /// L = P C in continuous time, without hold, delay and amplifier.
    pub fn continuous_loop(&self, omega_rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega_rad_s);
        let plant: Complex<f64> = self
            .modes
            .iter()
            .map(|mode| mode.resonance(s) * mode.residue_per_kg())
            .sum();
        plant * self.force_constant_n_per_a * continuous_response(&self.sections, s)
    }

    /// Margins of the sampled loop, or of the continuous one.
    pub fn margins(&self, continuous: bool) -> Margins {
        let nyquist_rad_s = std::f64::consts::PI / self.chain.period_s();
        let slowest = self.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
        let low_rad_s = 1e-3
            * slowest
                .map_or(1.0, |mode| mode.omega_rad_s)
                .min(nyquist_rad_s);
        if continuous {
            let highest = self
                .modes
                .last()
                .map_or(1.0, |mode| mode.omega_rad_s)
                .max(nyquist_rad_s);
            let grid = grid(low_rad_s, 10.0 * highest, &self.features());
            return margins(
                &|w| self.continuous_loop(w),
                &grid,
                self.continuous_stable(),
                true,
            );
        }
        let grid = grid(low_rad_s, nyquist_rad_s * (1.0 - 1e-9), &self.features());
        margins(
            &|w| self.sampled_loop(w),
            &grid,
            self.sampled_stable(),
            false,
        )
    }

    /// Frequencies in rad/s that follow every resonance of plant and controller.
    pub fn frequencies(&self, low_rad_s: f64, high_rad_s: f64) -> Vec<f64> {
        grid(low_rad_s, high_rad_s, &self.features())
    }

    /// Reading (in metres, relative to the start) at each tick after a reference of `reference_m(tick)`: the linear loop
    /// from rest, without noise, disturbance and limits.
    pub fn simulate(&self, ticks: usize, reference_m: impl Fn(usize) -> f64) -> Vec<f64> {
        self.course(ticks, reference_m)
            .map(|(_, position_m)| position_m)
            .collect()
    }

    /// The same with the command in amperes of each tick before its reading.
    pub fn course(
        &self,
        ticks: usize,
        reference_m: impl Fn(usize) -> f64,
    ) -> impl Iterator<Item = (f64, f64)> {
        let mut controller = self.controller.clone();
        controller.reset();
        let mut state = self.chain.at_rest();
        (0..ticks).map(move |tick| {
            let position_m = self.chain.reading_m(&state);
            let command_a = controller.update(reference_m(tick) - position_m);
            self.chain.step(&mut state, command_a);
            (command_a, position_m)
        })
    }

    fn z(&self, omega_rad_s: f64) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(omega_rad_s * self.chain.period_s());
        Complex::new(cosine, sine)
    }

    /// Where the loop's response turns quickly: the plant's modes and the controller's lightly damped pairs.
    fn features(&self) -> Vec<(f64, f64)> {
        let modes = self
            .modes
            .iter()
            .map(|mode| (mode.omega_rad_s, mode.damping_ratio))
            .filter(|(w, _)| *w > 0.0);
        let pairs = self
            .sections
            .iter()
            .flat_map(|section| [section.numerator, section.denominator])
            .filter_map(|c| {
                let w = (c[0] / c[2]).sqrt();
                (c[2] != 0.0 && w > 0.0).then(|| (w, (c[1] / (2.0 * c[2] * w)).abs()))
            });
        modes
            .chain(pairs.filter(|(w, zeta)| w.is_finite() && *zeta < 0.5))
            .collect()
    }

    /// All poles of the sampled closed loop lie inside the unit circle.
    fn sampled_stable(&self) -> bool {
        let (a, b, c) = self.chain.state_space();
        let plant = Cascade::new(a, b, c, 0.0);
        let sections = self.controller.sections().iter().map(|section| {
            let (a, b, c, d) = section.state_space();
            let matrix =
                |rows, columns, values: &[f64]| DMatrix::from_column_slice(rows, columns, values);
            Cascade::new(
                matrix(2, 2, a.as_slice()),
                matrix(2, 1, b.as_slice()),
                matrix(1, 2, c.as_slice()),
                d,
            )
        });
        let open = sections
            .fold(Cascade::gain(1e6), |chain, section| chain.then(&section))
            .then(&plant);
        open.closed_poles()
            .is_some_and(|poles| poles.iter().all(|pole| pole.norm() < 1.0))
    }

    /// All poles of the continuous closed loop lie left of the imaginary axis.
    fn continuous_stable(&self) -> bool {
        let open = self
            .sections
            .iter()
            .fold(Cascade::gain(1e6), |chain, section| {
                chain.then(&Cascade::of_section(section))
            });
        let plant = Cascade::of_modes(&self.modes, self.force_constant_n_per_a);
        open.then(&plant)
            .closed_poles()
            .is_some_and(|poles| poles.iter().all(|pole| pole.re < 0.0))
    }
}

/// x' (or x+) = A x + B u, y = C x + D u, one input and one output.
struct Cascade {
    a: DMatrix<f64>,
    b: DMatrix<f64>,
    c: DMatrix<f64>,
    d: f64,
}

impl Cascade {
    fn new(a: DMatrix<f64>, b: DMatrix<f64>, c: DMatrix<f64>, d: f64) -> Self {
        Cascade { a, b, c, d }
    }

    fn gain(d: f64) -> Self {
        Cascade::new(
            DMatrix::zeros(0, 0),
            DMatrix::zeros(0, 1),
            DMatrix::zeros(1, 0),
            d,
        )
    }

    /// Controllable form in time scaled by the pole's own frequency, which keeps the entries of one size.
    fn of_section(section: &Section) -> Self {
        let order = section.poles().len();
        let lead = section.denominator[order];
        let (n, m) = (
            section.numerator.map(|c| c / lead),
            section.denominator.map(|c| c / lead),
        );
        let d = n[order];
        let w = if order == 2 && m[0] > 0.0 {
            m[0].sqrt()
        } else {
            1.0
        };
        match order {
            0 => Cascade::gain(d),
            1 => {
                let one = |x| DMatrix::from_element(1, 1, x);
                Cascade::new(one(-m[0]), one(1.0), one(n[0] - m[0] * d), d)
            }
            _ => Cascade::new(
                DMatrix::from_row_slice(2, 2, &[0.0, w, -m[0] / w, -m[1]]),
                DMatrix::from_row_slice(2, 1, &[0.0, 1.0]),
                DMatrix::from_row_slice(1, 2, &[(n[0] - m[0] * d) / w, n[1] - m[1] * d]),
                d,
            ),
        }
    }

    fn of_modes(modes: &[Mode], force_constant_n_per_a: f64) -> Self {
        let n = 2 * modes.len();
        let (mut a, mut b, mut c) = (
            DMatrix::zeros(n, n),
            DMatrix::zeros(n, 1),
            DMatrix::zeros(1, n),
        );
        for (index, mode) in modes.iter().enumerate() {
            let (first, w, scale) = (2 * index, mode.omega_rad_s, mode.rate_scale_rad_s());
            a[(first, first + 1)] = scale;
            a[(first + 1, first)] = -w;
            a[(first + 1, first + 1)] = -2.0 * mode.damping_ratio * w;
            b[(first + 1, 0)] = mode.force_gain * force_constant_n_per_a / scale;
            c[(0, first)] = mode.sensor_gain;
        }
        Cascade::new(a, b, c, 0.0)
    }

    /// This system, its output into `next`.
    fn then(&self, next: &Cascade) -> Cascade {
        let (n, m) = (self.a.nrows(), next.a.nrows());
        let (mut a, mut b, mut c) = (
            DMatrix::zeros(n + m, n + m),
            DMatrix::zeros(n + m, 1),
            DMatrix::zeros(1, n + m),
        );
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, n), (m, m)).copy_from(&next.a);
        a.view_mut((n, 0), (m, n)).copy_from(&(&next.b * &self.c));
        b.view_mut((0, 0), (n, 1)).copy_from(&self.b);
        b.view_mut((n, 0), (m, 1)).copy_from(&(&next.b * self.d));
        c.view_mut((0, 0), (1, n)).copy_from(&(&self.c * next.d));
        c.view_mut((0, n), (1, m)).copy_from(&next.c);
        Cascade::new(a, b, c, self.d * next.d)
    }

    /// Eigenvalues of A - B C/(1 + D), the loop closed by u = -y.
    fn closed_poles(&self) -> Option<Vec<Complex<f64>>> {
        let mut closed = &self.a - &self.b * &self.c / (1.0 + self.d);
        balance(&mut closed);
        let schur = Schur::try_new(closed, f64::EPSILON, 100_000)?;
        Some(schur.complex_eigenvalues().iter().copied().collect())
    }
}

/// Scales rows and columns by powers of two until they are of one size (Osborne 1960): a similarity that changes no
/// eigenvalue, not even in its last bit, and lets the iteration resolve poles beside entries many decades larger.
fn balance(matrix: &mut DMatrix<f64>) {
    let n = matrix.nrows();
    for _ in 0..100 {
        let mut settled = true;
        for i in 0..n {
            let off = |sum: f64, (j, x): (usize, &f64)| if j == i { sum } else { sum + x.abs() };
            let row = matrix.row(i).iter().enumerate().fold(0.0, off);
            let column = matrix.column(i).iter().enumerate().fold(0.0, off);
            if row == 0.0 || column == 0.0 {
                continue;
            }
            let factor = libm::exp2(libm::round(0.5 * libm::log2(row / column)));
            if factor != 1.0 {
                settled = false;
                matrix.row_mut(i).unscale_mut(factor);
                matrix.column_mut(i).scale_mut(factor);
            }
        }
        if settled {
            return;
        }
    }
}

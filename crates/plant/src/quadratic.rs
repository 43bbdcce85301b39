//! The SR4DoF mechanism with its exact constraints, not linearised.
//!
//! With z = [x1, y1, y2, y3] about the operating point, c = 0.6/L and a = c Y1o (Eqs. 2-1 to 2-3), the four parallelograms
//! give
//!
//! ```text
//!  x2 = x1 + p(y1 - y2)      x4 = x2 - p(y2)           p(d) = a d + c d^2
//!  x3 = x1 - p(y1 - y3)      x5 = x3 + p(y3)           y4 = y5 = 0
//! ```
//!
//! and with J_i(z) the gradient of x_i, Lagrange's equations of the masses, the bent parallelograms and the X springs are
//!
//! ```text
//!  M(z) z'' = J_4 P + e_1 F - K_y z - C z' - sum of k_i x_i J_i - sum of m_i J_i (J_i' z' + g)      M(z) = sum of m_i J_i J_i^T + M_y
//! ```
//!
//! with P the actuator's force, F a force at the probe, g the floor's acceleration, J_i' z' = z'^T (d^2 x_i/dz^2) z'. The
//! constant force that holds Y1o has no component in X. C is that of the linear structure, so that small motions have the
//! damping of the modes. At z = 0 this is Eq. (2-5).

use nalgebra::{Matrix4, Vector4};

use super::{PlantError, PlantSettings, Sr4dofSettings, Structure, build};

/// Stiffness of the four parallelograms across their beams, as a multiple of the stiffness of one.
#[rustfmt::skip]
const BENDING: Matrix4<f64> = Matrix4::new(
    0.0, 0.0, 0.0, 0.0,
    0.0, 2.0, -1.0, -1.0,
    0.0, -1.0, 2.0, 0.0,
    0.0, -1.0, 0.0, 2.0,
);

/// The mechanism.
#[derive(Clone, Debug)]
pub struct QuadraticSr4dof {
    slope: f64,
    shortening_per_m: f64,
    /// m2 to m5.
    masses_kg: [f64; 4],
    /// Masses that move along the coordinates themselves: m1, m1, m2, m3.
    straight: Matrix4<f64>,
    bending: Matrix4<f64>,
    damping: Matrix4<f64>,
    spring_n_per_m: f64,
}

/// Position and velocity of the mechanism.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QuadraticState {
    /// z in metres.
    pub place: Vector4<f64>,
    /// z' in metres per second.
    pub rate: Vector4<f64>,
}

impl QuadraticState {
    /// This state after a time span with a constant slope.
    fn advanced(&self, slope: &QuadraticState, span_s: f64) -> QuadraticState {
        QuadraticState {
            place: self.place + slope.place * span_s,
            rate: self.rate + slope.rate * span_s,
        }
    }
}

/// Loads beside the actuator's force, held over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disturbance {
    /// Force on stage 1 in X, at the probe, in newtons.
    pub probe_n: f64,
    /// The floor's acceleration in X in m/s^2.
    pub floor_m_per_s2: f64,
}

/// The actuator's force in newtons with the other loads.
#[derive(Clone, Copy)]
struct Load {
    force_n: f64,
    disturbance: Disturbance,
}

/// x_i of a stage, its gradient, and the part of its acceleration that z' causes.
struct StageMotion {
    along_m: f64,
    gradient: Vector4<f64>,
    bend_m_per_s2: f64,
}

impl StageMotion {
    fn new(along_m: f64, gradient: [f64; 4], bend_m_per_s2: f64) -> StageMotion {
        StageMotion {
            along_m,
            gradient: gradient.into(),
            bend_m_per_s2,
        }
    }
}

/// p(d) of a parallelogram, dp/dd, and the part of p'' that the rate of d causes.
struct Shortening {
    along_m: f64,
    slope: f64,
    bend_m_per_s2: f64,
}

impl QuadraticSr4dof {
    /// The mechanism of the settings.
    pub fn of(settings: &PlantSettings) -> Result<QuadraticSr4dof, PlantError> {
        match settings {
            PlantSettings::Sr4dof(s) => Ok(QuadraticSr4dof::new(s, &build(settings)?)),
            other => Err(PlantError::NotQuadratic {
                model: other.model(),
            }),
        }
    }

    fn new(s: &Sr4dofSettings, linear: &Structure) -> QuadraticSr4dof {
        let beam = s.beam();
        let [m1, m2, m3, m4, m5] = s.masses_kg();
        QuadraticSr4dof {
            slope: beam.shortening_per_m() * s.operating_point_m,
            shortening_per_m: beam.shortening_per_m(),
            masses_kg: [m2, m3, m4, m5],
            straight: Matrix4::from_diagonal(&Vector4::new(m1, m1, m2, m3)),
            bending: beam.parallelogram_n_per_m() * BENDING,
            damping: Matrix4::from_fn(|row, column| linear.damping[(row, column)]),
            spring_n_per_m: s.spring_stiffness_n_per_m,
        }
    }

    /// Advances the state by `step_s` with the classical Runge-Kutta method of fourth order. `force_n` is the
    /// actuator's force in newtons at start, middle and end. Per step h, the phase of a mode w errs by (w h)^5/120,
    /// its amplitude by (w h)^6/144.
    pub fn step(
        &self,
        state: &mut QuadraticState,
        step_s: f64,
        force_n: [f64; 3],
        disturbance: Disturbance,
    ) {
        let [start, middle, end] = force_n.map(|force_n| Load {
            force_n,
            disturbance,
        });
        let half_s = 0.5 * step_s;
        let k1 = self.slope_at(*state, start);
        let k2 = self.slope_at(state.advanced(&k1, half_s), middle);
        let k3 = self.slope_at(state.advanced(&k2, half_s), middle);
        let k4 = self.slope_at(state.advanced(&k3, step_s), end);
        let sixth_s = step_s / 6.0;
        state.place += (k1.place + (k2.place + k3.place) * 2.0 + k4.place) * sixth_s;
        state.rate += (k1.rate + (k2.rate + k3.rate) * 2.0 + k4.rate) * sixth_s;
    }

    /// The time derivative of a state.
    fn slope_at(&self, state: QuadraticState, load: Load) -> QuadraticState {
        QuadraticState {
            place: state.rate,
            rate: self.acceleration(&state, load),
        }
    }

    /// z''.
    fn acceleration(&self, state: &QuadraticState, load: Load) -> Vector4<f64> {
        let motions = self.motions(state);
        let force = self.force(state, &motions, load);
        // Positive definite for any finite z, as `straight` is. A state that is not finite remains so and appears in
        // the reading.
        self.mass(&motions)
            .cholesky()
            .map_or(Vector4::from_element(f64::NAN), |factor| {
                factor.solve(&force)
            })
    }

    /// M(z).
    fn mass(&self, motions: &[StageMotion; 4]) -> Matrix4<f64> {
        let mut mass = self.straight;
        for (motion, m) in motions.iter().zip(self.masses_kg) {
            mass += motion.gradient * motion.gradient.transpose() * m;
        }
        mass
    }

    /// M(z) z''.
    fn force(
        &self,
        state: &QuadraticState,
        motions: &[StageMotion; 4],
        load: Load,
    ) -> Vector4<f64> {
        let floor_m_per_s2 = load.disturbance.floor_m_per_s2;
        let actuator = motions[2].gradient * load.force_n;
        let mut force = actuator - self.bending * state.place - self.damping * state.rate;
        // Stage 1 moves along x1 itself.
        force[0] += load.disturbance.probe_n - self.straight[(0, 0)] * floor_m_per_s2;
        for (motion, m) in motions.iter().zip(self.masses_kg) {
            force -= motion.gradient * (m * (motion.bend_m_per_s2 + floor_m_per_s2));
        }
        for motion in &motions[2..] {
            force -= motion.gradient * (self.spring_n_per_m * motion.along_m);
        }
        force
    }

    /// The shortening of a parallelogram that is bent by `d` and bends at `rate`.
    fn shortening(&self, d: f64, rate: f64) -> Shortening {
        Shortening {
            along_m: (self.slope + self.shortening_per_m * d) * d,
            slope: self.slope + 2.0 * self.shortening_per_m * d,
            bend_m_per_s2: 2.0 * self.shortening_per_m * rate * rate,
        }
    }

    /// Stages 2, 3, 4, 5.
    fn motions(&self, state: &QuadraticState) -> [StageMotion; 4] {
        let [x1, y1, y2, y3] = state.place.into();
        let [_, v1, v2, v3] = state.rate.into();
        let (p12, p2) = (self.shortening(y1 - y2, v1 - v2), self.shortening(y2, v2));
        let (p13, p3) = (self.shortening(y1 - y3, v1 - v3), self.shortening(y3, v3));
        let (x2, x3) = (x1 + p12.along_m, x1 - p13.along_m);
        let (s12, s13) = (p12.slope, p13.slope);
        let (b2, b3) = (p12.bend_m_per_s2, -p13.bend_m_per_s2);
        let (x4, x5) = (x2 - p2.along_m, x3 + p3.along_m);
        let (b4, b5) = (b2 - p2.bend_m_per_s2, b3 + p3.bend_m_per_s2);
        [
            StageMotion::new(x2, [1.0, s12, -s12, 0.0], b2),
            StageMotion::new(x3, [1.0, -s13, 0.0, s13], b3),
            StageMotion::new(x4, [1.0, s12, -s12 - p2.slope, 0.0], b4),
            StageMotion::new(x5, [1.0, -s13, 0.0, s13 + p3.slope], b5),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build;
    use crate::test_profile::plant_of_profile;
    use nalgebra::DVector;

    fn settings(sets: &[&str]) -> Sr4dofSettings {
        match plant_of_profile("stage", sets) {
            PlantSettings::Sr4dof(s) => s,
            other => panic!("{other:?}"),
        }
    }

    fn mechanism(s: &Sr4dofSettings) -> (QuadraticSr4dof, Structure) {
        let linear = build(&PlantSettings::Sr4dof(s.clone())).unwrap();
        (QuadraticSr4dof::new(s, &linear), linear)
    }

    /// T + V of a state, by the definition: masses times velocities, springs times elongations.
    fn energy(s: &Sr4dofSettings, q: &QuadraticSr4dof, state: &QuadraticState) -> f64 {
        let motions = q.motions(state);
        let x_speed = |motion: &StageMotion| motion.gradient.dot(&state.rate);
        let moving: f64 = motions
            .iter()
            .zip(q.masses_kg)
            .map(|(motion, m)| m * x_speed(motion).powi(2))
            .sum();
        let straight = state.rate.dot(&(q.straight * state.rate));
        let [y1, y2, y3] = [state.place[1], state.place[2], state.place[3]];
        let k = s.beam().parallelogram_n_per_m();
        let bent = k * ((y1 - y2).powi(2) + y2 * y2 + (y1 - y3).powi(2) + y3 * y3);
        let springs: f64 = motions[2..]
            .iter()
            .map(|motion| q.spring_n_per_m * motion.along_m.powi(2))
            .sum();
        0.5 * (moving + straight + bent + springs)
    }

    #[test]
    fn small_motions_match_the_linear_structure() {
        let s = settings(&[]);
        let (q, linear) = mechanism(&s);
        let inverse = linear.mass.clone().try_inverse().unwrap();
        for axis in 0..4 {
            for (place, rate, force_n) in [(1e-9, 0.0, 0.0), (0.0, 1e-9, 0.0), (0.0, 0.0, 1.0)] {
                let mut state = QuadraticState::default();
                (state.place[axis], state.rate[axis]) = (place, rate);
                let load = Disturbance {
                    probe_n: 0.3 * force_n,
                    floor_m_per_s2: 0.2 * force_n,
                };
                let ours = q.acceleration(
                    &state,
                    Load {
                        force_n,
                        disturbance: load,
                    },
                );
                let vector = |v: &Vector4<f64>| DVector::from_column_slice(v.as_slice());
                let mut force = &linear.force * force_n - &linear.floor * load.floor_m_per_s2;
                force[0] += load.probe_n;
                force -= &linear.stiffness * vector(&state.place)
                    + &linear.damping * vector(&state.rate);
                let expected = &inverse * force;
                // The nonlinear part is quadratic: for a motion of 1e-9 m and Y1o = 4 mm it is 1e-7 of the linear
                // part. The tolerance of 1e-5 allows for stiff axes.
                assert!(
                    (vector(&ours) - &expected).amax() <= 1e-5 * expected.amax(),
                    "{ours} {expected}"
                );
            }
        }
    }

    #[test]
    fn large_undamped_motions_conserve_energy() {
        let s = settings(&["plant.damping={kind=\"uniform\",ratio=0.0}"]);
        let (q, _) = mechanism(&s);
        let mut state = QuadraticState {
            place: Vector4::new(5e-4, 2e-3, -1e-3, 3e-3),
            ..QuadraticState::default()
        };
        let before = energy(&s, &q, &state);
        let mut least = 1.0;
        for _ in 0..50_000 {
            q.step(&mut state, 2e-5, [0.0; 3], Disturbance::default());
            least = f64::min(least, energy(&s, &q, &state) / before);
        }
        // One second: the fastest mode, 540 rad/s, loses 2 * 540 rad * (540 * 2e-5)^5/144 = 1.1e-9 of its energy.
        let left = energy(&s, &q, &state) / before;
        assert!(
            (left - 1.0).abs() < 5e-9 && least > 1.0 - 5e-9,
            "{left} {least}"
        );
        // The motion is strongly nonlinear: the parallelogram between stages 1 and 2 shortens by c (3 mm)^2 = 0.11 mm,
        // compared with x1 = 0.5 mm.
        assert!(state.place.amax() > 1e-4);
    }

    #[test]
    fn error_falls_with_the_fourth_power_of_the_step() {
        let s = settings(&[]);
        let (q, _) = mechanism(&s);
        let after = |steps: usize| {
            let mut state = QuadraticState {
                place: Vector4::new(5e-4, 2e-3, -1e-3, 3e-3),
                ..QuadraticState::default()
            };
            let step_s = 0.02 / steps as f64;
            (0..steps).for_each(|_| q.step(&mut state, step_s, [0.1; 3], Disturbance::default()));
            state.place
        };
        let exact = after(6400);
        let (coarse, fine) = ((after(100) - exact).norm(), (after(200) - exact).norm());
        // Fourth order gives a ratio of 16; the next term of the series changes it by some per cent at 0.1 rad per
        // step.
        assert!((14.0..18.0).contains(&(coarse / fine)), "{}", coarse / fine);
    }
}

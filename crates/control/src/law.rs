//! The interface of control laws: the loop runs a [`ControlLaw`]; margins and stability need its [`LinearLaw`].

use nalgebra::Complex;

use super::Section;
use super::state_space::StateSpace;

/// Input of a control law in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LawInput {
    /// Reference r in metres, in the coordinate of the probe.
    pub reference_m: f64,
    /// Measured position y in metres, in the coordinate of the probe.
    pub position_m: f64,
    /// Current in amperes that the amplifier actually gave for the previous tick: after the interlocks, quantised and
    /// limited. An observer must use this value, not its own request.
    pub applied_a: f64,
}

impl LawInput {
    /// The input with which a law gives `gain` times the loop gain: y' = r - gain (r - y). A law of the error alone receives gain
    /// times the error; the input of a law at rest, r = y, does not change.
    pub fn with_gain(self, gain: f64) -> LawInput {
        if gain == 1.0 {
            return self; // without rounding
        }
        LawInput {
            position_m: self.reference_m - gain * (self.reference_m - self.position_m),
            ..self
        }
    }
}

/// A control law in the loop: one command per tick.
///
/// Sign convention: positive current moves the stage in the positive direction, so that u = C (r - y) has a positive gain.
/// `update` runs in the tick: it must not allocate, lock, print or wait. A request that is not finite trips the interlocks.
///
/// ```
/// use bench_control::{ControlLaw, LawInput};
///
/// /// u = K (r - y), K in A/m.
/// struct Proportional(f64);
///
/// impl ControlLaw for Proportional {
///     fn reset(&mut self, _rest_m: f64) {}
///     fn update(&mut self, input: &LawInput) -> f64 {
///         self.0 * (input.reference_m - input.position_m)
///     }
/// }
///
/// let input = LawInput { reference_m: 2e-6, position_m: -1e-6, applied_a: 0.0 };
/// assert_eq!(Proportional(1e4).update(&input), 1e4 * 3e-6);
/// ```
pub trait ControlLaw: Send {
    /// Discards the state. The stage rests at `rest_m` with zero current, and the loop closes in this tick. Runs in
    /// the tick: must not allocate or block.
    fn reset(&mut self, rest_m: f64);

    /// The request in amperes. Runs in the tick: must not allocate or block.
    fn update(&mut self, input: &LawInput) -> f64;

    /// The law as a linear system, if it is one. Stability and margins are computed from it; a law without it is **not
    /// checked** before it runs, and only the interlocks protect the stage.
    fn linear(&self) -> Option<Box<dyn LinearLaw>> {
        None
    }
}

/// The feedback path of a linear law, u = -C(z) y at zero reference, if the applied current equals the requested one.
pub trait LinearLaw: Send + Sync {
    /// x+ = A x + B e, u = C x + D e with e = -y in metres and u in amperes. `None` for a law with long delay lines, whose matrices
    /// would be large: it overrides the other functions, and stability is then decided by the encirclements of the Nyquist curve.
    fn state_space(&self) -> Option<StateSpace>;

    /// C(z) in amperes per metre.
    fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let unknown = Complex::new(f64::NAN, f64::NAN);
        self.state_space()
            .map_or(unknown, |system| system.response(z))
    }

    /// The poles of C(z) that are not inside the unit circle. `None` if they are not known.
    fn open_loop_poles(&self) -> Option<OpenLoopPoles> {
        Some(OpenLoopPoles::of(&self.state_space()?.poles()?))
    }

    /// Roots in the z plane near which C(z) changes quickly: all poles, and the zeros if they are known. Those of delay lines are
    /// covered by [`delay_ticks`](Self::delay_ticks).
    fn roots(&self) -> Vec<Complex<f64>> {
        let poles = self.state_space().and_then(|system| system.poles());
        poles.unwrap_or_default()
    }

    /// Length N of the longest delay line of a law without matrices: C(z) may have a peak at each multiple of 1/N of the rate.
    fn delay_ticks(&self) -> usize {
        0
    }
}

/// The poles of an open loop that are not inside the unit circle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OpenLoopPoles {
    /// Poles at z = 1: integrators of the control law, and two for each free body of the plant.
    pub integrators: usize,
    /// Poles of the control law outside the unit circle.
    pub unstable: usize,
}

impl OpenLoopPoles {
    /// Counts the poles of a system.
    pub fn of(poles: &[Complex<f64>]) -> OpenLoopPoles {
        // A double pole at 1 is computed with an error of the square root of the rounding, 1e-8.
        const AT_ONE: f64 = 1e-6;
        let is_integrator = |z: &&Complex<f64>| (*z - 1.0).norm() < AT_ONE;
        let is_unstable = |z: &&Complex<f64>| !is_integrator(z) && z.norm() > 1.0 + AT_ONE;
        OpenLoopPoles {
            integrators: poles.iter().filter(is_integrator).count(),
            unstable: poles.iter().filter(is_unstable).count(),
        }
    }
}

/// Settings of a control law, from which a law at rest is made for a loop. Immutable.
pub trait ControlDesign: Send {
    /// A law at rest for a loop of this period.
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw>;

    /// The continuous sections of the law, if it was designed as a cascade of them.
    fn sections(&self) -> Option<&[Section]> {
        None
    }
}

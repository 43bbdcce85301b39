//! A control law of your own: state feedback with an observer of one mode, in closed loop with the simulated stage.
//!
//! `cargo run --example own_control_law`

use bench::config::{Source, load};
use bench::control::{ControlLaw, LawInput};
use bench::excitation::{ReferenceContext, ReferenceDesign, StepReference};
use bench::model::plant::{ModalModel, build};
use bench::rig::simulated::SimulatedRig;
use bench::rt::program::{Control, Program, ProgramInput};
use bench_hal::{CurrentAmplifier, DisplacementProbe, Tick};

/// The slowest mode as x = [position, velocity], its observer, and an integrator of the error.
struct StateFeedback {
    period_s: f64,
    /// w^2, 2 zeta w, and acceleration per ampere.
    mode: [f64; 3],
    /// Correction of position and velocity per metre of the observer's error.
    observer: [f64; 2],
    /// Amperes per metre, per m/s, and per metre and second of the error.
    feedback: [f64; 3],
    x: [f64; 2],
    integral: f64,
    rest_m: f64,
}

impl ControlLaw for StateFeedback {
    fn reset(&mut self, rest_m: f64) {
        (self.x, self.integral, self.rest_m) = ([0.0; 2], 0.0, rest_m);
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let [stiffness, damping, gain] = self.mode;
        let [position_m, velocity] = self.x;
        let innovation_m = input.position_m - self.rest_m - position_m;
        let acceleration = gain * input.applied_a - stiffness * position_m - damping * velocity;
        let velocity = velocity + self.period_s * acceleration + self.observer[1] * innovation_m;
        let position_m = position_m + self.period_s * velocity + self.observer[0] * innovation_m;
        self.x = [position_m, velocity];
        self.integral += self.period_s * (input.reference_m - input.position_m);
        self.feedback[2] * self.integral
            - self.feedback[0] * position_m
            - self.feedback[1] * velocity
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = load(&Source::default())?;
    let period_s = config.servo.period_s();
    let mode = ModalModel::of(&build(&config.plant)?)?.modes[0].clone();
    let (w, n_per_a) = (mode.omega_rad_s, config.motor.force_constant_n_per_a);
    let gain = mode.residue_per_kg() * n_per_a;
    let law = StateFeedback {
        period_s,
        mode: [w * w, 2.0 * mode.damping_ratio * w, gain],
        observer: [0.04, 3.0],
        feedback: [0.0, 0.6 * w / gain, 8.0 * w * w / gain],
        x: [0.0; 2],
        integral: 0.0,
        rest_m: 0.0,
    };
    let step = StepReference {
        amplitude_m: 50e-6,
        at_s: 0.1,
    };
    let context = ReferenceContext {
        chirp: &config.chirp,
        period_s,
        file: None,
    };
    let mut program = Control::new(Box::new(law), step.build(&context)?, 2500, 10_000);
    let mut rig = SimulatedRig::new(&config)?;
    rig.enable()?;
    let (mut applied_a, mut error_m) = (0.0, f64::NAN);
    for number in 0..program.ticks() {
        let scheduled_ns = (number as f64 * period_s * 1e9).round() as u64;
        let position_m = rig
            .latest(Tick {
                number,
                scheduled_ns,
            })
            .position_m;
        let decision = program.decide(&ProgramInput {
            tick: number,
            position_m,
            applied_a,
        });
        applied_a = rig.command(decision.requested_a)?;
        error_m = decision.reference_m - position_m;
    }
    println!("error 1.9 s after a step of 50 um: {:.3} um", error_m * 1e6);
    assert!(error_m.abs() < 2e-6, "the law settles to the reference");
    Ok(())
}

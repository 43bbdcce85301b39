//! A control law of your own: state feedback with an observer of one mode, in closed loop with the simulated stage.
//!
//! `cargo run --example own_control_law`

use bench_config::{Source, load};
use bench_control::{ControlLaw, LawInput};
use bench_excitation::Reference;
use bench_hal::{CurrentAmplifier, DisplacementProbe, Tick, blocking};
use bench_plant::{ModalModel, build};
use bench_rig::simulated::SimulatedRig;
use bench_rt::program::{Control, Program, ProgramInput};

/// Position and velocity of the first driven mode are observed; the error is integrated.
struct StateFeedback {
    period_s: f64,
    /// w^2, 2 zeta w, and acceleration per ampere.
    mode: [f64; 3],
    /// Gains of velocity (A s/m) and of the integral (A/(m s)).
    gains: [f64; 2],
    /// Observed position and velocity, integral of the error, position at rest.
    state: [f64; 4],
}

impl ControlLaw for StateFeedback {
    fn reset(&mut self, rest_m: f64) {
        self.state = [0.0, 0.0, 0.0, rest_m];
    }

    fn update(&mut self, input: &LawInput) -> f64 {
        let ([stiffness, damping, gain], dt) = (self.mode, self.period_s);
        let [position_m, velocity, integral, rest_m] = self.state;
        let innovation_m = input.position_m - rest_m - position_m;
        let acceleration = gain * input.applied_a - stiffness * position_m - damping * velocity;
        let velocity = velocity + dt * acceleration + 3.0 * innovation_m;
        let position_m = position_m + dt * velocity + 0.04 * innovation_m;
        let integral = integral + dt * (input.reference_m - input.position_m);
        self.state = [position_m, velocity, integral, rest_m];
        self.gains[1] * integral - self.gains[0] * velocity
    }
}

/// A step of 50 um, 0.5 s after the loop closes.
struct Step;

impl Reference for Step {
    fn at_m(&self, tick: u64) -> f64 {
        if tick < 2500 { 0.0 } else { 50e-6 }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = load(&Source::default())?;
    let period_s = config.servo.period_s();
    let modes = ModalModel::of(&build(&config.plant)?)?.modes;
    let mut driven = modes.iter().filter(|mode| mode.residue_per_kg() > 0.1);
    let mode = driven.next().ok_or("no mode that the motor drives")?;
    let w = mode.omega_rad_s;
    let gain = mode.residue_per_kg() * config.motor.force_constant_n_per_a;
    let law = StateFeedback {
        period_s,
        mode: [w * w, 2.0 * mode.damping_ratio * w, gain],
        gains: [0.3 * w / gain, 5.0 * w * w / gain],
        state: [0.0; 4],
    };
    let mut program = Control::new(Box::new(law), Box::new(Step), 2500, 10_000);
    let mut rig = SimulatedRig::new(&config)?;
    blocking::enable(&mut rig, std::thread::sleep)?;
    let (mut now, mut input, mut error_m) = (Tick::default(), ProgramInput::default(), f64::NAN);
    for tick in 0..program.ticks() {
        (now.number, now.scheduled_ns) = (tick, (tick as f64 * period_s * 1e9) as u64);
        (input.tick, input.position_m) = (tick, rig.latest(now).position_m);
        let decision = program.decide(&input);
        input.applied_a = rig.command(decision.requested_a)?;
        error_m = decision.reference_m - input.position_m;
    }
    println!("error 1.5 s after a step: {:.3} um", error_m * 1e6);
    assert!(error_m.abs() < 2e-6, "the law settles to the reference");
    Ok(())
}

//! An excitation of your own, run in the loop with the simulated stage: a decaying train of pulses.
//!
//! `cargo run --example own_excitation`

use bench_config::{Config, Source, load};
use bench_excitation::{Excitation, Extremes};
use bench_hal::{CurrentAmplifier, DisplacementProbe, Tick, blocking};
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::Trip;
use bench_rt::interlock::Interlocks;
use bench_rt::program::{Excite, Program, ProgramInput};

/// Pulses of alternating sign, each 1 ms long, their size halved from pulse to pulse.
struct Pulses {
    first_a: f64,
    width: u64,
    interval: u64,
    count: u64,
}

impl Excitation for Pulses {
    fn current_a(&self, tick: u64) -> f64 {
        let (pulse, within) = (tick / self.interval, tick % self.interval);
        let is_on = pulse < self.count && within < self.width;
        f64::from(is_on) * self.first_a * (-0.5f64).powi(pulse as i32)
    }

    fn ticks(&self) -> u64 {
        self.count * self.interval
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let config = load(&Source::default())?;
    let (positions_m, commands_a) = run(&config)?;
    let signals = commands_a.iter().copied().zip(positions_m.iter().copied());
    let limits = config.excitation_limits();
    let extremes = Extremes::over(signals, &limits);
    limits.check(&extremes, None, "Pulses::first_a")?;
    let (travel_um, current_a) = (extremes.travel_m * 1e6, extremes.current_a);
    println!("travel {travel_um:.1} um, largest current {current_a:.3} A");
    assert_eq!(current_a, 0.5, "the first pulse is the largest");
    assert!(
        (1.0..900.0).contains(&travel_um),
        "the stage moves inside its limits"
    );
    Ok(())
}

/// The program of the loop, tick by tick, with the interlocks between it and the simulated stage.
fn run(config: &Config) -> Result<(Vec<f64>, Vec<f64>), Box<dyn std::error::Error>> {
    let mut program = Excite(Pulses {
        first_a: 0.5,
        width: 5,
        interval: 5000,
        count: 4,
    });
    let mut interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    let mut rig = SimulatedRig::new(config)?;
    let period_ns = (config.servo.period_s() * 1e9) as u64;
    let (mut now, mut input) = (Tick::default(), ProgramInput::default());
    let refused = |trip: Trip| trip.to_string();
    let (mut positions_m, mut commands_a) = (Vec::new(), Vec::new());
    blocking::enable(&mut rig, std::thread::sleep)?;
    for number in 0..program.ticks() {
        (now.number, now.scheduled_ns) = (number, number * period_ns);
        let reading = rig.latest(now);
        interlocks.check_reading(&reading, now).map_err(refused)?;
        (input.tick, input.position_m) = (number, reading.position_m);
        let requested_a = program.decide(&input).requested_a;
        interlocks.check_command(requested_a).map_err(refused)?;
        let command_a = rig.command(requested_a)?;
        interlocks.record_current(command_a, command_a);
        positions_m.push(reading.position_m);
        commands_a.push(command_a);
    }
    rig.disable();
    Ok((positions_m, commands_a))
}

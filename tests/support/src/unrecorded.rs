//! The default excitation on the simulated stage, without loop and recording.
use bench_config::Config;
use bench_excitation::{Chirp, Excitation};
use bench_hal::{CurrentAmplifier, DisplacementProbe, Tick};
use bench_identify::Signals;
use bench_rig::simulated::SimulatedRig;

/// Commands and readings of the chirp of a configuration.
pub fn chirp(config: &Config) -> Signals {
    let chirp = Chirp::new(&config.chirp, config.servo.period_s());
    let mut rig = SimulatedRig::new(config).expect("a rig");
    bench_hal::blocking::enable(&mut rig, std::thread::sleep).expect("an amplifier");
    let (mut input_a, mut output_m) = (Vec::new(), Vec::new());
    for number in 0..chirp.ticks() {
        let scheduled_ns = (number as f64 * config.servo.period_s() * 1e9).round() as u64;
        output_m.push(
            rig.latest(Tick {
                number,
                scheduled_ns,
            })
            .position_m,
        );
        input_a.push(rig.command(chirp.current_a(number)).expect("enabled"));
    }
    Signals {
        rate_hz: config.servo.rate_hz,
        input: input_a,
        output: output_m,
    }
}

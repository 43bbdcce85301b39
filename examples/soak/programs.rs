//! The programs of the runs.

use std::error::Error;

use bench_config::{AmplitudePoint, Config, ReferenceSettings};
use bench_excitation::{HoldReference, SineReference, StepReference};
use bench_experiment::Plan;
use bench_rt::program::{Decision, Program, ProgramInput};

use super::faults::{Current, Injection, Period, Schedule};

/// Plans of short runs, which end by themselves, and of runs that are longer than a period.
pub struct Programs {
    short: Vec<Plan>,
    long: Vec<Plan>,
    tick_s: f64,
}

impl Programs {
    /// Closed loops with both controllers, and a chirp.
    pub fn new(config: &Config, schedule: &Schedule) -> Result<Programs, Box<dyn Error>> {
        Ok(Programs {
            short: plans(config, schedule.period_s() / 10.0)?,
            long: plans(config, schedule.period_s())?,
            tick_s: config.servo.period_s(),
        })
    }

    /// The program of the first run of a period.
    pub fn first(&self, period: &Period) -> Result<Box<dyn Program>, Box<dyn Error>> {
        Ok(in_turn(&self.short, period.number).program()?)
    }

    /// The program of the second run of a period, with the fault if it is one of the program.
    pub fn second(&self, period: &Period) -> Result<Box<dyn Program>, Box<dyn Error>> {
        // Every fault meets every program: the order of the programs moves on after each round of faults.
        let turn = period.number + period.number / super::faults::CASES.len() as u64;
        let program = in_turn(&self.long, turn).program()?;
        Ok(match period.case.injection {
            Injection::Program(current) | Injection::Both(_, current) => Box::new(FaultyProgram {
                program,
                current,
                from_tick: period.fault.start - period.second_run,
                tick_s: self.tick_s,
            }),
            Injection::Rig(_) | Injection::Enabling(_) | Injection::MissedTicks(_) => program,
        })
    }
}

fn in_turn(plans: &[Plan], number: u64) -> &Plan {
    &plans[(number % plans.len() as u64) as usize]
}

fn plans(config: &Config, duration_s: f64) -> Result<Vec<Plan>, Box<dyn Error>> {
    let step = StepReference {
        amplitude_m: 50e-6,
        at_s: 0.2,
    };
    let sine = SineReference {
        amplitude_m: 20e-6,
        frequency_hz: 3.0,
    };
    let hold = HoldReference {};
    Ok(vec![
        closed_loop(config, duration_s, "fast", ReferenceSettings::Step(step))?,
        closed_loop(config, duration_s, "slow", ReferenceSettings::Sine(sine))?,
        closed_loop(config, duration_s, "fast", ReferenceSettings::Hold(hold))?,
        chirp(config, duration_s),
    ])
}

fn closed_loop(
    config: &Config,
    duration_s: f64,
    controller: &str,
    reference: ReferenceSettings,
) -> Result<Plan, Box<dyn Error>> {
    let mut config = config.clone();
    config.control.controller = controller.into();
    config.control.reference = reference;
    config.control.duration_s = duration_s;
    Ok(Plan::control(config)?)
}

/// A chirp that moves the stage by less than 0.2 mm at its resonance of 29 Hz.
fn chirp(config: &Config, duration_s: f64) -> Plan {
    let mut config = config.clone();
    let chirp = &mut config.chirp;
    (chirp.quiet_before_s, chirp.quiet_after_s) = (0.1, 0.1);
    (chirp.fade_in_s, chirp.fade_out_s) = (0.5, 0.5);
    chirp.duration_s = duration_s;
    chirp.amplitude = vec![AmplitudePoint {
        frequency_hz: 1.0,
        current_a: 0.02,
    }];
    Plan::chirp(config)
}

/// A program that commands another current from a tick on.
struct FaultyProgram {
    program: Box<dyn Program>,
    current: Current,
    from_tick: u64,
    tick_s: f64,
}

impl Program for FaultyProgram {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        let decision = self.program.decide(input);
        match input.tick.checked_sub(self.from_tick) {
            None => decision,
            Some(ticks) => Decision {
                requested_a: (self.current)(ticks as f64 * self.tick_s),
                ..decision
            },
        }
    }

    fn ticks(&self) -> u64 {
        self.program.ticks()
    }
}

//! The soak in virtual pace. Requests are sent between ticks, so that equal seeds give equal records.

use std::error::Error;

use bench_rt::clock::{Clock, Virtual};
use bench_rt::servo::Servo;

use super::faults::{Injection, Period};
use super::recorder::{Report, joined};
use super::soak_loop::SoakLoop;
use super::supervisor::Supervisor;

/// Runs all periods.
pub fn run(soak: SoakLoop) -> Result<Report, Box<dyn Error>> {
    let SoakLoop {
        mut servo,
        mut supervisor,
        recorder,
        schedule,
        tick_s,
        lease: _,
    } = soak;
    let mut clock = Virtual { period_s: tick_s };
    for number in 0..schedule.periods {
        let period = schedule.period(number);
        run_period(&mut servo, &mut supervisor, &mut clock, &period)?;
        if recorder.is_finished() {
            break;
        }
    }
    drop(servo);
    joined(recorder)
}

fn run_period(
    servo: &mut Servo,
    supervisor: &mut Supervisor,
    clock: &mut Virtual,
    period: &Period,
) -> Result<(), Box<dyn Error>> {
    let mut next = period.ticks.start;
    supervisor.begin_period(period)?;
    while next < period.ticks.end {
        if next == period.second_run {
            supervisor.begin_second_run(period)?;
        }
        let missed = missed_ticks(period, next);
        let mut timing = clock.wait(next + u64::from(missed), servo.run().publisher());
        timing.missed = missed;
        servo.tick(&timing, clock);
        next = timing.tick.number + 1;
    }
    Ok(())
}

fn missed_ticks(period: &Period, tick: u64) -> u32 {
    match period.case.injection {
        Injection::MissedTicks(missed) if tick == period.fault.start => missed,
        Injection::MissedTicks(_)
        | Injection::Rig(_)
        | Injection::Enabling(_)
        | Injection::Program(_)
        | Injection::Both(..) => 0,
    }
}

//! The soak in real time: the thread of the loop, a recorder thread, and this thread as supervisor.

use std::error::Error;
use std::thread::{JoinHandle, sleep};
use std::time::{Duration, Instant};

use bench_config::{Config, LoopSettings};
use bench_rt::clock::Realtime;
use bench_rt::live_loop::run_to_end;
use bench_rt::servo::Servo;
use bench_rt::supervision::ArmLease;
use bench_rt::thread::Pace;

use super::faults::{Period, Schedule};
use super::recorder::{Report, joined};
use super::soak_loop::SoakLoop;

/// Period of the supervisor.
const PAUSE: Duration = Duration::from_millis(5);

/// Runs all periods.
pub fn run(soak: SoakLoop, config: &Config) -> Result<Report, Box<dyn Error>> {
    let schedule = soak.schedule;
    let (mut supervisor, lease) = (soak.supervisor, soak.lease);
    let thread = loop_thread(soak.servo, config.servo.clone());
    let begin = Instant::now();
    for number in 0..schedule.periods {
        let period = schedule.period(number);
        wait_until(&lease, begin, begin_s(&schedule, &period));
        supervisor.begin_period(&period)?;
        wait_until(
            &lease,
            begin,
            begin_s(&schedule, &period) + schedule.period_s() / 5.0,
        );
        supervisor.begin_second_run(&period)?;
    }
    while !thread.is_finished() {
        lease.renew();
        sleep(PAUSE);
    }
    thread
        .join()
        .map_err(|_| "the thread of the loop panicked")?;
    joined(soak.recorder)
}

/// The thread of the loop, scheduled as in a run.
fn loop_thread(mut servo: Servo, settings: LoopSettings) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let scheduling = Pace::Realtime.schedule(&settings);
        println!("loop: {scheduling:?}");
        let privileges = scheduling.hold();
        let clock = Realtime::new(settings.period_s());
        run_to_end(&mut servo, clock.awake_before_ticks(settings.awake_s()));
        drop(privileges);
    })
}

fn begin_s(schedule: &Schedule, period: &Period) -> f64 {
    period.number as f64 * schedule.period_s()
}

/// Renews the lease until `time_s` after `begin`.
fn wait_until(lease: &ArmLease, begin: Instant, time_s: f64) {
    while begin.elapsed().as_secs_f64() < time_s {
        lease.renew();
        sleep(PAUSE);
    }
}

//! Soak test of the loop: many runs, each ended by a fault, with a check that nothing grows and no fault is missed.
//!
//! ```text
//! cargo run --release --example soak -- --ticks 1e8 --seed 1          simulated time, as fast as possible
//! cargo run --release --example soak -- --realtime --duration 600s --every 20s
//! ```
//!
//! Time is divided into periods of `--every`. In each, the loop is armed twice: the first run ends by itself, the second one by the
//! fault of the period. Then the operator clears the trip. All kinds of faults follow each other. A recorder thread writes each
//! period into a file, checks it, and removes it. The exit code is 1 if a fault did not trip as expected, if current flowed
//! without a run, if a record was lost, or if resident memory or the number of file descriptors grew after the first tenth of
//! the periods.

mod faults;
mod programs;
mod realtime;
mod recorder;
mod resources;
mod rig;
mod simulated;
mod soak_loop;
mod supervisor;

use std::error::Error;
use std::process::ExitCode;

use bench_config::{Source, load};
use bench_rt::thread::Pace;
use clap::Parser;

use faults::{CASES, Schedule};
use soak_loop::SoakLoop;

/// Missed ticks per second that are accepted in real time. On a machine that is not idle, the limit of the profile would end most
/// runs before their fault.
const REALTIME_OVERRUNS_PER_S: u32 = 500;

/// Soak test of the loop.
#[derive(Parser)]
struct Options {
    /// Simulated ticks, rounded up to whole periods
    #[arg(long, value_parser = ticks, default_value = "1e6", conflicts_with = "realtime")]
    ticks: u64,
    /// Seed of the simulated stage and of the times of the faults
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Time between two faults, at least 20s
    #[arg(long, value_name = "TIME", value_parser = seconds, default_value = "60s")]
    every: f64,
    /// Run in real time, in a thread of its own
    #[arg(long, requires = "duration")]
    realtime: bool,
    /// Duration in real time, rounded up to whole periods
    #[arg(long, value_name = "TIME", value_parser = seconds, requires = "realtime")]
    duration: Option<f64>,
}

/// A number of ticks, also as `1e8`.
fn ticks(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(ticks) if (1.0..=1e12).contains(&ticks) => Ok(ticks as u64),
        _ => Err("not a number from 1 to 1e12; write for example 1e8".into()),
    }
}

/// A time as `600s` or `10min`, in seconds.
fn seconds(text: &str) -> Result<f64, String> {
    let refused = |_| "not a time; write for example 600s";
    let time = humantime::parse_duration(text).map_err(refused)?;
    match time.as_secs_f64() {
        seconds if (20.0..=1e7).contains(&seconds) => Ok(seconds),
        seconds => Err(format!("{seconds} s is not from 20 s to 1e7 s")),
    }
}

fn main() -> ExitCode {
    match soak(&Options::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Returns whether everything went as required.
fn soak(options: &Options) -> Result<bool, Box<dyn Error>> {
    let mut config = load(&Source::default())?;
    config.sim.seed = options.seed;
    if options.realtime {
        config.interlock.overruns_per_s = REALTIME_OVERRUNS_PER_S;
    }
    let rate_hz = config.servo.rate_hz;
    let ticks = match options.duration {
        Some(duration_s) => (duration_s * rate_hz) as u64,
        None => options.ticks,
    };
    let schedule = Schedule::new(options.seed, rate_hz, options.every, ticks);
    announce(&schedule, options);
    let report = if options.realtime {
        realtime::run(SoakLoop::new(&config, schedule, Pace::Realtime)?, &config)?
    } else {
        simulated::run(SoakLoop::new(&config, schedule, Pace::Virtual)?)?
    };
    Ok(report.print(options.realtime))
}

fn announce(schedule: &Schedule, options: &Options) {
    println!(
        "{} ticks in {} periods of {} s, {} kinds of faults, seed {}",
        schedule.ticks(),
        schedule.periods,
        options.every,
        CASES.len(),
        options.seed
    );
}

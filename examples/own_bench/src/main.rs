//! The command line of `bench` with a probe, a control law and an excitation of its own: docs/own-bench.md explains it.

mod damped_integral;
mod doublet;
mod interferometer;

use std::error::Error;
use std::process::ExitCode;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    bench_config::register_probe::<interferometer::Interferometer>("interferometer")?;
    bench_control::register_law::<damped_integral::DampedIntegral>("damped_integral")?;
    bench_excitation::register_excitation::<doublet::Doublet>("doublet")?;
    Ok(bench::main())
}

//! `bench`: a controller for a precision-motion test bench.
//!
//! A real-time loop drives a voice-coil motor through a current amplifier and reads a displacement probe, behind the traits
//! of [`bench_hal`] with a simulated stage or real devices. ARCHITECTURE.md has the picture: the direction of imports, the
//! path of a tick and of a record, and where to add a probe, an excitation, a control law or a plant.
//!
//! | to find | look in |
//! |---|---|
//! | the loop on one screen | [`bench_rt::servo`] |
//! | the interlocks and the arming state machine | [`bench_rt::interlock`], [`bench_rt::arming`] |
//! | the fast and the slow controller | `bench-config/controllers/`, built by [`bench_control`] |
//! | margins of a loop | [`bench_control::ClosedLoop`] |
//! | modes, residues and zeros of a model | [`bench_plant`], [`bench_plant::zeros`] |
//! | Tables 3-1 to 3-4 of the thesis | `crates/thesis/src/tables.rs`, `sequence.rs` |
//! | two close modes: veering, conditions and propositions of Chapter 4 | [`bench_thesis::veering`] |
//! | tolerances: the probability of CNMP zeros | [`bench_study`] |
//! | excitations, references, and their prediction | [`bench_excitation`] |
//! | the simulated stage | [`bench_rig::simulated`] |
//! | real devices, their emulators, calibration | [`bench_rig::devices`], [`bench_rig::emulator`], [`bench_rig::calibration`] |
//! | estimation of a frequency response | [`bench_identify`] |
//! | modal fit and model order | [`bench_identify::modal`] |
//! | the decision about CNMP zeros | [`bench_identify::verdict`] |
//! | one run: plan, run, analyse, replay | [`bench_experiment`] |
//! | short chirps until the verdict is certain | [`bench_experiment::sequential`] |
//! | a grid of chirps | [`bench_experiment::campaign`] |
//! | recordings compared with each other | [`bench_experiment::run_comparison`] |
//! | signals and responses as files of other programs | [`bench_export`] |
//! | plots and pages of runs, loops and the model | [`bench_report`] |
//! | figures and tables of the thesis | `examples/thesis_figures/` |
//!
//! # Example
//!
//! The modes of the default stage: frequency in hertz and residue in 1/kg.
//!
//! ```
//! use bench_config::{Source, load};
//! use bench_plant::{ModalModel, build};
//!
//! let config = load(&Source::default())?;
//! let model = ModalModel::of(&build(&config.plant)?)?;
//! for mode in &model.modes {
//!     let frequency_hz = mode.omega_rad_s / std::f64::consts::TAU;
//!     println!("{frequency_hz:8.3} Hz  {:+.4e} 1/kg", mode.residue_per_kg());
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Conventions
//!
//! SI units inside, with the unit in the name: `_m _a _n _hz _rad_s _s _ns`; ratios have no suffix. Positive current gives
//! positive force, positive force gives positive displacement at low frequency; u = C (r - y). The gains of controllers are
//! printed in amperes per micrometre, as in the thesis.

#![deny(unsafe_code)]

use std::process::ExitCode;

pub mod cli;
pub mod doctor;
mod log;

/// The `bench` program: log to standard error, run the command, exit with its code. A program with probes or control laws of its
/// own registers them before it calls this function (`examples/own_bench`).
pub fn main() -> ExitCode {
    log::start();
    cli::main().into()
}

//! `bench`: a controller daemon for a precision-motion test bench.
//!
//! A real-time loop drives a voice coil motor through a current amplifier and reads a displacement probe, behind a hardware
//! boundary ([`bench_hal`]) with a simulated or a real stage behind it.
//!
//! ```text
//!  bench-config/*.toml
//!        |
//!                  zeros, veering, study (what the thesis asks of a model)
//!                    ^
//!     config ----> plant ----> sim (a rig that obeys the model)
//!        |           |            |  implements
//!        v           v            v
//!  excitation, control ----> rt (one loop) <---- tick ----> hal (amplifier + probe) <== wires ==> acting (sim at the other end)
//!                             |                               ^  opens what the configuration names
//!                             v  wait-free ring            devices <---- calibration
//!                         recording (MCAP) ----> identify ----> fit ----> verdict ----> report
//!                                   \______ session (one run, its analysis, its replay) ___ run_report, figures, campaign ___ cli
//! ```
//!
//! Imports point towards what stands earlier in this picture. [`cli`] sees all, nobody sees it.
//!
//! | to find | look in |
//! |---|---|
//! | the loop on one screen | [`rt::servo`] |
//! | the interlocks and the arming machine | [`rt::interlock`], [`rt::arming`] |
//! | the fast and the slow controller | `bench-config/controllers/`, run by [`control::Controller`] |
//! | margins of a loop | [`control::ClosedLoop`] |
//! | zeros and their kinds, sequence of dominant modes, maps | [`zeros`] |
//! | how Tables 3-1 to 3-4 are read | `zeros/tables.rs`, `zeros/sequence.rs` |
//! | tolerances: how likely CNMP zeros are, and what decides it | [`study`] |
//! | two close modes, veering, conditions and propositions of Chapter 4, placement of actuator and probe | [`veering`] |
//! | a figure or table of the thesis | [`figures`]: one line a figure in `figures/registry.rs` |
//! | what excites the stage, and what that would do to it | [`excitation`] |
//! | what the simulated stage does | [`sim`] |
//! | the devices that act for a rehearsal, and their faults | [`acting`] |
//! | a grid of chirps, and what all verdicts together say of the stage | [`campaign`] |
//! | what a person puts on for a point, and how that is checked | `campaign/load.rs`, `campaign/check.rs`, asked for in `campaign/attended.rs` |
//! | how a frequency response is estimated | [`identify`] |
//! | noise told from geometry, and modes over amplitude | [`identify::linearity`], `session/amplitudes.rs`, `cli/linearity.rs` |
//! | a plant identified under control | [`identify::joint`], `session/closed_loop.rs` |
//! | how modes are fitted, and their number found | [`fit`] |
//! | whether there are CNMP zeros | [`verdict`] |
//! | the pictures and the page of a run | [`run_report`] |
//! | what `bench doctor` looks at | [`doctor`]: one file a subject, facts apart from verdicts |
//! | which devices there are, and how they are opened | [`devices`] |
//! | what static steps say of amplifier and probe | [`calibration`] |
//! | what stands in a recording | [`recording`] and `recordings/README.md` |
//!
//! # To add one
//!
//! | a new | one file | one line |
//! |---|---|---|
//! | profile | `bench-config/NAME.toml`: what differs from `stage.toml` | in [`config::profiles::PROFILES`] |
//! | controller | `bench-config/controllers/NAME.toml`, or any file with `--controller` | in [`config::profiles::CONTROLLERS`] |
//! | kind of section | none | a variant and its arm in `control/file.rs` |
//! | plant | `plant/NAME.rs`: settings to [`plant::Structure`] | a variant of [`config::PlantSettings`] and its arm in [`plant::build`] |
//! | excitation | `excitation/NAME.rs` with [`excitation::Excitation`], its table in `config/excitation.rs` | a variant of [`config::ExcitationKind`] and its arm in [`excitation::of`] |
//! | reference | a struct in `excitation/reference.rs` | a variant of [`config::ReferenceSettings`] and its arm |
//! | device | below `hal/src/`, with the traits of [`bench_hal`] | a variant in `config/devices.rs` and its arm in [`devices`] |
//! | fault of an acting device | below `hal/src/`, where the device acts | in `acting/fault.rs` |
//!
//! # Conventions
//!
//! SI units inside, and in names: `_m _a _n _hz _rad_s _s _ns`, ratios bare. Positive current gives positive force, positive
//! force positive displacement; u = C (r - y). Micrometres appear in controllers' gains, which are printed in amperes per
//! micrometre, and in what a person reads.

pub mod cli;
pub mod config;
pub mod control;
pub mod doctor;
pub mod excitation;
pub mod experiment;
pub mod identify;
pub mod model;
pub mod recording;
pub mod report;
pub mod rig;
pub mod rt;
pub mod util;

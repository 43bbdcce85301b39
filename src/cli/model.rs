//! `bench model`: analyses of the model of the mechanics, without a bench.

mod bounds;
mod conditions;
mod conditions_text;
mod critical_damping;
mod locus;
mod map;
mod modes;
mod placement;
mod placement_text;
mod sequence;
mod step;
mod study;
mod study_text;
mod sweep;
mod veering;

use clap::Subcommand;
use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use bench_order::{BenchOptions, GLOSSARY};
use bench_thesis::veering::report::VeeringPoint;

/// What to compute.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = GLOSSARY)]
pub(super) struct Args {
    #[command(subcommand)]
    what: ModelCommand,
}

#[derive(Clone, Debug, Subcommand)]
enum ModelCommand {
    /// Modes, residues, signs and zeros at one operating point
    Modes(BenchOptions),
    /// The sequence of dominant modes, and the kinds of zeros that follow from it by Tables 3-1 to 3-4
    Sequence(BenchOptions),
    /// Zero loci as one setting varies, with the points where zeros coincide
    Locus(locus::Args),
    /// Number of CNMP pairs as a function of operating point and mass asymmetry (SR4DoF only)
    Map(map::Args),
    /// Probability of CNMP zeros within manufacturing tolerances, and the settings with the largest influence on it
    Study(study::Args),
    /// Crossing or veering of two close modes as one setting varies: position, and change of the mode shapes
    Veering(veering::Args),
    /// Conditions C4-1 to C4-4y and the propositions for two close modes as one setting varies
    Conditions(conditions::Args),
    /// Locations of actuator and probe without CNMP zeros, relative to the shapes of two close modes
    Placement(placement::Args),
    /// Limits on bandwidth and sensitivity peak due to zeros in the right half plane (Eqs. 1-2, 1-3)
    Bounds(bounds::Args),
    /// The response to a step: undershoot, zero crossings and reversals, compared with the prediction from the zeros
    Step(step::Args),
    /// Smallest damping ratio for which two close modes have no zeros in the right half plane (Eq. 3-16)
    CriticalDamping(critical_damping::Args),
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    match &args.what {
        ModelCommand::Study(args) => return study::run(args),
        ModelCommand::Modes(options) => modes::run(options)?,
        ModelCommand::Sequence(options) => sequence::run(options)?,
        ModelCommand::Locus(args) => locus::run(args)?,
        ModelCommand::Map(args) => map::run(args)?,
        ModelCommand::Veering(args) => veering::run(args)?,
        ModelCommand::Conditions(args) => conditions::run(args)?,
        ModelCommand::Placement(args) => placement::run(args)?,
        ModelCommand::Bounds(args) => bounds::run(args)?,
        ModelCommand::Step(args) => step::run(args)?,
        ModelCommand::CriticalDamping(args) => critical_damping::run(args)?,
    }
    Ok(Exit::Done)
}

/// A report with the profile that it belongs to.
#[derive(Debug, Serialize)]
struct Profiled<'a, T> {
    profile: &'a str,
    #[serde(flatten)]
    report: T,
}

/// How two modes meet, and where.
fn meeting_text(point: &VeeringPoint) -> String {
    format!(
        "they {} at {:.9}: {:.4} Hz, {:.3e} Hz apart",
        point.meeting.verb(),
        point.value,
        point.frequency_hz,
        point.gap_hz
    )
}

/// At most 25 of some rows, evenly spread. JSON and files contain all rows.
fn evenly_spread_rows<T>(rows: &[T]) -> impl Iterator<Item = &T> {
    rows.iter().step_by(rows.len().div_ceil(25).max(1))
}

//! `bench model conditions`: Conditions C4-1 to C4-4y and the propositions of section 4.2.3, for two close modes as one
//! setting varies.

use std::ops::RangeInclusive;

use serde::Serialize;

use super::super::error::CliError;
use super::super::output::print_result;
use super::conditions_text::text;
use super::sweep::CloseModesArgs;
use bench_thesis::veering::report::ConditionsReport;
use bench_thesis::veering::{
    Loci, Sample, Trajectory, as_configured, meeting_pair, require_meeting,
};

/// The setting that varies, the modes, and the value to explain.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("from", |arg| arg.default_value("0")))]
#[command(mut_arg("count", |arg| arg.value_parser(clap::value_parser!(u32).range(2..=10_000))))]
pub(super) struct Args {
    #[command(flatten)]
    modes: CloseModesArgs,
    /// Value of the setting for which the conditions are listed [default: the configured value if it is in the range, else the veering point]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    at: Option<String>,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    profile: &'a str,
    vary: &'a str,
    #[serde(flatten)]
    conditions: ConditionsReport,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let sweep = &args.modes.sweep;
    let report = Report {
        profile: sweep.bench.profile(),
        vary: &sweep.vary,
        conditions: conditions(args)?,
    };
    print_result(sweep.bench.json, &report, |report| {
        text(report.profile, report.vary, &report.conditions)
    })
}

/// The conditions along the sweep, and at the value to explain.
fn conditions(args: &Args) -> Result<ConditionsReport, CliError> {
    let sweep = &args.modes.sweep;
    let values = sweep.values()?;
    let mut loci = Loci::follow(&values, |value| sweep.structure(value))?;
    let pair = meeting_pair(&args.modes.modes, &loci)?;
    let trajectory = Trajectory::along(&mut loci, pair, as_configured)?;
    let closest_value = trajectory.samples[trajectory.closest].value;
    require_meeting(trajectory.meeting, closest_value, pair)?;
    let value = explained(args, &trajectory)?;
    let closest = loci.at(closest_value)?.clone();
    let at = loci.at(value)?;
    let here = Sample::of(at, pair, as_configured(at))?;
    Ok(ConditionsReport::of(
        &trajectory,
        pair,
        &closest,
        (at, &here),
        &values,
    ))
}

/// Value of the setting for which the conditions are listed: the option `--at`, or the configured value if it is in
/// the range, or the veering point.
fn explained(args: &Args, trajectory: &Trajectory) -> Result<f64, CliError> {
    let samples = &trajectory.samples;
    let (first, last) = (samples[0].value, samples[samples.len() - 1].value);
    let range = first.min(last)..=first.max(last);
    let sweep = &args.modes.sweep;
    let Some(text) = &args.at else {
        let configured = sweep.configured()?.filter(|value| range.contains(value));
        return Ok(configured.unwrap_or(samples[trajectory.closest].value));
    };
    let value = sweep.value("--at", text)?;
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(outside(value, &range))
    }
}

fn outside(value: f64, range: &RangeInclusive<f64>) -> CliError {
    let (low, high) = (range.start(), range.end());
    CliError::Usage(format!(
        "--at {value} is outside of the range {low} to {high}; give a value inside, or change --from and --to"
    ))
}

//! `bench model bounds`: limits that zeros in the right half plane set to every controller.

use serde::Serialize;

use super::super::error::CliError;
use super::super::output::print_result;
use super::super::table::{table, wrap};
use super::Profiled;
use bench_base::decimal::Decimal;
use bench_base::quantity::{OfAngularFrequency, OfRatio, si};
use bench_config::Purpose;
use bench_order::BenchOptions;
use bench_plant::zeros::{damped_zeros, undamped_zeros};
use bench_thesis::{Bound, Demand, PlantSummary};

/// The demands on the loop.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Upper limit of |S| up to the bandwidth (Eq. 1-1), between 0 and 1
    #[arg(long, value_name = "RATIO", default_value_t = PlantSummary::ALPHA, value_parser = si::<OfRatio>)]
    alpha: f64,
    /// Upper limit of |S| at all frequencies, above 1; 2 corresponds to a modulus margin of 0.5
    #[arg(long, value_name = "RATIO", default_value_t = PlantSummary::PEAK, value_parser = si::<OfRatio>)]
    peak: f64,
    /// Compute the smallest possible sensitivity peak for this bandwidth in rad/s, instead of the bandwidth for a given
    /// peak
    #[arg(long, value_name = "RAD_PER_S", value_parser = si::<OfAngularFrequency>)]
    bandwidth: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Report {
    alpha: f64,
    peak: Option<f64>,
    /// Bounds by the zeros of the plant without damping.
    zeros: Vec<Bound>,
    damped_zeros: Vec<Bound>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    check(args)?;
    let profile = args.bench.profile();
    let report = report(args)?;
    let report = Profiled { profile, report };
    print_result(args.bench.json, &report, |profiled| {
        text(profile, &profiled.report)
    })
}

fn report(args: &Args) -> Result<Report, CliError> {
    let config = args.bench.load(Purpose::Model, &[])?;
    let structure = bench_plant::build(&config.plant)?;
    let (alpha, peak) = (args.alpha, args.peak);
    let demand = args.bandwidth.map_or(Demand::Peak(peak), Demand::Bandwidth);
    Ok(Report {
        alpha,
        peak: args.bandwidth.is_none().then_some(peak),
        zeros: Bound::of(&undamped_zeros(&structure)?, alpha, demand),
        damped_zeros: Bound::of(&damped_zeros(&structure)?, alpha, demand),
    })
}

fn check(args: &Args) -> Result<(), CliError> {
    let is_above = |value: f64, limit: f64| value > limit && value.is_finite();
    if !(args.alpha > 0.0 && args.alpha < 1.0) {
        return Err(refused("--alpha", args.alpha, "a ratio between 0 and 1"));
    }
    if !is_above(args.peak, 1.0) {
        return Err(refused("--peak", args.peak, "a ratio above 1"));
    }
    match args.bandwidth {
        Some(omega) if !is_above(omega, 0.0) => {
            Err(refused("--bandwidth", omega, "a value in rad/s above 0"))
        }
        _ => Ok(()),
    }
}

fn refused(option: &str, value: f64, limits: &str) -> CliError {
    CliError::Usage(format!(
        "{option} is {value}; give {limits} (Eqs. 1-1 and 1-3)"
    ))
}

fn text(profile: &str, report: &Report) -> String {
    let alpha = report.alpha;
    let statement = format!(
        "{profile}: a stable closed loop with a stable open loop and |S| < {alpha} up to the band has a peak of |S| above the value in the last column"
    );
    format!(
        "{}\nwithout damping\n{}\nwith damping\n{}",
        wrap(&statement, 0),
        bounds_table(&report.zeros),
        bounds_table(&report.damped_zeros),
    )
}

fn bounds_table(bounds: &[Bound]) -> String {
    if bounds.is_empty() {
        return "no zero in the right half plane: no bound\n".into();
    }
    let header = [
        "re rad/s",
        "im rad/s",
        "kind",
        "band rad/s",
        "angle deg",
        "peak of |S|",
    ];
    table(&header, &bounds.iter().map(row).collect::<Vec<_>>())
}

fn row(bound: &Bound) -> Vec<String> {
    vec![
        format!("{:+.4}", Decimal(bound.zero.s.re)),
        format!("{:+.4}", Decimal(bound.zero.s.im)),
        bound.zero.kind.name().into(),
        format!("{:.3}", bound.bandwidth_rad_s),
        format!("{:.3}", bound.opening_angle_deg),
        format!("{:.4}", bound.sensitivity_peak),
    ]
}

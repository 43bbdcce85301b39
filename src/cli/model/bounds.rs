//! `bench model bounds`: limits that zeros in the right half plane set to every controller.

use serde::Serialize;

use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::super::table::{table, wrap};
use super::Profiled;
use crate::config::Purpose;
use crate::model::plant;
use crate::model::zeros::{Bound, Demand, PlantSummary, damped_zeros, undamped_zeros};
use crate::util::quantity::{OfAngularFrequency, OfRatio, si};

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
    /// Compute the smallest possible sensitivity peak for this bandwidth, instead of the bandwidth for a given peak
    #[arg(long, value_name = "RAD_PER_S", value_parser = si::<OfAngularFrequency>)]
    bandwidth: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Report {
    alpha: f64,
    peak: Option<f64>,
    /// Of the plant without damping.
    zeros: Vec<Bound>,
    damped_zeros: Vec<Bound>,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    check(args)?;
    let config = args.bench.load(Purpose::Model, &[])?;
    let structure = plant::build(&config.plant)?;
    let demand = args
        .bandwidth
        .map_or(Demand::Peak(args.peak), Demand::Bandwidth);
    let report = Report {
        alpha: args.alpha,
        peak: args.bandwidth.is_none().then_some(args.peak),
        zeros: Bound::of(&undamped_zeros(&structure)?, args.alpha, demand),
        damped_zeros: Bound::of(&damped_zeros(&structure)?, args.alpha, demand),
    };
    let profile = args.bench.profile();
    if args.bench.json {
        print_json(&Profiled { profile, report })
    } else {
        print_text(&text(profile, &report))
    }
}

fn check(args: &Args) -> Result<(), CliError> {
    let refuse = |option: &str, value: f64, limits: &str| {
        Err(CliError::Usage(format!(
            "{option} is {value}; it is {limits} (Eqs. 1-1 and 1-3)"
        )))
    };
    let is_positive = |x: f64| x > 0.0 && x.is_finite();
    if !(args.alpha > 0.0 && args.alpha < 1.0) {
        return refuse("--alpha", args.alpha, "a ratio between 0 and 1");
    }
    if !(args.peak > 1.0 && args.peak.is_finite()) {
        return refuse("--peak", args.peak, "a ratio above 1");
    }
    match args.bandwidth {
        Some(omega) if !is_positive(omega) => refuse("--bandwidth", omega, "in rad/s and above 0"),
        _ => Ok(()),
    }
}

fn text(profile: &str, report: &Report) -> String {
    let alpha = report.alpha;
    let statement = format!(
        "{profile}: a loop that is stable with and without feedback and keeps |S| < {alpha} up to the band has a peak of |S| above"
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
        format!("{:+.4}", bound.zero.s.re),
        format!("{:+.4}", bound.zero.s.im),
        bound.zero.kind.name().into(),
        format!("{:.3}", bound.bandwidth_rad_s),
        format!("{:.3}", bound.opening_angle_deg),
        format!("{:.4}", bound.sensitivity_peak),
    ]
}

//! `bench model bounds`: what zeros in the right half plane leave to a controller.

use serde::Serialize;

use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use super::super::table::table;
use crate::config::Purpose;
use crate::model::plant;
use crate::model::zeros::{self, Bound, Zero};
use crate::util::quantity::{OfAngularFrequency, OfRatio, si};

/// |S| in the band, if nothing else is asked for.
const ALPHA: f64 = 0.5;
/// The peak of |S|, if nothing else is asked for.
const PEAK: f64 = 2.0;

/// Which demands on the loop.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// |S| stays below this up to the bandwidth (Eq. 1-1), between 0 and 1
    #[arg(long, value_name = "RATIO", default_value_t = ALPHA, value_parser = si::<OfRatio>)]
    alpha: f64,
    /// |S| stays below this everywhere, above 1; 2 is a modulus margin of 0.5
    #[arg(long, value_name = "RATIO", default_value_t = PEAK, value_parser = si::<OfRatio>)]
    peak: f64,
    /// Instead of the bandwidth that a peak allows: the peak that a bandwidth costs
    #[arg(long, value_name = "RAD_PER_S", value_parser = si::<OfAngularFrequency>)]
    bandwidth: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Report {
    profile: String,
    alpha: f64,
    peak: Option<f64>,
    /// Of the plant without damping.
    zeros: Vec<BoundJson>,
    damped_zeros: Vec<BoundJson>,
}

/// A zero and what it costs.
#[derive(Debug, Serialize)]
pub(super) struct BoundJson {
    re_rad_s: f64,
    im_rad_s: f64,
    kind: &'static str,
    bandwidth_rad_s: f64,
    opening_angle_deg: f64,
    sensitivity_peak: f64,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    demands(args)?;
    let config = args.bench.load(Purpose::Model, &[])?;
    let structure = plant::build(&config.plant)?;
    let bounds = |zeros: Vec<Zero>| {
        let bounds = Bound::of(&zeros, args.alpha, args.peak).into_iter();
        bounds
            .map(|b| row(args.alpha, &b, args.bandwidth.unwrap_or(b.bandwidth_rad_s)))
            .collect()
    };
    let report = Report {
        profile: args.bench.profile().into(),
        alpha: args.alpha,
        peak: args.bandwidth.is_none().then_some(args.peak),
        zeros: bounds(zeros::undamped_zeros(&structure)?),
        damped_zeros: bounds(zeros::damped_zeros(&structure)?),
    };
    if args.bench.json {
        print_json(&report)
    } else {
        print_text(&text(&report))
    }
}

fn demands(args: &Args) -> Result<(), CliError> {
    let refuse = |what: &str, value: f64, limits: &str| {
        Err(CliError::Usage(format!(
            "{what} is {value}; it is {limits} (Eqs. 1-1 and 1-3)"
        )))
    };
    if !(args.alpha > 0.0 && args.alpha < 1.0) {
        return refuse("--alpha", args.alpha, "a ratio between 0 and 1");
    }
    if !(args.peak > 1.0 && args.peak.is_finite()) {
        return refuse("--peak", args.peak, "a ratio above 1");
    }
    match args.bandwidth {
        Some(omega) if !(omega > 0.0 && omega.is_finite()) => {
            refuse("--bandwidth", omega, "in rad/s and above 0")
        }
        _ => Ok(()),
    }
}

/// The bounds of zeros for |S| < 0.5 in the band and a peak of 2.
pub(super) fn usual(zeros: &[Zero]) -> Vec<BoundJson> {
    Bound::of(zeros, ALPHA, PEAK)
        .iter()
        .map(|bound| row(ALPHA, bound, bound.bandwidth_rad_s))
        .collect()
}

/// The narrowest of the usual bounds in words.
pub(super) fn usual_text(bounds: &[BoundJson]) -> String {
    let narrowest = bounds.first().map(|b| b.bandwidth_rad_s);
    narrowest.map_or(String::new(), |omega| {
        format!(
            "|S| < {ALPHA} with a peak below {PEAK}: up to {omega:.1} rad/s at most (Eq. 1-3)\n"
        )
    })
}

fn row(alpha: f64, bound: &Bound, bandwidth_rad_s: f64) -> BoundJson {
    let angle = zeros::opening_angle(bound.zero.s, bandwidth_rad_s);
    BoundJson {
        re_rad_s: bound.zero.s.re,
        im_rad_s: bound.zero.s.im,
        kind: bound.zero.kind.name(),
        bandwidth_rad_s,
        opening_angle_deg: angle.to_degrees(),
        sensitivity_peak: zeros::guaranteed_peak(alpha, angle),
    }
}

fn text(report: &Report) -> String {
    let header = [
        "re rad/s",
        "im rad/s",
        "kind",
        "band rad/s",
        "angle deg",
        "peak of |S|",
    ];
    let row = |b: &BoundJson| {
        vec![
            format!("{:+.4}", b.re_rad_s),
            format!("{:+.4}", b.im_rad_s),
            b.kind.into(),
            format!("{:.3}", b.bandwidth_rad_s),
            format!("{:.3}", b.opening_angle_deg),
            format!("{:.4}", b.sensitivity_peak),
        ]
    };
    let part = |bounds: &[BoundJson]| match bounds {
        [] => "no zero in the right half plane: no bound\n".to_string(),
        _ => table(&header, &bounds.iter().map(row).collect::<Vec<_>>()),
    };
    format!(
        "{}: a loop that is stable with and without feedback and keeps |S| < {} up to the band has a peak of |S| above\n\nwithout damping\n{}\nwith damping\n{}",
        report.profile,
        report.alpha,
        part(&report.zeros),
        part(&report.damped_zeros),
    )
}

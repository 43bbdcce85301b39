//! `bench model critical-damping`: Eq. (3-16), and the damping above which no zero is in the right half plane.

use serde::Serialize;

use super::super::error::CliError;
use super::super::output::{print_json, print_text};
use crate::model::zeros;
use crate::util::quantity::{OfAngularFrequency, OfRatio, si};

/// Two close modes beside a double integrator (Eq. 3-15).
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// Frequency of mode u
    #[arg(long, value_name = "RAD_PER_S", default_value_t = 0.9, value_parser = si::<OfAngularFrequency>)]
    omega_u: f64,
    /// Frequency of mode v, above that of u
    #[arg(long, value_name = "RAD_PER_S", default_value_t = 1.1, value_parser = si::<OfAngularFrequency>)]
    omega_v: f64,
    /// |residue of u / residue of v|, above (omega_v/omega_u)^2
    #[arg(long, default_value_t = 2.0, value_parser = si::<OfRatio>)]
    ratio: f64,
    /// One JSON object on standard output, nothing else there
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    omega_u_rad_s: f64,
    omega_v_rad_s: f64,
    ratio: f64,
    eq_3_16: f64,
    touching: f64,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let eta = args.omega_u / args.omega_v;
    let dampings =
        zeros::critical_damping(eta, args.ratio).zip(zeros::touching_damping(eta, args.ratio));
    let Some((eq_3_16, touching)) = dampings else {
        return Err(CliError::Usage(format!(
            "omega_u = {} rad/s, omega_v = {} rad/s, ratio = {}: Eq. (3-16) asks for 0 < omega_u < omega_v and a ratio above (omega_v/omega_u)^2",
            args.omega_u, args.omega_v, args.ratio
        )));
    };
    let (omega_u_rad_s, omega_v_rad_s, ratio) = (args.omega_u, args.omega_v, args.ratio);
    let report = Report {
        omega_u_rad_s,
        omega_v_rad_s,
        ratio,
        eq_3_16,
        touching,
    };
    if args.json {
        print_json(&report)
    } else {
        print_text(&text(&report))
    }
}

fn text(report: &Report) -> String {
    format!(
        "modes of {} and {} rad/s, residues of ratio {}, beside a double integrator\n  Eq. (3-16)                             {:.4}\n  the locus just touches the axis at     {:.4}: no zero in the right half plane with more damping\n",
        report.omega_u_rad_s, report.omega_v_rad_s, report.ratio, report.eq_3_16, report.touching
    )
}

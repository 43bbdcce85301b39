//! `bench model critical-damping`: Eq. (3-16), and the damping above which no zero is in the right half plane.

use super::super::error::CliError;
use super::super::output::print_result;
use bench_base::quantity::{OfAngularFrequency, OfRatio, si};
use bench_thesis::CriticalDamping;

/// Two close modes and a double integrator (Eq. 3-15).
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
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<(), CliError> {
    let (u, v, ratio) = (args.omega_u, args.omega_v, args.ratio);
    let damping = CriticalDamping::new(u, v, ratio).ok_or_else(|| {
        CliError::Usage(format!(
            "--omega-u {u} rad/s, --omega-v {v} rad/s and --ratio {ratio} do not satisfy Eq. (3-16); give 0 < omega_u < omega_v and a ratio above (omega_v/omega_u)^2"
        ))
    })?;
    print_result(args.json, &damping, text)
}

fn text(damping: &CriticalDamping) -> String {
    format!(
        "modes of {} and {} rad/s, ratio of residues {}, and a double integrator\n  Eq. (3-16)                          {:.4}\n  locus touches the imaginary axis at {:.4}\n  With more damping no zero is in the right half plane.\n",
        damping.omega_u_rad_s,
        damping.omega_v_rad_s,
        damping.ratio,
        damping.eq_3_16,
        damping.touching
    )
}

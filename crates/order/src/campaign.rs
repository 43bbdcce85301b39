//! The order of a campaign.

use schemars::JsonSchema;
use serde::Serialize;

use super::bench_options::{BenchOptions, SeedOption};
use super::value_range::{ValueRange, asymmetries, operating_points};
use bench_base::quantity::{OperatingPoint, Ratio};
use bench_experiment::campaign::Method;

/// The bench, and the grid of the campaign.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, JsonSchema)]
#[command(mut_arg("operating_point", |arg| arg.hide(true)))]
#[command(mut_arg("asymmetry", |arg| arg.hide(true)))]
pub struct CampaignOrder {
    /// The bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub bench: BenchOptions,
    /// The seed.
    #[command(flatten)]
    #[serde(flatten)]
    pub seed: SeedOption,
    /// Operating points, FROM and TO with a unit: in % of the beam length (0%:8%:15) or as lengths (0mm:3.8mm:15)
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "0%:8%:15",
        allow_hyphen_values = true,
        value_parser = operating_points
    )]
    pub operating_points: ValueRange<OperatingPoint>,
    /// Nominal mass asymmetries m2/m3 - 1 (without the asymmetry offset of the stage): -10%:10%:10 or -0.1:0.1:10
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "-10%:10%:10",
        allow_hyphen_values = true,
        value_parser = asymmetries
    )]
    pub asymmetries: ValueRange<Ratio>,
    /// Run on the simulated stage, with the rates, delays and resolution of the configured devices
    #[arg(long)]
    pub simulate: bool,
    /// Make one chirp at each point, as configured (chirp.duration_s, ...), in place of short chirps until the verdict is certain
    #[arg(long)]
    pub single_chirp: bool,
    /// Keep the recording of each chirp as well, up to 9 MB each
    #[arg(long)]
    pub keep_recordings: bool,
    /// Accuracy with which an asymmetry can be set, for the recommendation [default: 0.25 g
    /// divided by m3, half of a mass step of 0.5 g]
    #[arg(long, value_name = "RATIO")]
    pub asymmetry_tolerance: Option<Ratio>,
    /// Accuracy with which an operating point can be set, with a unit: in % of the beam length, or a length (0.1mm)
    #[arg(long, value_name = "LENGTH", default_value = "0.2%", value_parser = OperatingPoint::with_unit)]
    pub operating_point_tolerance: OperatingPoint,
    /// Number of points simulated in parallel [default: one for each processor]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

impl CampaignOrder {
    /// How each point is measured.
    pub fn method(&self) -> Method {
        if self.single_chirp {
            Method::SingleChirp
        } else {
            Method::UntilDecided
        }
    }
}

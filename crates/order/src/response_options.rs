//! A frequency response of another program in place of signals.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::path_text::optional_path_text;
use bench_external::frf::PhaseUnit;

/// The options of a frequency response.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, JsonSchema)]
#[group(id = "response")]
pub struct ResponseOptions {
    /// Analyse the frequency response of another program, in any unit, in place of signals: a table with frequency, magnitude and phase,
    /// or real and imaginary part, from a force or a signal proportional to it to a displacement
    #[arg(
        long,
        value_name = "FILE",
        group = "data",
        conflicts_with_all = ["recording", "input", "output", "reference", "time", "time_unit", "period", "skip_periods"]
    )]
    #[serde(serialize_with = "optional_path_text")]
    pub frf: Option<PathBuf>,
    /// With --frf: unit of the phases [default: that in the name of the column, otherwise by the numbers]
    #[arg(
        long,
        value_name = "UNIT",
        requires = "frf",
        conflicts_with = "recording",
        value_enum
    )]
    pub frf_phase: Option<PhaseUnit>,
}

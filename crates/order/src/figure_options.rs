//! How the responses of a run are drawn.

use schemars::JsonSchema;
use serde::Serialize;

/// How the responses of a run are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::Args, Serialize, JsonSchema)]
pub struct ResponseFigureOptions {
    /// Draw magnitudes of responses in dB [default: on a logarithmic axis]
    #[arg(long)]
    pub db: bool,
}

//! Why the pages of a run cannot be written.

use crate::ReportError;
use bench_experiment::outputs::OutputError;

/// Why plots and pages cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// A plot cannot be drawn.
    #[error(transparent)]
    Plot(#[from] ReportError),
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] OutputError),
}

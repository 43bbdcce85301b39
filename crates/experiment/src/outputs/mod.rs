//! The outputs of an analysis: the result files beside a recording (`result_files`), with the certificate, and the stable JSON
//! (`analysis_outputs`). Plots and pages are drawn elsewhere; their names and paths (`plot_kind`, `page_files`) are part of the JSON.

mod analysis_outputs;
mod page_files;
mod plot_kind;
mod result_files;

pub use analysis_outputs::{AnalysisOutputs, AnalysisStatus, LoopOutputs, ModalSummary};
pub use page_files::{ControlFiles, PageFiles, Plots, no_plots};
pub use plot_kind::PlotKind;
pub use result_files::{ExistingFile, OutputError, ResultFiles};

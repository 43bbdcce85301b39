//! What a person gets of a record: its pictures, and one page with all of them that needs nothing from elsewhere.
//!
//! ```text
//! experiment::Analysis, config, recording ---------> RunReport   --.
//!                                                                  ReportSource -> pictures (report::*) -> page (report::page)
//! experiment::ExternalAnalysis, what was measured --> TableReport --'
//! ```

mod bench_run;
mod external;
mod outputs;
mod page;
mod plots;
mod summary;

pub use bench_run::RunReport;
pub use external::TableReport;
pub use outputs::{
    AnalysisOutputs, AnalysisStatus, LoopOutputs, ModalSummary, OutputError, PageFiles, write_frf,
};
pub use page::page;
pub use plots::{PLOT_KINDS, Plot, pictures};
pub use summary::{ReportSource, Shown};

//! What a person gets of a record: its pictures, and one page with all of them that needs nothing from elsewhere.
//!
//! ```text
//! experiment::Analysis, config, recording ---------> AnalysedRun   --.
//!                                                                  Analysed -> pictures (report::*) -> page (report::page)
//! experiment::ForeignAnalysis, what was measured --> AnalysedTable --'
//! ```

mod page;
mod pictures;
mod run;
mod shown;
mod table;

pub use page::page;
pub use pictures::{KINDS, Picture, pictures};
pub use run::AnalysedRun;
pub use shown::{Analysed, Shown};
pub use table::AnalysedTable;

//! Plots and HTML page of one analysed record.
//!
//! ```text
//! BenchRun (a run of the bench) -------.
//!                                       > RecordReport -> plots (SVG) -> page (HTML)
//! ExternalRecord (a CSV) --------------|
//! ResponseReport (a response) ---------'
//! ControlReport (a closed-loop run) -> plots (SVG), control_page (HTML)
//! BasicReport (a run without a frequency response) -> basic_page (HTML)
//! RunResult (several runs) -> comparison (HTML)
//! ```

mod amplitude_page;
mod basic_page;
mod bench_run;
mod comparison;
mod control_page;
mod distortion_plot;
mod external;
mod external_response;
mod loop_pictures;
mod measured_loop;
mod page;
mod page_error;
mod plots;
mod run_differences;
mod run_facts;
mod write_page;

use crate::MagnitudeAxis;
use bench_experiment::ModelResponse;
use bench_experiment::certificate::SignCheck;
use bench_identify::modal::{MeasurementChain, ModalFit};
use bench_identify::verdict::Verdict;
use bench_identify::{Frf, Unit};

pub use amplitude_page::AmplitudeFiles;
pub use basic_page::BasicReport;
pub use bench_run::BenchRun;
pub use comparison::{MAX_COMPARED, comparison_page};
pub use control_page::ControlReport;
pub use external::ExternalRecord;
pub use external_response::ResponseReport;
pub use measured_loop::{MeasuredLoopFiles, MeasuredLoopReport};
pub use page::page;
pub use page_error::PageError;
pub use plots::{Plot, plots};
pub use write_page::{write_control_page, write_page};

/// The content of a report on an analysed record.
#[derive(Clone, Debug)]
pub struct RecordReport<'a> {
    /// Name of the run, which is the title of the page.
    pub name: Option<String>,
    /// Title of the plots, and of the page of a run without a name.
    pub title: String,
    /// Input and output, excitation and time.
    pub subtitle: String,
    /// Name or extent of the record.
    pub record: String,
    /// Unit of the response.
    pub unit: Unit,
    /// Unit of a residue.
    pub residue_unit: String,
    /// The measured response.
    pub frf: &'a Frf,
    /// The model, if there is one.
    pub model: Option<&'a ModelResponse>,
    /// Axis of the magnitudes.
    pub magnitude_axis: MagnitudeAxis,
    /// The signal path between set-point and reading, without the mechanics.
    pub chain: MeasurementChain,
    /// The fitted modes, if the fit succeeded.
    pub fit: Option<&'a ModalFit>,
    /// The signs of the residues beside those of the model, if there is a model and a fit.
    pub signs: Option<&'a SignCheck>,
    /// The verdict about CNMP zeros.
    pub verdict: &'a Verdict,
    /// Modes and zeros up to here count for the verdict, in rad/s.
    pub judged_up_to_rad_s: f64,
    /// Further figures that support the verdict, by name.
    pub evidence: Vec<(String, String)>,
    /// Plots after those that every record has.
    pub further_plots: Vec<Plot>,
    /// HTML paragraph about a run that did not come to its end.
    pub ending: String,
    /// HTML section about the command and its settings.
    pub command_and_settings: String,
    /// HTML sections before the plots.
    pub before_plots: String,
    /// HTML sections after the plots.
    pub after_plots: String,
}

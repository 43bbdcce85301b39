//! The page of a run without a frequency response: static steps, a rest position, a stage check, or a run that was not completed.

use super::comparison::signals_section;
use super::page::table_section;
use super::run_facts;
use crate::ReportError;
use crate::conditions::lines;
use crate::figures::{self, Figure};
use crate::html::{escaped, facts, section};
use bench_base::units::UM_PER_M;
use bench_config::Config;
use bench_experiment::calibration::StaircaseResult;
use bench_experiment::campaign::RestPosition;
use bench_experiment::stage_check::StageCheck;
use bench_experiment::{BasicResults, Overview};
use bench_identify::Estimate;
use bench_recording::Recording;

/// A recorded run with its results.
#[derive(Clone, Copy, Debug)]
pub struct BasicReport<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The configuration of the run.
    pub config: &'a Config,
    /// What the run has found.
    pub results: &'a BasicResults,
    /// Its signals.
    pub overview: &'a Overview,
}

impl BasicReport<'_> {
    /// The page as an HTML document.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn page(&self) -> Result<String, ReportError> {
        let title = &self.config.title;
        let signals = if self.overview.current_a.is_empty() {
            String::new()
        } else {
            signals_section(self.overview)?
        };
        let rate = format!("{} Hz", self.config.servo.rate_hz);
        let conditions = run_facts::conditions(self.recording, self.config);
        let subtitle = lines(&[&rate, &conditions]);
        let body = [
            run_facts::heading(self.recording, title, &subtitle),
            run_facts::ending(self.recording),
            results(self.results),
            run_facts::command_and_settings(self.recording, self.config),
            signals,
            run_facts::events(self.recording),
            run_facts::scheduling(self.recording, &[]),
            run_facts::configuration(self.recording, title),
        ];
        Ok(run_facts::document(self.recording, title, &body.concat()))
    }
}

fn results(results: &BasicResults) -> String {
    match results {
        BasicResults::Staircase(found) => static_steps(found),
        BasicResults::Rest(rest) => rest_position(rest),
        BasicResults::StageCheck(check) => stage_check(check),
        BasicResults::Nothing(why) => {
            let why = escaped(why);
            format!("<p class=\"verdict\"><strong>no result</strong><br>{why}</p>\n")
        }
    }
}

fn static_steps(found: &StaircaseResult) -> String {
    let table = figures::static_step_table(found);
    table_section("Static steps", "± is the 95 % confidence interval.", &table)
}

fn rest_position(rest: &RestPosition) -> String {
    let position = Estimate {
        value: rest.mean_m,
        sigma: rest.sigma_m,
    };
    let position = Figure::new("Mean reading without current", position, "m", 4)
        .times(UM_PER_M, "µm")
        .remark(" (95 % confidence interval)");
    section("Rest position", &facts(&[position.pair()]))
}

fn stage_check(check: &StageCheck) -> String {
    let (class, verdict) = if check.agrees {
        ("excluded", "the stage agrees with the certificate")
    } else {
        ("detected", "the stage does not agree with the certificate")
    };
    let why = check.refusal().map(|refusal| refusal.to_string());
    let why = escaped(&why.unwrap_or_default());
    let verdict = format!("<p class=\"verdict {class}\"><strong>{verdict}</strong><br>{why}</p>\n");
    let note = "A larger difference from the certificate refuses the closed loop.";
    verdict + &table_section("Stage check", note, &figures::stage_check_table(check))
}

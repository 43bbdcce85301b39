//! All findings, the figures behind them, and which runs could start.

use serde::Serialize;

use super::bus_load::BusLoad;
use super::can_nodes::BusFigures;
use super::drive::DriveFigures;
use super::finding::{Finding, Severity, Subject};
use super::readings::Readings;
use super::recordings::Space;
use super::trial::Lateness;
use bench_control::Margins;
use bench_experiment::MotorSummary;

/// The result of an examination; the JSON object of `bench doctor`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Whether both runs could start.
    pub ready: bool,
    /// The runs that could start.
    pub could_start: Vec<Subject>,
    /// The findings, in the order of the examination.
    pub findings: Vec<Finding>,
    /// The figures behind the findings.
    #[serde(flatten)]
    pub figures: Figures,
}

/// The figures behind the findings, in SI units; `null` if they could not be measured.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Figures {
    /// How late a thread with the loop's scheduling woke up.
    pub lateness: Option<Lateness>,
    /// The bus load by the configuration.
    pub bus_load: Option<BusLoad>,
    /// The traffic received on the bus.
    pub bus: Option<BusFigures>,
    /// Properties that the drive reports.
    pub drive: Option<DriveFigures>,
    /// The readings of the probe.
    pub probe: Option<Readings>,
    /// The heat of the motor before and in a run of `bench chirp`.
    pub motor: Option<MotorSummary>,
    /// Space for recordings.
    pub recordings: Option<Space>,
    /// The margins of the closed loop.
    pub control: Option<Margins>,
}

impl Report {
    /// Appends findings.
    pub fn extend(&mut self, findings: impl IntoIterator<Item = Finding>) {
        self.findings.extend(findings);
    }

    /// Decides which runs could start. A failure stops both, unless it concerns the other run only.
    pub(super) fn conclude(&mut self) {
        let runs = [Subject::Chirp, Subject::Control];
        self.could_start = runs.into_iter().filter(|run| self.allows(*run)).collect();
        self.ready = self.could_start.len() == runs.len();
    }

    fn allows(&self, run: Subject) -> bool {
        let other = match run {
            Subject::Chirp => Subject::Control,
            _ => Subject::Chirp,
        };
        self.findings
            .iter()
            .filter(|finding| finding.severity == Severity::Failure)
            .all(|failure| failure.subject == other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(findings: impl IntoIterator<Item = Finding>) -> Report {
        let mut report = Report::default();
        report.extend(findings);
        report.conclude();
        report
    }

    #[test]
    fn failures_stop_both_runs_and_warnings_none() {
        let clock = Subject::Clock;
        assert!(report([clock.ok("b"), clock.warning("b", "c")]).ready);
        let failed = report([clock.failure("b", "c")]);
        assert!(!failed.ready && failed.could_start.is_empty());
    }

    #[test]
    fn a_failure_of_one_run_does_not_stop_the_other() {
        let failure = Subject::Control.failure("no margin", "another controller");
        let report = report([failure, Subject::Clock.ok("b")]);
        assert!(!report.ready);
        assert_eq!(report.could_start, [Subject::Chirp]);
    }
}

//! All findings, the figures behind them, and whether the run could start.

use std::collections::BTreeMap;

use serde::Serialize;

use super::bus_load::BusLoad;
use super::can_nodes::BusFigures;
use super::drive::DriveFigures;
use super::finding::{Finding, Severity};
use super::readings::Readings;
use super::recordings::Space;
use super::runs::{CHIRP, CONTROL};
use super::trial::Lateness;
use crate::control::Margins;

/// Everything that the doctor found; the JSON object of the command.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// Whether the configured runs could start.
    pub ready: bool,
    /// Which of them could.
    pub could_start: Vec<&'static str>,
    /// What was looked at, in that order.
    pub findings: Vec<Finding>,
    /// The figures behind the findings.
    #[serde(flatten)]
    pub figures: Figures,
}

/// The figures behind the findings, in SI units; what was not there to be measured is `null`.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Figures {
    /// How late a thread like the loop's woke up.
    pub lateness: Option<Lateness>,
    /// What the configuration puts on the bus.
    pub bus_load: Option<BusLoad>,
    /// What was heard on the bus.
    pub bus: Option<BusFigures>,
    /// What the drive says of itself.
    pub drive: Option<DriveFigures>,
    /// What the probe gave.
    pub probe: Option<Readings>,
    /// Room for recordings.
    pub recordings: Option<Space>,
    /// The margins of the closed loop.
    pub control: Option<Margins>,
}

impl Report {
    /// Adds findings.
    pub fn find(&mut self, findings: impl IntoIterator<Item = Finding>) {
        self.findings.extend(findings);
    }

    /// Decides: a run starts if nothing failed but what belongs to another run alone.
    pub(super) fn conclude(&mut self) {
        let stops = |run: &str, finding: &Finding| {
            let is_anothers = [CHIRP, CONTROL].contains(&finding.subject) && finding.subject != run;
            finding.verdict == Severity::Failure && !is_anothers
        };
        let could = |run: &&str| !self.findings.iter().any(|finding| stops(run, finding));
        self.could_start = [CHIRP, CONTROL].into_iter().filter(could).collect();
        self.ready = self.could_start.len() == 2;
    }

    /// An aligned list for people; `again` is what follows `bench chirp` or `bench control` on the command line.
    pub fn text(&self, again: &str) -> String {
        let width = self
            .findings
            .iter()
            .map(|finding| finding.subject.len())
            .max()
            .unwrap_or(0);
        let lines = self.findings.iter().map(|finding| {
            let remedy = finding.remedy.as_ref();
            let remedy = remedy.map_or(String::new(), |remedy| {
                format!("{:width$}           -> {remedy}\n", "")
            });
            format!(
                "{:width$}  {:7}  {}\n{remedy}",
                finding.subject,
                finding.verdict.word(),
                finding.what
            )
        });
        lines.collect::<String>() + &self.conclusion(again)
    }

    fn conclusion(&self, again: &str) -> String {
        let commands: Vec<String> = self
            .could_start
            .iter()
            .map(|run| format!("`bench {run}{again}`"))
            .collect();
        let counts = self.counts();
        match (self.ready, commands.is_empty()) {
            (true, _) => format!(
                "ready ({counts}): {} could start now\n",
                commands.join(" and ")
            ),
            (false, true) => format!(
                "NOT READY ({counts}): no run could start; see each FAILURE for its remedy\n"
            ),
            (false, false) => format!(
                "NOT READY ({counts}): only {} could start now\n",
                commands.join(" and ")
            ),
        }
    }

    fn counts(&self) -> String {
        let mut counts: BTreeMap<Severity, usize> = BTreeMap::new();
        self.findings
            .iter()
            .for_each(|finding| *counts.entry(finding.verdict).or_default() += 1);
        let word = |verdict: Severity, count: usize| match (verdict, count) {
            (Severity::Ok, _) => format!("{count} ok"),
            (_, 1) => format!("1 {}", verdict.word().to_lowercase()),
            _ => format!("{count} {}s", verdict.word().to_lowercase()),
        };
        counts
            .into_iter()
            .map(|(verdict, count)| word(verdict, count))
            .collect::<Vec<_>>()
            .join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(findings: impl IntoIterator<Item = Finding>) -> Report {
        let mut report = Report::default();
        report.find(findings);
        report.conclude();
        report
    }

    #[test]
    fn warnings_do_not_stop_a_run_and_failures_do() {
        assert!(report([Finding::ok("a", "b"), Finding::warning("a", "b", "c")]).ready);
        let failed = report([Finding::failure("a", "b", "c")]);
        assert!(!failed.ready && failed.could_start.is_empty());
        assert!(failed.text("").ends_with(
            "NOT READY (1 failure): no run could start; see each FAILURE for its remedy\n"
        ));
    }

    #[test]
    fn what_stops_one_run_alone_leaves_the_other() {
        let report = report([
            Finding::failure(CONTROL, "no margin", "another controller"),
            Finding::ok("a", "b"),
        ]);
        assert_eq!(
            (report.ready, &report.could_start[..]),
            (false, &[CHIRP][..])
        );
        let text = report.text(" --config lab");
        assert!(
            text.ends_with(
                "NOT READY (1 ok, 1 failure): only `bench chirp --config lab` could start now\n"
            ),
            "{text}"
        );
    }

    #[test]
    fn the_list_is_aligned_and_remedies_stand_below() {
        let text = report([
            Finding::ok("clock", "fine"),
            Finding::note("recordings", "full", "empty it"),
        ])
        .text("");
        let expected = "clock       ok       fine\nrecordings  note     full\n                     -> empty it\n";
        assert!(text.starts_with(expected), "{text}");
        assert!(text.ends_with("`bench chirp` and `bench control` could start now\n"));
    }
}

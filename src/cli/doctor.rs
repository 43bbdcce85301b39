//! `bench doctor`: whether the configured runs could start. There is no motion.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::exit::Exit;
use super::output::print_result;
use super::table::wrap;
use crate::doctor::{Finding, Report, RunChecks, Severity, examine};
use bench_config::{Config, Purpose};
use bench_order::BenchOptions;

/// Configuration and folder of the runs
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Folder for the recordings
    #[arg(long, value_name = "DIR", default_value = OUT)]
    out: PathBuf,
}

const OUT: &str = "recordings";

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = args.bench.load(Purpose::Model, &[])?;
    let report = examine(&config, &run_checks(args), &args.out);
    print_result(args.bench.json, &report, |report| {
        text(report, &same_options(args))
    })?;
    Ok(if report.ready {
        Exit::Done
    } else {
        Exit::Failed
    })
}

/// The checks that `bench chirp` and `bench control` make before they open a device.
fn run_checks(args: &Args) -> RunChecks {
    let (chirp, control) = (loaded(args, Purpose::Chirp), loaded(args, Purpose::Control));
    RunChecks::of(chirp, control)
}

fn loaded(args: &Args, purpose: Purpose) -> Result<Config, String> {
    let config = args.bench.load(purpose, &[]);
    config.map_err(|error| error.to_string())
}

/// The findings and the conclusion. `options` are those of the runs on the command line.
fn text(report: &Report, options: &str) -> String {
    let findings = report.findings.iter().map(finding_text);
    findings.collect::<String>() + &conclusion(report, options)
}

/// Columns of the subject, and of subject and severity.
const SUBJECT: usize = 15;
const INDENT: usize = SUBJECT + 9;

fn finding_text(finding: &Finding) -> String {
    let head = format!(
        "{:<SUBJECT$}{:<9}",
        finding.subject.name(),
        finding.severity.word()
    );
    let what = wrap(&finding.what, INDENT);
    let what = what.get(INDENT..).unwrap_or("\n");
    let remedy = match &finding.remedy {
        Some(remedy) => wrap(&format!("-> {remedy}"), INDENT),
        None => String::new(),
    };
    format!("{head}{what}{remedy}")
}

fn conclusion(report: &Report, options: &str) -> String {
    let runs = report.could_start.iter();
    let commands: Vec<String> = runs
        .map(|run| format!("`bench {}{options}`", run.name()))
        .collect();
    let (commands, counts) = (commands.join(" and "), severity_counts(report));
    if report.ready {
        format!("ready ({counts}): {commands} could start now\n")
    } else if commands.is_empty() {
        format!("NOT READY ({counts}): no run could start; see each FAILURE for its remedy\n")
    } else {
        format!("NOT READY ({counts}): only {commands} could start now\n")
    }
}

fn severity_counts(report: &Report) -> String {
    let severities = [
        Severity::Ok,
        Severity::Note,
        Severity::Warning,
        Severity::Failure,
    ];
    let counts = severities.map(|severity| {
        let findings = report.findings.iter();
        (
            severity,
            findings.filter(|f| f.severity == severity).count(),
        )
    });
    let counts = counts.iter().filter(|(_, count)| *count > 0);
    let counts: Vec<String> = counts.map(count_text).collect();
    counts.join(", ")
}

fn count_text((severity, count): &(Severity, usize)) -> String {
    let plural = match severity {
        Severity::Ok => "",
        _ if *count == 1 => "",
        _ => "s",
    };
    format!("{count} {}{plural}", severity.word().to_lowercase())
}

/// The options of this command as options of the runs.
fn same_options(args: &Args) -> String {
    let bench = &args.bench;
    let folder = (args.out.as_path() != Path::new(OUT)).then(|| args.out.display());
    let sets = bench.sets.iter().map(|set| option("--set", Some(set)));
    [
        option("--config", bench.config.as_ref()),
        sets.collect(),
        option("--operating-point", bench.operating_point.as_ref()),
        option("--asymmetry", bench.asymmetry.as_ref()),
        option("--out", folder),
    ]
    .concat()
}

/// An option as typed, with a space before it; empty if it is not given.
fn option(flag: &str, value: Option<impl Display>) -> String {
    value.map_or(String::new(), |value| {
        format!(" {flag} {}", shell_quoted(&value.to_string()))
    })
}

/// Quoted for a shell, if necessary.
fn shell_quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=%+:,".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.into()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Subject;

    #[test]
    fn offers_the_runs_with_the_same_options() {
        let bench = BenchOptions {
            config: Some("my bench.toml".into()),
            sets: vec!["loop.rate_hz=1000".into(), "title=it's".into()],
            asymmetry: Some("-10%".parse().expect("a ratio")),
            ..BenchOptions::default()
        };
        let args = Args {
            bench,
            out: "monday".into(),
        };
        assert_eq!(
            same_options(&args),
            r" --config 'my bench.toml' --set loop.rate_hz=1000 --set 'title=it'\''s' --asymmetry -10% --out monday"
        );
        assert_eq!(
            same_options(&Args {
                bench: BenchOptions::default(),
                out: OUT.into()
            }),
            ""
        );
    }

    fn report(findings: &[Finding], could_start: &[Subject]) -> Report {
        Report {
            ready: could_start.len() == 2,
            could_start: could_start.to_vec(),
            findings: findings.to_vec(),
            ..Report::default()
        }
    }

    #[test]
    fn findings_are_aligned_and_wrapped_to_80_columns() {
        let long = "a long sentence about a queue ".repeat(5);
        let findings = [
            Subject::Clock.ok("fine"),
            Subject::Recordings.note(&long, "free some space"),
        ];
        let text = text(&report(&findings, &[]), "");
        let ok = "clock          ok       fine\n";
        let note = "recordings     note     a long sentence about";
        assert!(text.starts_with(&format!("{ok}{note}")), "{text}");
        assert!(
            text.contains("\n                        -> free some space\n"),
            "{text}"
        );
        assert!(text.lines().all(|line| line.chars().count() <= 80));
    }

    #[test]
    fn the_conclusion_names_the_runs_that_could_start() {
        let failure = [Subject::Control.failure("a", "b")];
        let none = conclusion(&report(&failure, &[]), "");
        assert_eq!(
            none,
            "NOT READY (1 failure): no run could start; see each FAILURE for its remedy\n"
        );
        let chirp = conclusion(&report(&failure, &[Subject::Chirp]), " --config lab");
        assert_eq!(
            chirp,
            "NOT READY (1 failure): only `bench chirp --config lab` could start now\n"
        );
        let ok = [Subject::Clock.ok("a"), Subject::Clock.ok("a")];
        let both = conclusion(&report(&ok, &[Subject::Chirp, Subject::Control]), "");
        assert_eq!(
            both,
            "ready (2 ok): `bench chirp` and `bench control` could start now\n"
        );
    }
}

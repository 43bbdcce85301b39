//! `bench doctor`: could a run start? Nothing moves.

use std::path::{Path, PathBuf};

use super::chirp;
use super::error::CliError;
use super::margins::{closed_loop, require_modulus_margin};
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use crate::config::{Config, Purpose};
use crate::control::Margins;
use crate::doctor::{RunChecks, examine};
use crate::experiment::Plan;

/// Which bench, and where runs are recorded.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Folder for the recordings
    #[arg(long, value_name = "DIR", default_value = OUT)]
    out: PathBuf,
}

const OUT: &str = "recordings";

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Model, &[])?;
    let report = examine(&config, &runs(args), &args.out);
    if args.bench.json {
        print_json(&report)?
    } else {
        print_text(&report.text(&again(args)))?
    }
    Ok(if report.ready {
        Outcome::Done
    } else {
        Outcome::Failed
    })
}

/// The very checks that `bench chirp` and `bench control` make before they open a device.
fn runs(args: &Args) -> RunChecks {
    let chirp = || Ok(chirp::check(&args.bench.load(Purpose::Chirp, &[])?)?.travel_m);
    let control = || loop_margins(&args.bench.load(Purpose::Control, &[])?);
    let words = |error: CliError| error.to_string();
    RunChecks {
        chirp: chirp().map_err(words),
        control: control().map_err(words),
    }
}

fn loop_margins(config: &Config) -> Result<Margins, CliError> {
    let margins = closed_loop(config)?.margins();
    require_modulus_margin(config, &margins)?;
    Plan::control(config.clone())?.program()?;
    Ok(margins)
}

/// The same bench on a command line.
fn again(args: &Args) -> String {
    let BenchOptions {
        config,
        sets,
        operating_point,
        asymmetry,
        seed,
        json: _,
    } = &args.bench;
    let one = |flag: &str, value: &Option<String>| {
        value
            .iter()
            .map(|v| format!(" {flag} {}", quoted(v)))
            .collect::<String>()
    };
    let sets: String = sets
        .iter()
        .map(|set| format!(" --set {}", quoted(set)))
        .collect();
    let out = (args.out.as_path() != Path::new(OUT)).then(|| args.out.display().to_string());
    [
        one("--config", config),
        sets,
        one("--operating-point", &text(operating_point)),
        one("--asymmetry", &text(asymmetry)),
        one("--seed", &text(seed)),
        one("--out", &out),
    ]
    .concat()
}

fn text(value: &Option<impl ToString>) -> Option<String> {
    value.as_ref().map(ToString::to_string)
}

/// As a shell takes it.
fn quoted(text: &str) -> String {
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

    #[test]
    fn the_command_to_start_is_the_one_that_was_asked_about() {
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
            again(&args),
            r" --config 'my bench.toml' --set loop.rate_hz=1000 --set 'title=it'\''s' --asymmetry -10% --out monday"
        );
        assert_eq!(
            again(&Args {
                bench: BenchOptions::default(),
                out: OUT.into()
            }),
            ""
        );
    }
}

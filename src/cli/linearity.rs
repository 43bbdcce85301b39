//! `bench linearity`: the same multisine at several amplitudes.

use serde::Serialize;

use super::analysis_output;
use super::chirp::{analysed, check};
use super::chirp_plan::Expected;
use super::error::CliError;
use super::excitation_options::ExcitationOptions;
use super::linearity_output;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::run_options::{RunOptions, exit, run_text};
use super::table::table;
use crate::config::{Config, OptionSetting, Purpose};
use crate::excitation;
use crate::experiment::{self, ModeOverAmplitude, Plan, RunSummary, modes_over_amplitude};
use crate::identify::modal::{Estimate, FittedMode, SIGMAS_95};
use crate::report::number::interval;
use crate::report::run_pages::AnalysisOutputs;
use crate::util::quantity::Ratio;

/// Odd lines, one in four left out.
const LINES: [(&str, &str); 2] = [
    ("excitation.kind", "multisine"),
    ("multisine.lines", "odd_random"),
];
/// Amplitudes at most.
const MOST: usize = 10;

/// Which bench, in which band, and with which amplitudes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    run: RunOptions,
    #[command(flatten)]
    band: ExcitationOptions,
    /// Amplitudes as ratios of the planned one, one run each
    #[arg(
        long,
        value_name = "RATIO,RATIO,...",
        value_delimiter = ',',
        default_value = "0.25,0.5,1",
        allow_hyphen_values = true
    )]
    scales: Vec<Ratio>,
}

impl Args {
    /// The ratios, rising.
    fn scales(&self) -> Result<Vec<f64>, CliError> {
        let mut scales: Vec<f64> = self.scales.iter().map(Ratio::si).collect();
        scales.sort_by(f64::total_cmp);
        let sound = scales.iter().all(|scale| scale.is_finite() && *scale > 0.0);
        let different = scales.windows(2).all(|pair| pair[0] < pair[1]);
        if sound && different && (2..=MOST).contains(&scales.len()) {
            return Ok(scales);
        }
        Err(CliError::Usage(format!(
            "--scales {scales:?}: two to {MOST} different ratios above 0 are needed, such as 0.5,1,2"
        )))
    }

    /// The settings of each run.
    fn configs(&self) -> Result<Vec<(f64, Config)>, CliError> {
        let lines = LINES.map(|(key, value)| OptionSetting::new(key, value, "bench linearity"));
        let settings = [&lines[..], &self.band.settings()].concat();
        let planned = self.bench.load(Purpose::Chirp, &settings)?;
        let planned = self.band.shaped(planned)?;
        let scaled = |scale: f64| {
            let mut config = planned.clone();
            config
                .chirp
                .amplitude
                .iter_mut()
                .for_each(|point| point.current_a *= scale);
            (scale, config)
        };
        Ok(self.scales()?.into_iter().map(scaled).collect())
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    scales: Vec<f64>,
    /// One an amplitude, as `bench chirp` tells it.
    runs: Vec<RunMade>,
    /// The modes of the smallest amplitude in all runs.
    modes: Vec<ModeMade>,
    /// Whether any figure of any mode differs from that at the smallest amplitude by more than its errors explain; null without modes,
    /// and where none does but a run did not come to its end.
    shifted: Option<bool>,
    why: String,
}

#[derive(Debug, Serialize)]
struct RunMade {
    scale: f64,
    expected: Expected,
    #[serde(flatten)]
    run: RunSummary,
    #[serde(flatten)]
    made: AnalysisOutputs,
}

impl RunMade {
    fn ended(&self) -> Outcome {
        if self.made.is_cancelled() {
            Outcome::Failed
        } else {
            exit(&self.run)
        }
    }
}

#[derive(Debug, Serialize)]
struct ModeMade {
    /// In the order of the runs; null where it is not seen.
    by_run: Vec<Option<FittedMode>>,
    frequency_shifts: bool,
    damping_shifts: bool,
    residue_shifts: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let configs = args.configs()?;
    let expected = configs
        .iter()
        .map(|(scale, config)| expected(*scale, config))
        .collect::<Result<Vec<_>, _>>()?;
    let (mut runs, mut outcome) = (Vec::new(), Outcome::Done);
    for ((scale, config), expected) in configs.iter().zip(expected) {
        let made = one(args, *scale, config, expected)?;
        let ended = made.ended();
        outcome = if outcome == Outcome::Done {
            ended
        } else {
            outcome
        };
        runs.push(made);
        if ended == Outcome::Failed {
            outcome = ended;
            break;
        }
    }
    let fitted: Vec<Vec<FittedMode>> = runs
        .iter()
        .map(|run| run.made.summary.modes.clone())
        .collect();
    let modes = modes_over_amplitude(&fitted);
    let report = report(runs, &modes);
    if args.bench.json {
        print_json(&report)?;
    } else {
        print_text(&text(&report, &configs, &modes))?;
    }
    Ok(outcome)
}

/// What a run would do; refused where it crosses an interlock.
fn expected(scale: f64, config: &Config) -> Result<Expected, CliError> {
    let refused = |error: CliError| {
        CliError::Usage(format!(
            "at {scale} of the planned amplitude: {error}; nothing moved"
        ))
    };
    Ok(Expected::of(&check(config).map_err(refused)?))
}

/// One amplitude: recorded, analysed, its report in its recording.
fn one(args: &Args, scale: f64, config: &Config, expected: Expected) -> Result<RunMade, CliError> {
    let mut run = args.run.run(&Plan::chirp(config.clone()), "linearity")?;
    let told = RunSummary::of(&mut run)?;
    let made = match told.is_completed() {
        true => analysed(&run.path, config)?,
        false => AnalysisOutputs::run_incomplete(),
    };
    let made = RunMade {
        scale,
        expected,
        run: told,
        made,
    };
    experiment::close(run, &made)?;
    Ok(made)
}

fn report(runs: Vec<RunMade>, modes: &[ModeOverAmplitude]) -> Report {
    let compared = modes
        .iter()
        .any(|mode| mode.by_run.iter().flatten().count() > 1);
    let whole = runs.iter().all(|run| run.ended() != Outcome::Failed);
    let shifts = modes.iter().any(ModeOverAmplitude::shifts);
    let shifted = (shifts || whole && compared).then_some(shifts);
    let why = match shifted {
        None if !whole => {
            "not every amplitude was run and analysed to its end: whether modes shift is not known".into()
        }
        None => "no mode is seen at two amplitudes: take more periods (multisine.periods) or larger amplitudes".into(),
        Some(false) => {
            format!("no mode shifts with amplitude beyond what its errors explain{}", unseen(modes))
        }
        Some(true) => format!("with amplitude shift beyond what their errors explain: {}", shifting(modes)),
    };
    let mode = |over: &ModeOverAmplitude| ModeMade {
        by_run: over.by_run.clone(),
        frequency_shifts: over.frequency_shifts,
        damping_shifts: over.damping_shifts,
        residue_shifts: over.residue_shifts,
    };
    let scales = runs.iter().map(|run| run.scale).collect();
    Report {
        scales,
        runs,
        modes: modes.iter().map(mode).collect(),
        shifted,
        why,
    }
}

/// Of which modes nothing is said, as not all amplitudes show them: noise may hide one, or it may have moved beyond all that is
/// taken for the same.
fn unseen(modes: &[ModeOverAmplitude]) -> String {
    let at =
        |mode: &ModeOverAmplitude| Some(mode.by_run.iter().flatten().next()?.frequency_hz().value);
    let lost = modes
        .iter()
        .filter(|mode| !mode.is_seen_throughout())
        .filter_map(at);
    let lost: Vec<String> = lost.map(|hz| format!("{hz:.2} Hz")).collect();
    if lost.is_empty() {
        String::new()
    } else {
        format!("; not seen at every amplitude: {}", lost.join(", "))
    }
}

/// Which figures of which modes shift.
fn shifting(modes: &[ModeOverAmplitude]) -> String {
    let of = |mode: &ModeOverAmplitude| {
        let figures = [
            ("frequency", mode.frequency_shifts),
            ("damping", mode.damping_shifts),
            ("residue", mode.residue_shifts),
        ];
        let names: Vec<&str> = figures
            .into_iter()
            .filter(|(_, shifts)| *shifts)
            .map(|(name, _)| name)
            .collect();
        let at = mode.by_run.iter().flatten().next()?.frequency_hz().value;
        (!names.is_empty()).then(|| format!("{} of the mode at {at:.2} Hz", names.join(" and ")))
    };
    modes.iter().filter_map(of).collect::<Vec<_>>().join(", ")
}

fn text(report: &Report, configs: &[(f64, Config)], modes: &[ModeOverAmplitude]) -> String {
    let run = |(run, (_, config)): (&RunMade, &(f64, Config))| {
        let linearity = run
            .made
            .linearity
            .as_ref()
            .map_or_else(|| analysis_output::text(&run.made), linearity_output::text);
        let page = run
            .made
            .pages
            .report
            .as_ref()
            .map_or(String::new(), |path| format!("  report     {path}\n"));
        format!(
            "{} of the amplitude; expected travel {:.0} um, current {:.3} A\n{}{page}{linearity}\n",
            run.scale,
            run.expected.travel_m * 1e6,
            run.expected.current_a,
            run_text(&run.run, config)
        )
    };
    let words = configs
        .first()
        .map_or(String::new(), |(_, config)| excitation::words(config));
    let runs: String = report.runs.iter().zip(configs).map(run).collect();
    format!(
        "{words}\n\n{runs}{}\nmodes over amplitude (* shifts): {}\n",
        mode_table(&report.scales, modes),
        report.why
    )
}

/// A row a mode and amplitude; intervals hold the truth with 95 %.
fn mode_table(scales: &[f64], modes: &[ModeOverAmplitude]) -> String {
    let figure = |e: Estimate| interval(e.value, SIGMAS_95 * e.sigma);
    let mark = |text: String, shifts: bool| if shifts { text + " *" } else { text };
    let row = |over: &ModeOverAmplitude, (scale, seen): (&f64, &Option<FittedMode>)| match seen {
        None => [
            scale.to_string(),
            "not seen".into(),
            String::new(),
            String::new(),
        ]
        .to_vec(),
        Some(mode) => vec![
            scale.to_string(),
            mark(figure(mode.frequency_hz()), over.frequency_shifts),
            mark(figure(mode.damping_ratio), over.damping_shifts),
            mark(figure(mode.residue_per_kg), over.residue_shifts),
        ],
    };
    let rows: Vec<Vec<String>> = modes
        .iter()
        .flat_map(|over| {
            scales
                .iter()
                .zip(&over.by_run)
                .map(move |seen| row(over, seen))
        })
        .collect();
    table(&["amplitude", "mode Hz", "damping", "residue 1/kg"], &rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mode_that_is_not_seen_at_every_amplitude_is_named() {
        let known = |value: f64| Estimate {
            value,
            sigma: 1e-3 * value,
        };
        let mode = |hz: f64| FittedMode {
            omega_rad_s: known(hz * std::f64::consts::TAU),
            damping_ratio: known(0.01),
            residue_per_kg: known(0.5),
        };
        let said = |runs: &[Vec<FittedMode>]| report(Vec::new(), &modes_over_amplitude(runs)).why;
        let both = vec![mode(29.0), mode(82.0)];
        // 90 Hz is no 82 Hz: nothing shifts, but of that mode nothing is known.
        let why = said(&[both.clone(), vec![mode(29.0), mode(90.0)]]);
        assert!(
            why.starts_with("no mode shifts")
                && why.ends_with("; not seen at every amplitude: 82.00 Hz"),
            "{why}"
        );
        assert!(said(&[both.clone(), both]).ends_with("explain"));
    }
}

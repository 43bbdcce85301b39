//! `bench control`: close the loop with a reference.

use serde::Serialize;

use super::analysis_output;
use super::chirp::analysed;
use super::chirp_plan::Expected;
use super::controller_choice::ControllerChoice;
use super::error::CliError;
use super::margins::{closed_loop, require_modulus_margin, text as margins_text};
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::run_options::{RunOptions, close, exit, run_text};
use crate::config::{Config, Purpose, ReferenceSettings};
use crate::control::{ClosedLoop, Margins, StepMetrics, step_metrics};
use crate::experiment::{Measured, Plan, RunSummary, measure};
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;
use crate::util::quantity;

/// A step is predicted over as many ticks at most: 200 s at 5 kHz, however long the run.
const PREDICTED_TICKS: usize = 1_000_000;

/// Which loop, and what it follows.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    choice: ControllerChoice,
    #[command(flatten)]
    run: RunOptions,
    /// What to follow: step, hold, ramp, sine, chirp (identification in closed loop), or a CSV file with time_s,reference_m
    #[arg(long, value_name = "KIND|FILE")]
    reference: Option<String>,
    /// Height of step and ramp, amplitude of the sine: 50um or metres [default: 50um]; of a chirp the largest travel, by
    /// the model [default: 20um]
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    amplitude: Option<String>,
    /// Frequency of the sine in hertz [default: 1]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    frequency: Option<f64>,
    /// Speed of the ramp in metres per second [default: 1e-4]
    #[arg(long, value_name = "M/S", allow_hyphen_values = true)]
    speed: Option<f64>,
    /// Seconds with the loop closed; of a chirp the length of its sweep
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    duration: Option<f64>,
}

impl Args {
    /// The settings that the options stand for.
    fn sets(&self) -> Result<Vec<String>, CliError> {
        self.refuse_idle()?;
        let number = |x: f64| toml::Value::from(x).to_string();
        let mut sets = self.choice.sets();
        let amplitude = self
            .amplitude
            .as_deref()
            .map(quantity::metres)
            .transpose()
            .map_err(|e| CliError::Usage(e.to_string()))?;
        let mut set = |key: &str, value: String| sets.push(format!("control.{key}={value}"));
        let swept = self.reference.as_deref() == Some("chirp");
        if let Some(duration) = self.duration.filter(|_| !swept) {
            set("duration_s", number(duration));
        }
        let height = number(amplitude.unwrap_or(50e-6));
        match self.reference.as_deref() {
            None if self.amplitude.is_some() => set("reference.amplitude_m", height),
            None => {}
            Some("hold") => set("reference", "{ kind = \"hold\" }".into()),
            Some("step") => set(
                "reference",
                format!("{{ kind = \"step\", amplitude_m = {height}, at_s = 0.2 }}"),
            ),
            Some("ramp") => {
                let speed = number(self.speed.unwrap_or(1e-4));
                set(
                    "reference",
                    format!(
                        "{{ kind = \"ramp\", amplitude_m = {height}, speed_m_per_s = {speed}, at_s = 0.2 }}"
                    ),
                );
            }
            Some("sine") => {
                let frequency = number(self.frequency.unwrap_or(1.0));
                set(
                    "reference",
                    format!(
                        "{{ kind = \"sine\", amplitude_m = {height}, frequency_hz = {frequency} }}"
                    ),
                );
            }
            Some("chirp") => {
                let travel = number(amplitude.unwrap_or(20e-6));
                set(
                    "reference",
                    format!("{{ kind = \"chirp\", travel_m = {travel} }}"),
                );
            }
            Some(path) => set(
                "reference",
                format!("{{ kind = \"file\", path = {} }}", toml::Value::from(path)),
            ),
        }
        sets.extend(
            self.duration
                .filter(|_| swept)
                .map(|duration| format!("chirp.duration_s={}", number(duration))),
        );
        Ok(sets)
    }

    /// Refuses an option that the reference has no use for.
    fn refuse_idle(&self) -> Result<(), CliError> {
        let kind = self.reference.as_deref();
        let high =
            !matches!(kind, Some(kind) if !["step", "ramp", "sine", "chirp"].contains(&kind));
        let idle = [
            (
                self.amplitude.is_some() && !high,
                "--amplitude",
                "step, ramp, sine or chirp",
            ),
            (
                self.frequency.is_some() && kind != Some("sine"),
                "--frequency",
                "sine",
            ),
            (
                self.speed.is_some() && kind != Some("ramp"),
                "--speed",
                "ramp",
            ),
        ];
        match idle.iter().find(|(idle, ..)| *idle) {
            Some((_, option, kinds)) => Err(CliError::Usage(format!(
                "{option} goes with --reference {kinds} only"
            ))),
            None => Ok(()),
        }
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    predicted: Predicted,
    measured: Option<Measured>,
    /// What a swept reference does by the model.
    expected: Option<Expected>,
    /// What a swept reference shows of plant and loop.
    #[serde(flatten)]
    made: Option<AnalysisOutputs>,
}

#[derive(Debug, Serialize)]
struct Predicted {
    #[serde(flatten)]
    margins: Margins,
    #[serde(flatten)]
    step: Option<StepMetrics>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Control, &args.sets()?)?;
    let closed_loop = closed_loop(&config)?;
    let margins = closed_loop.margins();
    require_modulus_margin(&config, &margins)?;
    let step = if margins.stable {
        predicted_step(&config, &closed_loop)
    } else {
        None
    };
    let predicted = Predicted { margins, step };
    let plan = Plan::control(config.clone())?;
    let mut run = args.run.run(&plan, "control")?;
    let report = RunSummary::of(&mut run)?;
    let completed = report.is_completed();
    let swept = matches!(config.control.reference, ReferenceSettings::Chirp { .. });
    let measured = match completed && !swept {
        true => measure(&Recording::open(&run.path)?, &config)?,
        false => None,
    };
    let made = match (swept, completed) {
        (true, true) => Some(analysed(&run.path, &plan.config)?),
        (true, false) => Some(AnalysisOutputs::run_incomplete()),
        (false, _) => None,
    };
    let expected = plan.predicted_extremes.as_ref().map(Expected::of);
    let report = Report {
        run: report,
        predicted,
        measured,
        expected,
        made,
    };
    close(run, &report, args.bench.json, &text(&report, &config))?;
    let stopped = report
        .made
        .as_ref()
        .is_some_and(AnalysisOutputs::is_cancelled);
    Ok(if stopped {
        Outcome::Failed
    } else {
        exit(&report.run)
    })
}

/// The step by the linear model, if the reference is one that happens.
fn predicted_step(config: &Config, closed_loop: &ClosedLoop) -> Option<StepMetrics> {
    let ReferenceSettings::Step { amplitude_m, at_s } = config.control.reference else {
        return None;
    };
    let after_s = config.control.duration_s - at_s;
    let ticks = ((after_s * config.servo.rate_hz) as usize).min(PREDICTED_TICKS);
    let positions = closed_loop.simulate(ticks, |_| amplitude_m);
    (amplitude_m != 0.0 && ticks > 0)
        .then(|| step_metrics(&positions, amplitude_m, config.servo.period_s()))
}

fn text(report: &Report, config: &Config) -> String {
    let milliseconds = |s: Option<f64>| s.map_or("none".into(), |s| format!("{:.1} ms", s * 1e3));
    let predicted = report.predicted.step.map_or(String::new(), |step| {
        format!(
            "  predicted  settling {}, overshoot {:.1} %\n",
            milliseconds(step.settling_time_s),
            step.overshoot_percent
        )
    });
    if let Some(made) = &report.made {
        let margins = margins_text(config, &report.predicted.margins);
        let travel_um = report
            .expected
            .map_or(0.0, |expected| expected.travel_m * 1e6);
        let run = run_text(&report.run, config);
        return format!(
            "{margins}  expected   travel of {travel_um:.1} um by the model\n{run}{}",
            analysis_output::text(made)
        );
    }
    let measured = report.measured.as_ref().map_or(
        "  measured   nothing: the run did not reach a steady state\n".to_string(),
        |m| {
            let step = m.step.map_or(String::new(), |step| {
                format!(
                    "settling {}, overshoot {:.1} %; ",
                    milliseconds(step.settling_time_s),
                    step.overshoot_percent
                )
            });
            format!(
                "  measured   {step}steady state: mean error {:+.4} um, sigma {:.4} um\n",
                m.steady_state_mean_error_m * 1e6,
                m.steady_state_sigma_m * 1e6
            )
        },
    );
    format!(
        "{}{predicted}{measured}{}",
        margins_text(config, &report.predicted.margins),
        run_text(&report.run, config)
    )
}

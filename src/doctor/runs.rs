//! The checks of the commands: whether `bench chirp` and `bench control` accept the configuration.

use super::finding::{Finding, Subject};
use bench_config::Config;
use bench_control::Margins;
use bench_excitation::Excitation;
use bench_experiment::evidence::require_evidence;
use bench_experiment::{
    ExperimentError, Plan, Stage, closed_loop, predicted_extremes, require_margins,
};
use bench_rig::devices;

/// The results of the checks of the commands.
#[derive(Clone, Debug, PartialEq)]
pub struct RunChecks {
    /// The travel in metres that `bench chirp` predicts, or why it refuses.
    pub chirp: Result<f64, String>,
    /// The margins of the loop that `bench control` closes, or why it refuses.
    pub control: Result<Margins, String>,
    /// Why the certificate does not allow to close the loop on these devices; `None` if it does.
    pub evidence: Option<String>,
}

impl RunChecks {
    /// Makes the checks of the commands. The configurations are those of `bench chirp` and of `bench control`, or why they are
    /// refused.
    pub fn of(chirp: Result<Config, String>, control: Result<Config, String>) -> RunChecks {
        let text = |error: ExperimentError| error.to_string();
        let evidence = control.as_ref().ok().and_then(evidence_defect);
        RunChecks {
            evidence,
            chirp: chirp.and_then(|config| predicted_travel_m(&config).map_err(text)),
            control: control.and_then(|config| loop_margins(&config).map_err(text)),
        }
    }
}

fn predicted_travel_m(config: &Config) -> Result<f64, ExperimentError> {
    Ok(predicted_extremes(config)?.travel_m)
}

/// Why `bench control` would refuse the certificate, apart from what the check of the loop refuses.
fn evidence_defect(config: &Config) -> Option<String> {
    let plan = Plan::control(config.clone()).ok()?;
    let required = require_evidence(&plan, Stage::of(config), None);
    required.err().map(|error| error.to_string())
}

fn loop_margins(config: &Config) -> Result<Margins, ExperimentError> {
    let margins = closed_loop(config)?.margins();
    require_margins(config, &margins, Stage::of(config))?;
    // Refuses a controller or a reference that cannot be built.
    Plan::control(config.clone())?;
    Ok(margins)
}

/// Number of ticks of the longer one of both runs; an excitation without settings has none.
pub fn longest_ticks(config: &Config) -> u64 {
    let control_s = config.control.settle_s + config.control.duration_s;
    let control_ticks = (control_s * config.servo.rate_hz).ceil() as u64;
    let excitation = config.chosen_excitation().ok();
    let excitation_ticks = excitation.map_or(0, |chosen| chosen.build().ticks());
    excitation_ticks.max(control_ticks)
}

/// Amplifier and probe must both be devices, or both simulated.
pub fn kinds(config: &Config) -> Finding {
    match devices::check_kinds(config) {
        Err(error) => Subject::Configuration.refused(&error),
        Ok(()) => Subject::Configuration.ok(format!(
            "amplifier {}, probe {}, {} Hz: {}",
            config.amplifier.device.kind(),
            config.probe.device.kind(),
            config.servo.rate_hz,
            config.title
        )),
    }
}

/// The settings that need attention.
pub fn attention(config: &Config) -> Vec<Finding> {
    let warnings = bench_config::warnings(config).into_iter();
    let remedy = "run only while the reason holds; the warning is shown in every run";
    let finding = |warning| Subject::Configuration.warning(warning, remedy);
    warnings.map(finding).collect()
}

/// Evaluates the checks; `min_modulus_margin` is the configured limit.
pub fn findings(checks: &RunChecks, min_modulus_margin: f64) -> Vec<Finding> {
    let both = [
        chirp_finding(checks),
        control_finding(checks, min_modulus_margin),
    ];
    let evidence = checks.evidence.as_ref();
    let evidence = evidence.map(|why| refused(Subject::Control, why, "repeat `bench chirp`"));
    both.into_iter().chain(evidence).collect()
}

fn chirp_finding(checks: &RunChecks) -> Finding {
    match &checks.chirp {
        Ok(travel_m) => Subject::Chirp.ok(format!("predicted travel {:.0} um", travel_m * 1e6)),
        Err(why) => refused(
            Subject::Chirp,
            why,
            "correct the settings of [chirp], or give options to `bench chirp`",
        ),
    }
}

fn control_finding(checks: &RunChecks, min_modulus_margin: f64) -> Finding {
    match &checks.control {
        Ok(margins) => accepted_loop(margins, min_modulus_margin),
        Err(why) => refused(
            Subject::Control,
            why,
            "correct the settings of [control], or give options to `bench control`",
        ),
    }
}

/// The finding for a loop that `bench control` accepts.
fn accepted_loop(margins: &Margins, min_modulus_margin: f64) -> Finding {
    if !margins.stable {
        return Subject::Control.warning(
            "the closed loop is unstable in the model, and no modulus margin is required: the run would trip",
            "choose another controller (--controller FILE), or set control.min_modulus_margin to refuse such loops",
        );
    }
    let limit = if min_modulus_margin > 0.0 {
        format!("at least {min_modulus_margin} is required")
    } else {
        "none is required".into()
    };
    let margin = margins.modulus_margin;
    Subject::Control.ok(format!("modulus margin {margin:.3} by the model; {limit}"))
}

/// A refusal of a command, whose text ends with the remedy, if there is one.
pub(super) fn refused(subject: Subject, why: &str, default_remedy: &str) -> Finding {
    let finding = subject.refused(&why.trim_end_matches("; nothing was moved"));
    let remedy = finding.remedy.unwrap_or_else(|| default_remedy.to_string());
    subject.failure(finding.what, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;
    use bench_control::LoopMargins;

    fn margins(stable: bool) -> Margins {
        Margins {
            loop_margins: LoopMargins {
                modulus_margin: 0.5,
                sensitivity_peak_db: 6.0,
                sensitivity_peak_rad_s: 300.0,
                ..LoopMargins::default()
            },
            stable,
            ..Margins::default()
        }
    }

    fn severities(checks: &RunChecks) -> Vec<Severity> {
        let findings = findings(checks, 0.4).into_iter();
        findings.map(|finding| finding.severity).collect()
    }

    #[test]
    fn a_refusal_of_a_command_is_a_failure_with_its_remedy() {
        let good = RunChecks {
            chirp: Ok(1e-4),
            control: Ok(margins(true)),
            evidence: None,
        };
        assert_eq!(severities(&good), [Severity::Ok, Severity::Ok]);
        let why = "refused: margin 0.3; choose a controller; nothing was moved";
        let refused = RunChecks {
            control: Err(why.into()),
            ..good.clone()
        };
        assert_eq!(severities(&refused), [Severity::Ok, Severity::Failure]);
        let remedy = findings(&refused, 0.4)[1].remedy.clone();
        assert_eq!(remedy.as_deref(), Some("choose a controller"));
        let without_certificate = RunChecks {
            evidence: Some("refused: no certificate; run `bench chirp`; nothing was moved".into()),
            ..good
        };
        let expected = [Severity::Ok, Severity::Ok, Severity::Failure];
        assert_eq!(severities(&without_certificate), expected);
    }

    #[test]
    fn an_unstable_loop_is_a_warning_if_no_margin_is_required() {
        let checks = RunChecks {
            chirp: Err("too far".into()),
            control: Ok(margins(false)),
            evidence: None,
        };
        assert_eq!(severities(&checks), [Severity::Failure, Severity::Warning]);
        let remedy = findings(&checks, 0.0)[0].remedy.clone().unwrap();
        assert!(remedy.contains("[chirp]"), "{remedy}");
    }
}

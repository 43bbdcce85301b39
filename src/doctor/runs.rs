//! What the commands themselves say of the configuration: would `bench chirp` and `bench control` take it?

use super::finding::Finding;
use crate::config::Config;
use crate::control::Margins;
use crate::excitation::{self, Excitation};
use crate::rig::devices;

/// Subject of what concerns `bench chirp` alone.
pub const CHIRP: &str = "chirp";
/// Subject of what concerns `bench control` alone.
pub const CONTROL: &str = "control";

/// The answers of the commands' own checks.
#[derive(Clone, Debug, PartialEq)]
pub struct RunChecks {
    /// The travel in metres that `bench chirp` expects, or why it refuses.
    pub chirp: Result<f64, String>,
    /// The margins of the loop that `bench control` closes, or why it refuses.
    pub control: Result<Margins, String>,
}

/// Ticks of the longer of both runs.
pub fn longest_ticks(config: &Config) -> u64 {
    let control_s = config.control.settle_s + config.control.duration_s;
    excitation::of(config)
        .ticks()
        .max((control_s * config.servo.rate_hz).ceil() as u64)
}

/// A loop has two devices or none.
pub fn kinds(config: &Config) -> Vec<Finding> {
    let (amplifier, probe) = (config.amplifier.device.kind(), config.probe.device.kind());
    let what = format!(
        "amplifier {amplifier}, probe {probe}, {} Hz: {}",
        config.servo.rate_hz, config.title
    );
    let is_mixed = ("simulated" == amplifier) != ("simulated" == probe);
    if is_mixed {
        let error = devices::DevicesError::Mixed { amplifier, probe };
        return vec![Finding::refused("configuration", &error)];
    }
    vec![Finding::ok("configuration", what)]
}

/// What the commands' checks mean; `least` is the modulus margin asked for.
pub fn findings(runs: &RunChecks, least: f64) -> Vec<Finding> {
    vec![chirp(&runs.chirp), control(&runs.control, least)]
}

fn chirp(answer: &Result<f64, String>) -> Finding {
    match answer {
        Ok(travel_m) => Finding::ok(
            CHIRP,
            format!(
                "the excitation moves the stage by {:.0} um by the model",
                travel_m * 1e6
            ),
        ),
        Err(why) => refused(
            CHIRP,
            why,
            "correct the settings of [chirp], or give them to `bench chirp`",
        ),
    }
}

fn control(answer: &Result<Margins, String>, least: f64) -> Finding {
    let margins = match answer {
        Ok(margins) => margins,
        Err(why) => {
            return refused(
                CONTROL,
                why,
                "correct the settings of [control], or give them to `bench control`",
            );
        }
    };
    let asked = if least > 0.0 {
        format!("at least {least} is asked for")
    } else {
        "none is asked for".into()
    };
    if margins.stable {
        return Finding::ok(
            CONTROL,
            format!(
                "modulus margin {:.3} by the model; {asked}",
                margins.modulus_margin
            ),
        );
    }
    Finding::warning(
        CONTROL,
        "the closed loop is unstable by the model; no modulus margin is asked for: it would run into a trip",
        "choose another controller (--controller FILE), or set control.least_modulus_margin to have such loops refused",
    )
}

/// The commands' texts end in the remedy, if they have one.
fn refused(subject: &'static str, why: &str, otherwise: &str) -> Finding {
    let why = why.trim_end_matches("; nothing moved");
    let finding = Finding::refused(subject, &why);
    Finding {
        remedy: finding.remedy.or_else(|| Some(otherwise.to_string())),
        ..finding
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn margins(stable: bool) -> Margins {
        Margins {
            crossover_rad_s: None,
            phase_margin_deg: None,
            gain_margin_db: None,
            modulus_margin: 0.5,
            sensitivity_peak_db: 6.0,
            sensitivity_bandwidth_rad_s: None,
            stable,
            crossings: vec![],
            continuous: false,
        }
    }

    fn verdicts(runs: &RunChecks) -> Vec<Severity> {
        findings(runs, 0.4)
            .iter()
            .map(|finding| finding.verdict)
            .collect()
    }

    #[test]
    fn what_a_command_refuses_is_a_failure_with_its_remedy() {
        let good = RunChecks {
            chirp: Ok(1e-4),
            control: Ok(margins(true)),
        };
        assert_eq!(verdicts(&good), [Severity::Ok, Severity::Ok]);
        let why = "refused: margin 0.3; choose a controller; nothing moved".to_string();
        let bad = RunChecks {
            control: Err(why),
            ..good.clone()
        };
        assert_eq!(verdicts(&bad), [Severity::Ok, Severity::Failure]);
        assert_eq!(
            findings(&bad, 0.4)[1].remedy.as_deref(),
            Some("choose a controller")
        );
        let wild = RunChecks {
            chirp: Err("too far".into()),
            control: Ok(margins(false)),
        };
        assert_eq!(verdicts(&wild), [Severity::Failure, Severity::Warning]);
        assert!(
            findings(&wild, 0.0)[0]
                .remedy
                .as_deref()
                .unwrap()
                .contains("[chirp]")
        );
    }
}

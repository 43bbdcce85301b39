//! Runs of the same multisine at several amplitudes: distortion, noise, and whether modes shift with amplitude. The runs are planned and
//! made here; then `mode_shifts` compares their modes.

mod mode_shifts;

use crate::errors::ExperimentError;
use crate::forecast::predicted_extremes;
use crate::live::Run;
use crate::plan::Plan;
use crate::run::Runner;
use bench_config::{Config, validate};
use bench_excitation::Extremes;
use bench_identify::modal::FittedMode;

pub use mode_shifts::{ModeOverAmplitude, is_within, modes_over_amplitude};

/// A run at one amplitude.
#[derive(Clone, Debug)]
pub struct AmplitudePlan {
    /// Amplitude as a ratio of the planned one.
    pub scale: f64,
    /// The settings of the run.
    pub config: Config,
    /// Its extremes by the model.
    pub predicted: Extremes,
}

/// Plans a run at each of `scales` times the amplitude of `planned`. Refuses all of them if one of them would trip an interlock.
pub fn plan_amplitudes(
    planned: &Config,
    scales: &[f64],
) -> Result<Vec<AmplitudePlan>, ExperimentError> {
    let plans = scales.iter().map(|scale| plan_amplitude(planned, *scale));
    plans.collect()
}

fn plan_amplitude(planned: &Config, scale: f64) -> Result<AmplitudePlan, ExperimentError> {
    let mut config = planned.clone();
    for point in &mut config.chirp.amplitude {
        point.current_a *= scale;
    }
    let predicted = predicted_extremes(&config).map_err(|error| refused(scale, &error))?;
    // Amplitudes that are not allowed could not be read back from the recording.
    validate(&config).map_err(|error| refused(scale, &error))?;
    Ok(AmplitudePlan {
        scale,
        config,
        predicted,
    })
}

fn refused(scale: f64, why: &impl std::fmt::Display) -> ExperimentError {
    ExperimentError::Refused(format!(
        "at {scale} of the planned amplitude: {why}; nothing was moved"
    ))
}

/// Runs the plans one after another. `finish` analyses and closes each run, and returns whether to continue.
pub fn run<E: From<ExperimentError>>(
    runner: &Runner,
    plans: &[AmplitudePlan],
    finish: &mut dyn FnMut(&AmplitudePlan, Run) -> Result<bool, E>,
) -> Result<(), E> {
    for plan in plans {
        let run = runner.run(&Plan::chirp(plan.config.clone()), "linearity")?;
        if !finish(plan, run)? {
            break;
        }
    }
    Ok(())
}

/// The modes of all runs compared.
#[derive(Clone, Debug)]
pub struct ModeComparison {
    /// The modes of the smallest amplitude within the excited band, in all runs.
    pub modes: Vec<ModeOverAmplitude>,
    /// Whether a parameter of a mode shifts; `None` if that is not known.
    pub shifted: Option<bool>,
    /// The reason.
    pub why: String,
}

/// Compares the modes of the runs within the excited band. `all_completed` states whether every amplitude was run and analysed to
/// its end.
pub fn compare_modes(
    runs: &[Vec<FittedMode>],
    band_hz: (f64, f64),
    all_completed: bool,
) -> ModeComparison {
    let within = |modes: &Vec<FittedMode>| -> Vec<FittedMode> {
        let modes = modes.iter().filter(|mode| is_within(mode, band_hz));
        modes.copied().collect()
    };
    let runs: Vec<Vec<FittedMode>> = runs.iter().map(within).collect();
    let modes = modes_over_amplitude(&runs);
    let shifts = modes.iter().any(ModeOverAmplitude::shifts);
    let is_compared = |mode: &ModeOverAmplitude| mode.by_run.iter().flatten().count() > 1;
    let (shifted, why) = match (shifts, all_completed) {
        (true, _) => (Some(true), shift_text(&modes)),
        (false, false) => (None, NOT_COMPLETED.into()),
        (false, true) if modes.iter().any(is_compared) => (Some(false), no_shift_text(&modes)),
        (false, true) => (None, NOT_COMPARED.into()),
    };
    ModeComparison {
        modes,
        shifted,
        why,
    }
}

const NOT_COMPARED: &str =
    "no mode is found at two amplitudes: use more periods (multisine.periods) or larger amplitudes";

const NOT_COMPLETED: &str =
    "not every amplitude was run and analysed to its end: whether modes shift is not known";

fn shift_text(modes: &[ModeOverAmplitude]) -> String {
    let shifting = modes.iter().filter(|mode| mode.shifts()).map(|mode| {
        let parameters = mode.shifting().join(" and ");
        format!("{parameters} of the mode at {:.2} Hz", mode.frequency_hz())
    });
    let shifting: Vec<String> = shifting.collect();
    format!(
        "these parameters shift with amplitude by more than their errors: {}",
        shifting.join(", ")
    )
}

/// Names the modes that are missing at an amplitude: noise may hide one, or it may have shifted too far to be matched.
fn no_shift_text(modes: &[ModeOverAmplitude]) -> String {
    let incomplete = modes.iter().filter(|mode| !mode.is_in_every_run());
    let incomplete: Vec<String> = incomplete
        .map(|mode| format!("{:.2} Hz", mode.frequency_hz()))
        .collect();
    let text = "no mode shifts with amplitude by more than its errors";
    if incomplete.is_empty() {
        text.into()
    } else {
        format!(
            "{text}; not found at every amplitude: {}",
            incomplete.join(", ")
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::modal::Estimate;

    #[test]
    fn names_a_mode_that_is_not_found_at_every_amplitude() {
        let known = |value: f64| Estimate {
            value,
            sigma: 1e-3 * value,
        };
        let mode = |hz: f64| FittedMode {
            omega_rad_s: known(hz * std::f64::consts::TAU),
            damping_ratio: known(0.01),
            residue_per_kg: known(0.5),
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        };
        let why = |runs: &[Vec<FittedMode>]| compare_modes(runs, (5.0, 200.0), true).why;
        let both = vec![mode(29.0), mode(82.0)];
        // 90 Hz is not matched with 82 Hz: no shift is detected, but the mode is missing at one amplitude.
        let missing = why(&[both.clone(), vec![mode(29.0), mode(90.0)]]);
        assert!(
            missing.starts_with("no mode shifts")
                && missing.ends_with("; not found at every amplitude: 82.00 Hz"),
            "{missing}"
        );
        assert!(why(&[both.clone(), both]).ends_with("errors"));
    }
}

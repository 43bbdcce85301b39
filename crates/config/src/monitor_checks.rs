//! Whether the monitor of the residuals can detect a fault. A monitor that cannot counts as switched off, which needs a reason.

use super::purpose::Purpose;
use super::{Config, Detection, InterlockSettings, MAX_DETECTED_RATIO};
use bench_base::finding::Finding;
use bench_plant::{ModalModel, Mode};

/// Smallest frequency of the first mode over that of the mode with the largest static compliance. The low-pass of the plant's
/// residual has half the frequency of the first mode: it reaches 90 % of a step after 3.89/(w/2), 1.24 periods of that mode.
const MIN_FIRST_RATIO: f64 = 0.1;

/// The error in the settings of the monitor, or in a model with which it is too slow to detect a fault.
pub(super) fn monitor(config: &Config, purpose: Purpose) -> Option<Finding> {
    let interlock = &config.interlock;
    let Some(detection) = interlock.detection() else {
        return missing(interlock);
    };
    if !detection.is_effective() {
        return Some(ineffective(interlock, &detection));
    }
    match purpose {
        Purpose::Chirp | Purpose::Control | Purpose::All => slow(config),
        Purpose::Model | Purpose::Recorded => None,
    }
}

fn missing(interlock: &InterlockSettings) -> Option<Finding> {
    let what = "is missing, which switches the comparison with the model off; add it, or give a reason with interlock.model_error_off";
    let is_off = interlock.model_error_off.is_some();
    (!is_off).then(|| Finding::new("interlock.model_error_ratio", what))
}

fn ineffective(interlock: &InterlockSettings, detection: &Detection) -> Finding {
    let ratio = interlock.model_error_ratio.unwrap_or_default();
    let share = interlock.share_of_model_error();
    let limit = 100.0 * MAX_DETECTED_RATIO;
    let at_rest = if detection.at_rest_ratio.is_finite() {
        format!(
            "at a modelled motion of {:.1} %",
            100.0 * detection.at_rest_ratio
        )
    } else {
        "never".into()
    };
    let what = format!(
        "makes the comparison with the model ineffective: with model_error_ratio = {ratio} and model_error_share = {share}, a detached probe trips {at_rest}, and an oscillation in a closed loop at {:.1} % of interlock.soft_limit_m; the limit is {limit} % for both; lower the two settings (0.02 and 0.5 in the profiles), or switch the comparison off with a reason, interlock.model_error_off = \"REASON\"",
        100.0 * detection.deviation_ratio,
    );
    Finding::new(responsible(share), what)
}

/// The setting that alone makes the monitor ineffective, or the ratio.
fn responsible(share: f64) -> &'static str {
    if share > 1.0 - MAX_DETECTED_RATIO {
        "interlock.model_error_share"
    } else {
        "interlock.model_error_ratio"
    }
}

/// A first mode far below the one that the stage moves in, for example with a negligible residue, makes the low-pass slow.
fn slow(config: &Config) -> Option<Finding> {
    let modes = ModalModel::of(&bench_plant::build(&config.plant).ok()?)
        .ok()?
        .modes;
    let first_rad_s = modes.iter().map(|mode| mode.omega_rad_s).reduce(f64::min)?;
    let softest = modes
        .iter()
        .max_by(|a, b| compliance(a).total_cmp(&compliance(b)))?;
    let softest_rad_s = softest.omega_rad_s;
    // The residual of a free body is not evaluated.
    let is_slow = first_rad_s > 0.0 && first_rad_s < MIN_FIRST_RATIO * softest_rad_s;
    let what = format!(
        "has its first mode at {first_rad_s:.3e} rad/s, below a tenth of the {softest_rad_s:.3e} rad/s of the mode with the largest compliance, so that the comparison of position and model would detect a fault only after more than ten periods of this mode; remove the first mode from the model, or switch the comparison off with a reason, interlock.model_error_off = \"REASON\""
    );
    is_slow.then(|| Finding::new("plant", what))
}

/// Magnitude of the static response of a mode to a force, without a common factor.
fn compliance(mode: &Mode) -> f64 {
    (mode.force_gain * mode.sensor_gain).abs() / (mode.omega_rad_s * mode.omega_rad_s)
}

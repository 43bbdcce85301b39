//! Whether the monitor of the residuals can detect a fault. A monitor that cannot counts as switched off, which needs a reason.

use super::purpose::Purpose;
use super::{Config, Detection, InterlockSettings, MAX_DETECTED_RATIO};
use crate::model::plant::{self, ModalModel};
use crate::util::finding::Finding;

/// Two equal first-order sections with the corner frequency w reach 90 % of a step after 3.89/w: (1 + x) exp(-x) = 0.1.
const RISE: f64 = 3.89;
/// Corner of the low-pass of the plant's residual over the frequency of the first mode.
const CORNER_RATIO: f64 = 0.5;
/// Longest rise of the low-pass in seconds.
const MAX_RISE_S: f64 = 10.0;

/// The errors in the settings of the monitor, and in a model with which it detects nothing within [`MAX_RISE_S`].
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
    let at_rest = match detection.at_rest_ratio.is_finite() {
        true => format!(
            "at a modelled motion of {:.1} %",
            100.0 * detection.at_rest_ratio
        ),
        false => "never".into(),
    };
    let what = format!(
        "makes the comparison with the model ineffective: with model_error_ratio = {ratio} and model_error_share = {share}, a detached probe trips {at_rest}, and an oscillation in a closed loop at {:.1} % of interlock.soft_limit_m; the limit is {limit} % for both; lower the two settings (0.02 and 0.5 in the profiles), or switch the comparison off with a reason, interlock.model_error_off = \"REASON\"",
        100.0 * detection.deviation_ratio,
    );
    Finding::new(responsible(share), what)
}

/// The setting that alone makes the monitor ineffective, or the ratio.
fn responsible(share: f64) -> &'static str {
    match share > 1.0 - MAX_DETECTED_RATIO {
        true => "interlock.model_error_share",
        false => "interlock.model_error_ratio",
    }
}

/// A mode far below all others, for example one with a negligible residue, makes the low-pass of the monitor slow.
fn slow(config: &Config) -> Option<Finding> {
    let model = ModalModel::of(&plant::build(&config.plant).ok()?).ok()?;
    let first_rad_s = model
        .modes
        .iter()
        .map(|mode| mode.omega_rad_s)
        .reduce(f64::min)?;
    let rise_s = RISE / (CORNER_RATIO * first_rad_s);
    // The residual of a free body is not evaluated.
    let is_slow = first_rad_s > 0.0 && rise_s > MAX_RISE_S;
    let what = format!(
        "has a mode at {first_rad_s:.3e} rad/s, with which the comparison of position and model takes {rise_s:.0} s to detect a fault, above the limit of {MAX_RISE_S} s; remove this mode from the model, or switch the comparison off with a reason, interlock.model_error_off = \"REASON\""
    );
    is_slow.then(|| Finding::new("plant", what))
}

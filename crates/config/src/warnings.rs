//! Settings that are accepted, but of which an operator must know.

use super::{Config, is_near_one};

/// What needs attention in the settings of a run: interlocks that are switched off with a reason, scales that were confirmed with
/// a name, and limits that never trip. Shown by `bench config check`, `bench doctor`, plans and every run.
pub fn warnings(config: &Config) -> Vec<String> {
    let all = [
        monitor_off(config),
        confirmed_gain(config),
        current_error(config),
        stuck_current(config),
    ];
    all.into_iter().flatten().collect()
}

/// A motor without current differs from the commands by at most the limit of the amplifier.
fn current_error(config: &Config) -> Option<String> {
    let (error_a, limit_a) = (
        config.interlock.current_error_a,
        config.amplifier.current_limit_a,
    );
    (error_a >= limit_a).then(|| {
        format!("interlock.current_error_a = {error_a} A never trips without current in the motor, because commands are at most amplifier.current_limit_a = {limit_a} A; set it to less than that")
    })
}

/// Commands change by at most twice the limit of the amplifier.
fn stuck_current(config: &Config) -> Option<String> {
    let (stuck_a, limit_a) = (
        config.interlock.probe_stuck_current_a,
        config.amplifier.current_limit_a,
    );
    (stuck_a >= 2.0 * limit_a).then(|| {
        format!("interlock.probe_stuck_current_a = {stuck_a} A never trips, because commands change by at most twice amplifier.current_limit_a = {limit_a} A; set it to less than that")
    })
}

fn monitor_off(config: &Config) -> Option<String> {
    let reason = config.interlock.model_error_off.as_ref()?;
    Some(format!(
        "the position is not compared with the model ({reason}); remove interlock.model_error_off as soon as the model is known"
    ))
}

fn confirmed_gain(config: &Config) -> Option<String> {
    let gain = config.probe.device.mounting_gain();
    if is_near_one(gain.abs()) {
        return None;
    }
    let name = config.calibration.confirming_name().unwrap_or("nobody");
    Some(format!(
        "probe.device.mounting.gain = {gain} is outside 0.75 to 1.25, confirmed by {name} (calibration.accepted_by)"
    ))
}

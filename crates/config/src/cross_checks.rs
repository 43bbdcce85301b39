//! Relations between settings, which ranges of single settings cannot express.

use super::command_checks::command_checks;
use super::purpose::Purpose;
use super::{
    CalibrationSettings, ChirpSettings, Config, IdentifySettings, MotorSettings, monitor_checks,
    mounting_checks, relations,
};
use bench_base::finding::Finding;

/// Longest excitation in ticks, more than an hour at 5 kHz. It is analysed as one record, with about 80 bytes per tick.
const MAX_TICKS: f64 = 2e7;
/// Largest deviation of the clock of a free-running probe: ten times that of a crystal of 100 ppm.
const CLOCK_TOLERANCE: f64 = 1e-3;

/// The errors in the relations between settings that serve the purpose.
pub(super) fn cross_checks(config: &Config, purpose: Purpose) -> Vec<Finding> {
    let mut errors = Errors(relations::plant(config));
    if purpose != Purpose::Recorded {
        errors.0.extend(config.plant.check_damping());
    }
    travel(config, &mut errors);
    force(&config.motor, &mut errors);
    staleness(config, purpose, &mut errors);
    reason_without_monitor(config, &mut errors);
    if purpose != Purpose::Recorded {
        errors.0.extend(monitor_checks::monitor(config, purpose));
        errors.0.extend(mounting_checks::mounting(config));
        confirming_name(&config.calibration, &mut errors);
    }
    let for_control = purpose.includes(Purpose::Control);
    let is_swept = config.control.reference.is_swept();
    if purpose.includes(Purpose::Chirp) || for_control && is_swept {
        band(config, &mut errors);
        excitation(config, &mut errors);
        fades_and_amplitude(&config.chirp, &mut errors);
        resolution(&config.identify, &mut errors);
    }
    if for_control {
        let reference = config.control.reference.design();
        let soft_limit_m = config.interlock.soft_limit_m;
        errors
            .0
            .extend(reference.check(soft_limit_m, config.servo.rate_hz));
        errors.0.extend(command_checks(config));
    }
    errors.0
}

struct Errors(Vec<Finding>);

impl Errors {
    /// Adds an error at `path` unless `is_good` holds.
    fn require(&mut self, is_good: bool, path: &str, what: impl FnOnce() -> String) {
        if !is_good {
            self.0.push(Finding::new(path, what()));
        }
    }
}

fn travel(config: &Config, errors: &mut Errors) {
    let (soft_m, stop_m) = (config.interlock.soft_limit_m, config.sim.stop_m);
    let range_m = config.probe.range_m / 2.0;
    let path = "interlock.soft_limit_m";
    errors.require(soft_m < stop_m, path, || {
        format!("is {soft_m} m, not inside the stop at {stop_m} m; lower it")
    });
    errors.require(soft_m <= range_m, path, || {
        format!("is {soft_m} m, above half the range of the probe, {range_m} m; lower it (probe.range_m is the full range)")
    });
}

fn force(motor: &MotorSettings, errors: &mut Errors) {
    let (continuous_n, peak_n) = (motor.continuous_force_n, motor.peak_force_n);
    errors.require(continuous_n <= peak_n, "motor.continuous_force_n", || {
        format!("is {continuous_n} N, above the peak force of {peak_n} N; lower it, or correct motor.peak_force_n")
    });
}

fn staleness(config: &Config, purpose: Purpose, errors: &mut Errors) {
    let (stale_s, period_s) = (config.interlock.probe_stale_s, config.servo.period_s());
    let probe = &config.probe;
    // Earlier versions accepted a limit without the tolerance.
    let tolerance = match purpose {
        Purpose::Recorded => 0.0,
        _ => CLOCK_TOLERANCE,
    };
    let period_of_probe_s = probe.rate_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz);
    let oldest_s = probe.age_at_arrival_s() + (1.0 + tolerance) * period_of_probe_s;
    let path = "interlock.probe_stale_s";
    errors.require(stale_s >= period_s, path, || {
        format!("is {stale_s} s, shorter than a tick of {period_s} s (1/loop.rate_hz); raise it")
    });
    errors.require(stale_s > oldest_s, path, || {
        format!(
            "is {stale_s} s, but in normal operation a reading is up to {oldest_s} s old (probe.latency_s + probe.transport_s + 1/probe.rate_hz, with a clock that is slow by 0.1 %); set a larger value"
        )
    });
}

fn reason_without_monitor(config: &Config, errors: &mut Errors) {
    let reason = config.interlock.model_error_off.as_ref();
    let is_blank = reason.is_some_and(|reason| reason.trim().is_empty());
    errors.require(!is_blank, "interlock.model_error_off", || {
        "is blank; give the reason for which the monitor is off, or leave it out".into()
    });
}

fn confirming_name(calibration: &CalibrationSettings, errors: &mut Errors) {
    let is_blank = calibration.accepted_by.is_some() && calibration.confirming_name().is_none();
    errors.require(!is_blank, "calibration.accepted_by", || {
        "is blank; give the name of the person who confirms the gains, or leave it out".into()
    });
}

fn band(config: &Config, errors: &mut Errors) {
    let (start_hz, stop_hz) = (config.chirp.start_hz, config.chirp.stop_hz);
    errors.require(start_hz != stop_hz, "chirp.stop_hz", || {
        format!("is {stop_hz} Hz, and the sweep starts at {start_hz} Hz too; give two frequencies")
    });
    let nyquist_hz = config.servo.rate_hz / 2.0;
    let probe_hz = config.probe.rate_hz.unwrap_or(f64::INFINITY) / 2.0;
    for (path, hz) in [("chirp.start_hz", start_hz), ("chirp.stop_hz", stop_hz)] {
        errors.require(hz < nyquist_hz, path, || {
            format!("is {hz} Hz, not below half the servo rate of {nyquist_hz} Hz; lower it, or raise loop.rate_hz")
        });
        errors.require(hz < probe_hz, path, || {
            format!("is {hz} Hz, not below half the rate of the probe, {probe_hz} Hz; lower it")
        });
    }
}

/// The length and the settings of the chosen excitation.
fn excitation(config: &Config, errors: &mut Errors) {
    let Ok(chosen) = config.chosen_excitation() else {
        errors.require(false, "excitation.kind", || {
            "needs the table [own_excitation]; add it with `kind = NAME`, or choose another kind".into()
        });
        return;
    };
    let length = chosen.design.length(&chosen.shared);
    let (value, ticks) = (length.value, length.ticks);
    errors.require(ticks <= MAX_TICKS, length.key, || {
        let unit = if length.key.ends_with("_s") { " s" } else { "" };
        format!(
            "is {value}{unit}: including the rest before and after, the run has {ticks} ticks, above the limit of {MAX_TICKS} for one record; shorten it, or lower loop.rate_hz"
        )
    });
    errors.0.extend(chosen.design.check(&chosen.shared));
}

fn fades_and_amplitude(chirp: &ChirpSettings, errors: &mut Errors) {
    let (fades_s, duration_s) = (chirp.fade_in_s + chirp.fade_out_s, chirp.duration_s);
    errors.require(fades_s <= duration_s, "chirp.duration_s", || {
        format!("is {duration_s} s, shorter than the two fades of {fades_s} s together; raise it, or shorten the fades")
    });
    let frequencies = chirp.amplitude.iter().map(|point| point.frequency_hz);
    let is_rising = frequencies.is_sorted_by(|a, b| a < b);
    errors.require(is_rising, "chirp.amplitude", || NOT_RISING.into());
}

const NOT_RISING: &str =
    "has frequencies that do not rise from point to point; sort the points by frequency";

fn resolution(settings: &IdentifySettings, errors: &mut Errors) {
    let IdentifySettings::Local(local) = settings else {
        return;
    };
    let frequencies = local.resolution.iter().map(|point| point.frequency_hz);
    let is_rising = frequencies.is_sorted_by(|a, b| a < b);
    errors.require(is_rising, "identify.resolution", || NOT_RISING.into());
}

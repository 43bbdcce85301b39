//! Relations between settings, which no single range expresses.

use super::purpose::Purpose;
use super::{
    AmplitudePoint, Config, IdentifySettings, InterlockSettings, MotorSettings, ProbeSettings,
    relations,
};
use crate::util::finding::Finding;

/// Longest excitation in ticks, over an hour at 5 kHz: it is analysed as one record, in some 80 bytes a tick.
const MAX_TICKS: f64 = 2e7;

/// All that is wrong between settings that serve the purpose.
pub(super) fn cross_checks(config: &Config, purpose: Purpose) -> Vec<Finding> {
    let mut findings = relations::plant(config);
    findings.extend(travel(config));
    findings.extend(force(&config.motor));
    findings.extend(staleness(
        &config.interlock,
        &config.probe,
        config.servo.period_s(),
    ));
    let swept = config.control.reference.is_swept();
    let reference = config.control.reference.design();
    let for_control = purpose.includes(Purpose::Control);
    if purpose.includes(Purpose::Chirp) || for_control && swept {
        findings.extend(sweep(config));
        findings.extend(identify(&config.identify));
    }
    if for_control {
        let soft_limit_m = config.interlock.soft_limit_m;
        findings.extend(reference.check(soft_limit_m, config.servo.rate_hz));
    }
    findings
}

/// A finding where `is_good` does not hold.
fn must(is_good: bool, path: &str, what: String) -> Option<Finding> {
    (!is_good).then(|| Finding::new(path, what))
}

fn travel(config: &Config) -> impl Iterator<Item = Finding> + use<> {
    let (soft_m, stop_m) = (config.interlock.soft_limit_m, config.sim.stop_m);
    let seen_m = config.probe.range_m / 2.0;
    let path = "interlock.soft_limit_m";
    let inside = format!("is {soft_m} m; it must lie inside the stop at {stop_m} m");
    let visible =
        format!("is {soft_m} m, beyond the range of the probe, {seen_m} m (half of probe.range_m)");
    let findings = [
        must(soft_m < stop_m, path, inside),
        must(soft_m <= seen_m, path, visible),
    ];
    findings.into_iter().flatten()
}

fn force(motor: &MotorSettings) -> Option<Finding> {
    let (continuous_n, peak_n) = (motor.continuous_force_n, motor.peak_force_n);
    let what = format!("is {continuous_n} N, above the peak force of {peak_n} N");
    must(continuous_n <= peak_n, "motor.continuous_force_n", what)
}

fn staleness(
    interlock: &InterlockSettings,
    probe: &ProbeSettings,
    period_s: f64,
) -> impl Iterator<Item = Finding> + use<> {
    let stale_s = interlock.probe_stale_s;
    let path = "interlock.probe_stale_s";
    let oldest_s = probe.age_at_arrival_s() + probe.rate_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz);
    let short = format!("is {stale_s} s, shorter than a tick of {period_s} s");
    let old = format!(
        "is {stale_s} s, but a reading may be {oldest_s} s old before the next one (probe.latency_s, transport_s, rate_hz)"
    );
    let findings = [
        must(stale_s >= period_s, path, short),
        must(stale_s > oldest_s, path, old),
    ];
    findings.into_iter().flatten()
}

/// The band, the length, the fades and the amplitude of an excitation.
fn sweep(config: &Config) -> Vec<Finding> {
    let chosen = config.chosen_excitation();
    let mut findings = band(config);
    findings.extend(length(config));
    findings.extend(chosen.design.check(&chosen.shared));
    let chirp = &config.chirp;
    let (fades_s, duration_s) = (chirp.fade_in_s + chirp.fade_out_s, chirp.duration_s);
    let what = format!("is {duration_s} s, shorter than both fades, {fades_s} s");
    findings.extend(must(fades_s <= duration_s, "chirp.duration_s", what));
    let rising = |pair: &[AmplitudePoint]| pair[0].frequency_hz < pair[1].frequency_hz;
    let is_rising = chirp.amplitude.windows(2).all(rising);
    findings.extend(must(is_rising, "chirp.amplitude", NOT_RISING.into()));
    findings
}

const NOT_RISING: &str = "has frequencies that do not rise from point to point";

fn band(config: &Config) -> Vec<Finding> {
    let (start_hz, stop_hz) = (config.chirp.start_hz, config.chirp.stop_hz);
    let nyquist_hz = config.servo.rate_hz / 2.0;
    let seen_hz = config.probe.rate_hz.unwrap_or(f64::INFINITY) / 2.0;
    let what = format!(
        "is {stop_hz} Hz, but the sweep starts at {start_hz} Hz; a sweep needs two frequencies"
    );
    let mut findings = Vec::from_iter(must(start_hz != stop_hz, "chirp.stop_hz", what));
    for (path, hz) in [("chirp.start_hz", start_hz), ("chirp.stop_hz", stop_hz)] {
        let what = format!("is {hz} Hz; it must stay below half the servo rate, {nyquist_hz} Hz");
        findings.extend(must(hz < nyquist_hz, path, what));
        let what =
            format!("is {hz} Hz; the probe measures frequencies below half its rate, {seen_hz} Hz");
        findings.extend(must(hz < seen_hz, path, what));
    }
    findings
}

fn length(config: &Config) -> Option<Finding> {
    let chosen = config.chosen_excitation();
    let length = chosen.design.length(&chosen.shared);
    let (value, ticks) = (length.value, length.ticks);
    let unit = if length.key.ends_with("_s") { " s" } else { "" };
    let what = format!(
        "is {value}{unit}, with the quiet before and after {ticks} ticks; {MAX_TICKS} can be analysed as one record: shorten it or lower loop.rate_hz"
    );
    must(ticks <= MAX_TICKS, length.key, what)
}

fn identify(settings: &IdentifySettings) -> Option<Finding> {
    let IdentifySettings::Local(local) = settings else {
        return None;
    };
    let mut pairs = local.resolution.windows(2);
    let is_rising = pairs.all(|pair| pair[0].frequency_hz < pair[1].frequency_hz);
    must(is_rising, "identify.resolution", NOT_RISING.into())
}

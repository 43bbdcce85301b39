//! Relations between the settings of a command and the others.

use super::{Config, FeedforwardSettings, MinimumTimeSettings, PrefilterSettings, ShaperSettings};
use bench_base::finding::Finding;

/// The errors in shaping, prefilter and feedforward.
pub(super) fn command_checks(config: &Config) -> Vec<Finding> {
    let control = &config.control;
    let mut findings = Vec::new();
    if control.reference.is_swept() && control.has_command() {
        let what = "is a sweep for identification, which runs without control.shaper, control.prefilter and control.feedforward; leave these out, or choose another reference";
        findings.push(Finding::new("control.reference.kind", what));
    }
    if let ShaperSettings::MinimumTime(settings) = &control.shaper {
        findings.extend(minimum_time(config));
        findings.extend(operating_points(config, settings));
    }
    if let PrefilterSettings::LowPass(settings) = &control.prefilter {
        let path = "control.prefilter.frequency_hz";
        findings.extend(below_nyquist(config, path, settings.frequency_hz, 2.0));
    }
    if let FeedforwardSettings::Inverse(settings) = &control.feedforward {
        let path = "control.feedforward.bandwidth_hz";
        findings.extend(below_nyquist(config, path, settings.bandwidth_hz, 4.0));
    }
    findings
}

fn minimum_time(config: &Config) -> Vec<Finding> {
    let control = &config.control;
    let mut findings = Vec::new();
    if control.reference.design().step().is_none() {
        let kind = control.reference.kind();
        let what = format!(
            "is \"minimum_time\", which plans a step, but the reference is a {kind}; choose zv, zvd or ei, or a step"
        );
        findings.push(Finding::new("control.shaper.kind", what));
    }
    if !control.feedforward.is_none() {
        let what = "is \"minimum_time\", which plans current and reference together; leave out control.feedforward, or choose zv, zvd or ei";
        findings.push(Finding::new("control.shaper.kind", what));
    }
    if !control.prefilter.is_none() {
        let what = "is \"minimum_time\", whose step a prefilter would change; leave out control.prefilter, or choose zv, zvd or ei";
        findings.push(Finding::new("control.shaper.kind", what));
    }
    findings
}

fn operating_points(config: &Config, settings: &MinimumTimeSettings) -> Option<Finding> {
    let length_m = config.plant.beam_length_m()?;
    let mut points_m = settings.operating_points_m.iter();
    let point_m = points_m.find(|point_m| point_m.abs() > length_m)?;
    let what = format!("has {point_m} m, beyond the length of the beams of {length_m} m; lower it");
    Some(Finding::new("control.shaper.operating_points_m", what))
}

fn below_nyquist(config: &Config, path: &str, hz: f64, ratio: f64) -> Option<Finding> {
    let highest_hz = config.servo.rate_hz / ratio;
    let what = format!(
        "is {hz} Hz, not below the servo rate divided by {ratio}, {highest_hz} Hz; lower it, or raise loop.rate_hz"
    );
    (hz >= highest_hz).then(|| Finding::new(path, what))
}

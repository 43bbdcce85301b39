//! The readings of the probe during one second, as the loop receives them: the newest reading and its age.

use std::time::{Duration, Instant};

use bench_hal::serial::{SerialProbe, Statistics};
use bench_hal::{DisplacementProbe, Reading, Tick, Validity};
use serde::Serialize;

use super::finding::{Finding, Subject};
use bench_base::decimal::Decimal;
use bench_base::numeric::is_within;
use bench_config::{InterlockSettings, ProbeSettings};
use bench_rig::devices::first_reading;

/// Duration of the observation.
const OBSERVED: Duration = Duration::from_secs(1);
/// Longest time between two samples: the period of a loop at 1 kHz.
const SAMPLE_PERIOD: Duration = Duration::from_millis(1);

/// Figures of the readings, in SI units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Readings {
    /// Duration of the observation.
    pub watched_s: f64,
    /// Whether a valid reading was received.
    pub came: bool,
    /// Samples of the newest reading.
    pub looks: u64,
    /// Samples with a valid reading.
    pub valid_looks: u64,
    /// Samples with a reading out of the probe's range.
    pub out_of_range_looks: u64,
    /// Readings per second.
    pub rate_hz: f64,
    /// Mean age of the newest reading.
    pub age_mean_s: f64,
    /// Largest age of the newest reading.
    pub age_max_s: f64,
    /// Mean position.
    pub position_mean_m: f64,
    /// Position with the largest magnitude.
    pub position_farthest_m: f64,
    /// Standard deviation of the positions; it is the noise if the stage is at rest.
    pub noise_rms_m: f64,
    /// Missing readings.
    pub gaps: u64,
    /// Bytes that belong to no message.
    pub damaged_bytes: u64,
    /// Requests without an answer.
    pub timeouts: u64,
    /// Reports of the probe that it cannot measure.
    pub faults: u64,
    /// Bytes received.
    pub bytes: u64,
}

/// Observes an open probe, sampled at least once per `period_s`.
pub fn gather(probe: &mut SerialProbe, period_s: f64) -> Readings {
    let came = first_reading(probe) == Validity::Valid;
    let (before, start) = (probe.statistics(), Instant::now());
    let pause = SAMPLE_PERIOD.min(Duration::from_secs_f64(period_s));
    let mut samples = Samples::default();
    while start.elapsed() < OBSERVED {
        samples.add(&probe.latest(Tick::default()));
        std::thread::sleep(pause);
    }
    let readings = Readings {
        came,
        watched_s: start.elapsed().as_secs_f64(),
        ..samples.figures()
    };
    with_counts(readings, &before, &probe.statistics())
}

/// Adds the counts of the observation; without a valid reading those since the port was opened.
fn with_counts(readings: Readings, before: &Statistics, after: &Statistics) -> Readings {
    let zero = Statistics::default();
    let since = if readings.came { before } else { &zero };
    Readings {
        rate_hz: (after.published - before.published) as f64 / readings.watched_s,
        gaps: after.gaps - since.gaps,
        damaged_bytes: after.damaged_bytes - since.damaged_bytes,
        timeouts: after.timeouts - since.timeouts,
        faults: after.faults - since.faults,
        bytes: after.bytes - since.bytes,
        ..readings
    }
}

/// Sums over the samples.
#[derive(Clone, Debug, Default)]
struct Samples {
    count: u64,
    valid: u64,
    out_of_range: u64,
    age_sum_s: f64,
    age_max_s: f64,
    sequence: Option<u64>,
    positions_m: Vec<f64>,
}

impl Samples {
    fn add(&mut self, reading: &Reading) {
        self.count += 1;
        match reading.validity {
            Validity::Valid => self.add_valid(reading),
            Validity::OutOfRange => self.out_of_range += 1,
            _ => {}
        }
    }

    fn add_valid(&mut self, reading: &Reading) {
        let age_s = reading.age_ns as f64 * 1e-9;
        self.valid += 1;
        self.age_sum_s += age_s;
        self.age_max_s = self.age_max_s.max(age_s);
        if self.sequence != Some(reading.sequence) {
            self.sequence = Some(reading.sequence);
            self.positions_m.push(reading.position_m);
        }
    }

    fn figures(&self) -> Readings {
        let (mean_m, sigma_m) = mean_and_deviation(&self.positions_m);
        let by_magnitude = |a: &&f64, b: &&f64| a.abs().total_cmp(&b.abs());
        let farthest_m = self.positions_m.iter().max_by(by_magnitude);
        Readings {
            looks: self.count,
            valid_looks: self.valid,
            out_of_range_looks: self.out_of_range,
            age_mean_s: self.age_sum_s / (self.valid as f64).max(1.0),
            age_max_s: self.age_max_s,
            position_mean_m: mean_m,
            position_farthest_m: farthest_m.copied().unwrap_or_default(),
            noise_rms_m: sigma_m,
            ..Readings::default()
        }
    }
}

/// Mean and standard deviation, computed relative to the first value: the deviation of equal values is exactly zero.
fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let Some(first) = values.first() else {
        return (0.0, 0.0);
    };
    let count = values.len() as f64;
    let mean = first + values.iter().map(|x| x - first).sum::<f64>() / count;
    let squares = values.iter().map(|x| (x - mean) * (x - mean));
    (mean, (squares.sum::<f64>() / count).sqrt())
}

/// Evaluates the figures for a run.
pub fn findings(
    readings: &Readings,
    probe: &ProbeSettings,
    limits: &InterlockSettings,
) -> Vec<Finding> {
    if !readings.came {
        return vec![no_reading(readings)];
    }
    let findings = [
        validity(readings),
        rate(readings.rate_hz, probe.rate_hz),
        Some(age(readings, probe, limits.probe_stale_s)),
        Some(position(readings, limits.soft_limit_m)),
        Some(noise(readings.noise_rms_m, limits.soft_limit_m)),
        Some(damage(readings)),
    ];
    findings.into_iter().flatten().collect()
}

fn no_reading(readings: &Readings) -> Finding {
    let (what, remedy) = cause_without_reading(readings);
    let what = format!(
        "{what}: {} bytes, {} of them damaged, {} missing answers, {} faults",
        readings.bytes, readings.damaged_bytes, readings.timeouts, readings.faults
    );
    Subject::Readings.failure(what, remedy)
}

/// Why there is no reading, with the remedy.
fn cause_without_reading(readings: &Readings) -> (&'static str, &'static str) {
    if readings.out_of_range_looks > 0 {
        (
            "the target is outside the probe's range",
            "move probe or stage until the display of the probe shows a value",
        )
    } else if readings.bytes == 0 {
        (
            "the probe sends nothing",
            "check its power and wiring (A and B swapped?), baud rate and address",
        )
    } else if readings.faults > 0 {
        (
            "the probe reports that it cannot measure",
            "see the display of the probe: target, cable, controller",
        )
    } else {
        (
            "bytes are received, but no reading",
            "check baud rate, parity and protocol in probe.device",
        )
    }
}

fn validity(readings: &Readings) -> Option<Finding> {
    let total = readings.looks;
    let invalid = total - readings.valid_looks;
    if invalid == 0 {
        return None;
    }
    let percent = 100.0 * invalid as f64 / total as f64;
    let out_of_range = readings.out_of_range_looks;
    Some(Subject::Readings.failure(
        format!("{invalid} of {total} samples had no valid reading ({percent:.1} %; {out_of_range} out of range)"),
        "a run trips on the first one: centre the stage in the probe's range, check its cable",
    ))
}

fn rate(actual_hz: f64, configured_hz: Option<f64>) -> Option<Finding> {
    let configured_hz = configured_hz?;
    let what = format!("{actual_hz:.0} readings per second, but probe.rate_hz is {configured_hz}");
    let remedy = "set probe.rate_hz to the actual rate: margins and simulation depend on it";
    Some(match actual_hz / configured_hz {
        ..0.9 => Subject::Readings.warning(what, remedy),
        1.1.. => Subject::Readings.note(what, remedy),
        _ => Subject::Readings.ok(what),
    })
}

/// The expected mean age is the age on arrival and half the time to the next reading.
fn age(readings: &Readings, probe: &ProbeSettings, stale_s: f64) -> Finding {
    let half_period_s = probe.rate_hz.map_or(0.0, |rate_hz| 0.5 / rate_hz);
    let expected_s = probe.age_at_arrival_s() + half_period_s;
    let what = format!(
        "mean age {}, largest age {}; configured: mean {}, limit {}",
        milliseconds(readings.age_mean_s),
        milliseconds(readings.age_max_s),
        milliseconds(expected_s),
        milliseconds(stale_s)
    );
    if readings.age_max_s > stale_s {
        let remedy = format!(
            "{AGE_REMEDY}; or raise interlock.probe_stale_s after checking the loop with `bench margins`"
        );
        Subject::Readings.failure(what, remedy)
    } else if readings.age_mean_s > 1.2 * expected_s {
        Subject::Readings.warning(what, AGE_REMEDY)
    } else {
        Subject::Readings.ok(what)
    }
}

const AGE_REMEDY: &str = "correct probe.latency_s, transport_s and rate_hz; low latency of the adapter and an idle machine reduce the age";

fn milliseconds(seconds: f64) -> String {
    format!("{:.2} ms", seconds * 1e3)
}

fn position(readings: &Readings, soft_limit_m: f64) -> Finding {
    let what = format!(
        "mean position {:+.1} um, farthest {:+.1} um; the soft limit is {:.1} um",
        Decimal(readings.position_mean_m * 1e6),
        Decimal(readings.position_farthest_m * 1e6),
        soft_limit_m * 1e6
    );
    if readings.position_farthest_m.abs() <= soft_limit_m {
        return Subject::Readings.ok(what);
    }
    let remedy =
        "a run would trip at once: centre the stage, or correct gain and offset_m of the mounting";
    Subject::Readings.failure(what, remedy)
}

/// A standard deviation above this ratio of the soft limit is no noise of a displacement probe.
const MAX_NOISE_RATIO: f64 = 0.01;
/// With a larger ratio, a run would trip on travel within some ten thousand readings (4 standard deviations).
const TRIPPING_NOISE_RATIO: f64 = 0.25;

fn noise(rms_m: f64, soft_limit_m: f64) -> Finding {
    let rms = length(rms_m);
    let limit = length(soft_limit_m);
    if rms_m == 0.0 {
        let remedy = "push the stage gently: the readings of a working probe change";
        Subject::Readings.note("all readings are equal", remedy)
    } else if is_within(rms_m, MAX_NOISE_RATIO * soft_limit_m) {
        Subject::Readings.ok(format!("noise {rms} RMS, if the stage is at rest"))
    } else if is_within(rms_m, TRIPPING_NOISE_RATIO * soft_limit_m) {
        let what = format!("noise {rms} RMS, above 1 % of the soft limit of {limit}");
        Subject::Readings.warning(what, NOISE_REMEDY)
    } else {
        let what = format!("noise {rms} RMS, above 25 % of the soft limit of {limit}");
        Subject::Readings.failure(what, NOISE_REMEDY)
    }
}

const NOISE_REMEDY: &str =
    "keep the stage at rest, and check cable, ground and scale of the probe (probe.device)";

fn length(metres: f64) -> String {
    match metres {
        1e-3.. => format!("{:.2} mm", metres * 1e3),
        1e-6.. => format!("{:.2} um", metres * 1e6),
        _ => format!("{:.1} nm", metres * 1e9),
    }
}

fn damage(readings: &Readings) -> Finding {
    let what = format!(
        "within {:.1} s: {} missing readings, {} damaged bytes, {} missing answers, {} faults",
        readings.watched_s,
        readings.gaps,
        readings.damaged_bytes,
        readings.timeouts,
        readings.faults
    );
    let total = readings.gaps + readings.damaged_bytes + readings.timeouts + readings.faults;
    if total == 0 {
        return Subject::Readings.ok(what);
    }
    let remedy =
        "check shield, ground and termination of the line, and that no other device sends on it";
    Subject::Readings.warning(what, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity::{self, Failure, Note, Warning};
    use bench_config::{Config, Source, load};

    fn lab() -> Config {
        let source = Source {
            config: Some("lab".into()),
            ..Source::default()
        };
        load(&source).unwrap()
    }

    fn healthy() -> Readings {
        Readings {
            watched_s: 1.0,
            came: true,
            looks: 1000,
            valid_looks: 1000,
            rate_hz: 650.0,
            age_mean_s: 0.0024,
            age_max_s: 0.004,
            position_mean_m: 1e-6,
            position_farthest_m: -2e-6,
            noise_rms_m: 40e-9,
            bytes: 10_000,
            ..Readings::default()
        }
    }

    fn not_ok(readings: &Readings) -> Vec<(Severity, String)> {
        let lab = lab();
        findings(readings, &lab.probe, &lab.interlock)
            .into_iter()
            .filter(|finding| finding.severity != Severity::Ok)
            .map(|finding| (finding.severity, finding.what))
            .collect()
    }

    #[test]
    fn healthy_readings_are_ok() {
        assert_eq!(not_ok(&healthy()), []);
        let expected = "noise 40.0 nm RMS, if the stage is at rest";
        assert_eq!(noise(40e-9, 900e-6).what, expected);
    }

    #[test]
    fn each_defect_of_readings_has_its_severity_and_text() {
        // lab: expected 0.3 + 1.4 + 0.77 = 2.47 ms in the mean, stale at 10 ms, soft limit 900 um, 650 Hz.
        type Change = fn(&mut Readings);
        let cases: [(Change, Severity, &str); 16] = [
            (
                |r| (r.came, r.bytes, r.timeouts) = (false, 0, 20),
                Failure,
                "sends nothing: 0 bytes",
            ),
            (
                |r| (r.came, r.damaged_bytes) = (false, 10_000),
                Failure,
                "bytes are received, but no reading",
            ),
            (
                |r| (r.came, r.faults) = (false, 3),
                Failure,
                "cannot measure",
            ),
            (
                |r| (r.came, r.out_of_range_looks) = (false, 9),
                Failure,
                "outside the probe's range",
            ),
            (
                |r| (r.valid_looks, r.out_of_range_looks) = (990, 10),
                Failure,
                "10 of 1000 samples",
            ),
            (
                |r| r.rate_hz = 500.0,
                Warning,
                "500 readings per second, but probe.rate_hz is 650",
            ),
            (|r| r.rate_hz = 900.0, Note, "900 readings per second"),
            (|r| r.age_mean_s = 0.0031, Warning, "mean age 3.10 ms"),
            (|r| r.age_max_s = 0.0101, Failure, "largest age 10.10 ms"),
            (
                |r| r.position_farthest_m = -950e-6,
                Failure,
                "farthest -950.0 um",
            ),
            (|r| r.noise_rms_m = 0.0, Note, "all readings are equal"),
            (
                |r| r.noise_rms_m = 9.1e-6,
                Warning,
                "noise 9.10 um RMS, above 1 % of the soft limit of 900.00 um",
            ),
            (
                |r| r.noise_rms_m = 475e-6,
                Failure,
                "noise 475.00 um RMS, above 25 % of the soft limit",
            ),
            (|r| r.noise_rms_m = f64::NAN, Failure, "above 25 %"),
            (|r| r.gaps = 1, Warning, "1 missing readings"),
            (|r| r.damaged_bytes = 7, Warning, "7 damaged bytes"),
        ];
        for (change, severity, text) in cases {
            let mut readings = healthy();
            change(&mut readings);
            let found = not_ok(&readings);
            assert_eq!(found.len(), 1, "{readings:?}: {found:?}");
            assert_eq!(found[0].0, severity, "{found:?}");
            assert!(found[0].1.contains(text), "{}: {text}", found[0].1);
        }
    }

    #[test]
    fn noise_is_the_deviation_of_distinct_readings() {
        let mut samples = Samples::default();
        let mut add = |sequence, position_m, validity| {
            samples.add(&Reading {
                sequence,
                position_m,
                validity,
                age_ns: 1_000_000,
            });
        };
        for (sequence, position_m) in [(1, 1e-6), (1, 1e-6), (2, 3e-6), (2, 3e-6), (2, 3e-6)] {
            add(sequence, position_m, Validity::Valid);
        }
        add(3, 1.0, Validity::OutOfRange);
        let figures = samples.figures();
        assert_eq!((figures.looks, figures.valid_looks), (6, 5));
        assert_eq!(figures.out_of_range_looks, 1);
        assert!((figures.position_mean_m - 2e-6).abs() < 1e-18);
        assert!((figures.noise_rms_m - 1e-6).abs() < 1e-18);
        assert_eq!(
            (figures.position_farthest_m, figures.age_max_s),
            (3e-6, 1e-3)
        );
        assert_eq!(Samples::default().figures().noise_rms_m, 0.0);
    }

    #[test]
    fn lengths_have_a_unit_that_fits() {
        assert_eq!(
            [40e-9, 1.5e-6, 2e-3].map(length),
            ["40.0 nm", "1.50 um", "2.00 mm"]
        );
    }
}

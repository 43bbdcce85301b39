//! What the probe gives within about a second, seen as the loop sees it: the newest reading and its age.

use std::time::{Duration, Instant};

use bench_hal::serial::{SerialProbe, Statistics};
use bench_hal::{DisplacementProbe, Reading, Tick, Validity};
use serde::Serialize;

use super::finding::Finding;
use crate::config::{Config, InterlockSettings, ProbeSettings};

const SUBJECT: &str = "readings";
/// How long a first reading may take: as long as a run waits.
const FIRST: Duration = Duration::from_secs(2);
/// How long readings are watched.
const WATCHED: Duration = Duration::from_secs(1);
/// Time between looks: as often as a loop of 1 kHz looks.
const LOOK: Duration = Duration::from_millis(1);

/// Figures of the readings, in SI units.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Readings {
    /// How long they were watched.
    pub watched_s: f64,
    /// Whether a valid one came at all.
    pub came: bool,
    /// Looks at the newest reading.
    pub looks: u64,
    /// Of these: it was valid.
    pub valid_looks: u64,
    /// Of these: it was out of the probe's range.
    pub out_of_range_looks: u64,
    /// Readings a second.
    pub rate_hz: f64,
    /// Mean age of the newest reading, at a look.
    pub age_mean_s: f64,
    /// Its largest age.
    pub age_max_s: f64,
    /// Mean position.
    pub position_mean_m: f64,
    /// The position farthest from zero.
    pub position_farthest_m: f64,
    /// Standard deviation of the positions: the noise, if the stage rests.
    pub noise_rms_m: f64,
    /// Readings that are known to be missing.
    pub gaps: u64,
    /// Bytes that belonged to nothing.
    pub damaged_bytes: u64,
    /// Requests without an answer.
    pub timeouts: u64,
    /// Times the probe said that it cannot measure.
    pub faults: u64,
    /// Bytes received.
    pub bytes: u64,
}

/// Watches an open probe.
pub fn gather(probe: &mut SerialProbe, config: &Config) -> Readings {
    let came = wait_for_first(probe);
    let (before, began) = (probe.statistics(), Instant::now());
    let look = LOOK.min(Duration::from_secs_f64(config.servo.period_s()));
    let mut tally = Tally::default();
    while began.elapsed() < WATCHED {
        tally.take(&probe.latest(Tick::default()));
        std::thread::sleep(look);
    }
    let watched_s = began.elapsed().as_secs_f64();
    counted(
        Readings {
            came,
            watched_s,
            ..tally.figures()
        },
        &before,
        &probe.statistics(),
    )
}

fn wait_for_first(probe: &mut SerialProbe) -> bool {
    let began = Instant::now();
    while probe.latest(Tick::default()).validity != Validity::Valid {
        if began.elapsed() > FIRST {
            return false;
        }
        std::thread::sleep(LOOK);
    }
    true
}

/// Counts between two looks at the statistics. Without a first reading, those since the opening tell more.
fn counted(readings: Readings, before: &Statistics, after: &Statistics) -> Readings {
    let nothing = Statistics::default();
    let since = if readings.came { before } else { &nothing };
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

/// What the looks add up to.
#[derive(Clone, Debug, Default)]
struct Tally {
    looks: u64,
    valid: u64,
    out_of_range: u64,
    age_sum_s: f64,
    age_max_s: f64,
    sequence: Option<u64>,
    positions_m: Vec<f64>,
}

impl Tally {
    fn take(&mut self, reading: &Reading) {
        self.looks += 1;
        self.out_of_range += u64::from(reading.validity == Validity::OutOfRange);
        if reading.validity != Validity::Valid {
            return;
        }
        let age_s = reading.age_ns as f64 * 1e-9;
        self.valid += 1;
        self.age_sum_s += age_s;
        self.age_max_s = self.age_max_s.max(age_s);
        if self.sequence.replace(reading.sequence) != Some(reading.sequence) {
            self.positions_m.push(reading.position_m);
        }
    }

    fn figures(&self) -> Readings {
        let count = (self.positions_m.len() as f64).max(1.0);
        // From the first on: where all are the same, nothing is left to be rounded.
        let first_m = self.positions_m.first().copied().unwrap_or_default();
        let mean_m = first_m + self.positions_m.iter().map(|x| x - first_m).sum::<f64>() / count;
        let square_m2 = self
            .positions_m
            .iter()
            .map(|x| (x - mean_m) * (x - mean_m))
            .sum::<f64>()
            / count;
        let farther = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
        Readings {
            looks: self.looks,
            valid_looks: self.valid,
            out_of_range_looks: self.out_of_range,
            age_mean_s: self.age_sum_s / (self.valid as f64).max(1.0),
            age_max_s: self.age_max_s,
            position_mean_m: mean_m,
            position_farthest_m: self.positions_m.iter().fold(0.0, farther),
            noise_rms_m: square_m2.sqrt(),
            ..Readings::default()
        }
    }
}

/// What the figures mean for a run.
pub fn findings(seen: &Readings, config: &Config) -> Vec<Finding> {
    if !seen.came {
        return vec![none(seen)];
    }
    let findings = [
        validity(seen),
        rate(seen, &config.probe),
        Some(age(seen, &config.probe, &config.interlock)),
        Some(position(seen, &config.interlock)),
        Some(noise(seen)),
        Some(damage(seen)),
    ];
    findings.into_iter().flatten().collect()
}

fn none(seen: &Readings) -> Finding {
    let Readings {
        bytes,
        damaged_bytes,
        timeouts,
        faults,
        ..
    } = seen;
    let figures = format!(
        "{bytes} bytes, {damaged_bytes} of them damaged, {timeouts} missing answers, {faults} faults"
    );
    let (what, remedy) = match (bytes, seen.out_of_range_looks) {
        (_, 1..) => (
            "the target is outside the probe's range",
            "move probe or stage until the probe's own display shows a value",
        ),
        (0, _) => (
            "the probe says nothing",
            "check its power and wiring (A and B swapped?), baud rate and address",
        ),
        _ if *faults > 0 => (
            "the probe says that it cannot measure",
            "its own display says why: target, cable, controller",
        ),
        _ => (
            "bytes come, but no reading",
            "check baud rate, parity and protocol in probe.device",
        ),
    };
    Finding::failure(SUBJECT, format!("{what}: {figures}"), remedy)
}

fn validity(seen: &Readings) -> Option<Finding> {
    let bad = seen.looks - seen.valid_looks;
    let share = 100.0 * bad as f64 / (seen.looks as f64).max(1.0);
    let what = format!(
        "{bad} of {} looks met no valid reading ({share:.1} %; out of range {})",
        seen.looks, seen.out_of_range_looks
    );
    (bad > 0).then(|| {
        Finding::failure(
            SUBJECT,
            what,
            "a run trips on the first: centre the stage in the probe's range, check its cable",
        )
    })
}

fn rate(seen: &Readings, probe: &ProbeSettings) -> Option<Finding> {
    let configured_hz = probe.rate_hz?;
    let what = format!(
        "{:.0} readings a second; probe.rate_hz is {configured_hz}",
        seen.rate_hz
    );
    let remedy = "set probe.rate_hz to what comes: margins and simulation are computed with it";
    Some(match seen.rate_hz / configured_hz {
        ..0.9 => Finding::warning(SUBJECT, what, remedy),
        1.1.. => Finding::note(SUBJECT, what, remedy),
        _ => Finding::ok(SUBJECT, what),
    })
}

/// In the mean a reading is as old as on its arrival and half the time to the next one.
fn age(seen: &Readings, probe: &ProbeSettings, interlock: &InterlockSettings) -> Finding {
    let ms = |s: f64| format!("{:.2} ms", s * 1e3);
    let expected_s = probe.age_at_arrival_s() + probe.rate_hz.map_or(0.0, |rate_hz| 0.5 / rate_hz);
    let stale_s = interlock.probe_stale_s;
    let what = format!(
        "age {} in the mean, {} at most; the configuration expects {} in the mean and trips at {}",
        ms(seen.age_mean_s),
        ms(seen.age_max_s),
        ms(expected_s),
        ms(stale_s)
    );
    let remedy = "correct probe.latency_s, transport_s and rate_hz; low latency of the adapter and a quiet machine make readings younger";
    match (seen.age_max_s > stale_s, seen.age_mean_s > 1.2 * expected_s) {
        (true, _) => Finding::failure(
            SUBJECT,
            what,
            format!("{remedy}; or raise interlock.probe_stale_s if the loop bears it"),
        ),
        (_, true) => Finding::warning(SUBJECT, what, remedy),
        _ => Finding::ok(SUBJECT, what),
    }
}

fn position(seen: &Readings, interlock: &InterlockSettings) -> Finding {
    let um = |m: f64| format!("{:+.1} um", m * 1e6);
    let limit_m = interlock.soft_limit_m;
    let (mean, farthest) = (um(seen.position_mean_m), um(seen.position_farthest_m));
    let what = format!(
        "position {mean} in the mean, {farthest} at the farthest; the soft limit is {:.1} um",
        limit_m * 1e6
    );
    match seen.position_farthest_m.abs() > limit_m {
        true => Finding::failure(
            SUBJECT,
            what,
            "a run trips at once: centre the stage, or correct the mounting's gain and offset_m",
        ),
        false => Finding::ok(SUBJECT, what),
    }
}

fn noise(seen: &Readings) -> Finding {
    let what = format!("noise {} RMS, if the stage rests", length(seen.noise_rms_m));
    match seen.noise_rms_m > 0.0 {
        true => Finding::ok(SUBJECT, what),
        false => Finding::note(
            SUBJECT,
            "every reading is the same",
            "push the stage gently: a probe that measures shows it",
        ),
    }
}

/// In the unit that a person reads.
fn length(m: f64) -> String {
    match m {
        1e-3.. => format!("{:.2} mm", m * 1e3),
        1e-6.. => format!("{:.2} um", m * 1e6),
        _ => format!("{:.1} nm", m * 1e9),
    }
}

fn damage(seen: &Readings) -> Finding {
    let Readings {
        gaps,
        damaged_bytes,
        timeouts,
        faults,
        watched_s,
        ..
    } = seen;
    let what = format!(
        "within {watched_s:.1} s: {gaps} readings missing, {damaged_bytes} damaged bytes, {timeouts} missing answers, {faults} faults"
    );
    match gaps + damaged_bytes + timeouts + faults {
        0 => Finding::ok(SUBJECT, what),
        _ => Finding::warning(
            SUBJECT,
            what,
            "check shield, ground and termination of the line, and that nothing else talks on it",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Source, load};
    use crate::doctor::Severity::{self, Failure, Note, Warning};

    fn lab() -> Config {
        load(&Source {
            config: Some("lab".into()),
            ..Source::default()
        })
        .unwrap()
    }

    fn sound() -> Readings {
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

    fn bad(seen: Readings) -> Vec<(Severity, String)> {
        let found = findings(&seen, &lab()).into_iter();
        found
            .filter(|finding| finding.verdict != Severity::Ok)
            .map(|finding| (finding.verdict, finding.what))
            .collect()
    }

    #[test]
    fn sound_readings_are_ok_in_everything() {
        assert_eq!(bad(sound()), []);
        assert!(
            findings(&sound(), &lab())
                .iter()
                .any(|f| f.what == "noise 40.0 nm RMS, if the stage rests")
        );
    }

    #[test]
    fn each_trouble_of_readings_has_its_verdict_and_words() {
        // lab: expected 0.3 + 1.4 + 0.77 = 2.47 ms in the mean, stale at 10 ms, soft limit 900 um, 650 Hz.
        let cases = [
            (
                Readings {
                    came: false,
                    bytes: 0,
                    timeouts: 20,
                    ..sound()
                },
                Failure,
                "says nothing: 0 bytes",
            ),
            (
                Readings {
                    came: false,
                    damaged_bytes: 10_000,
                    ..sound()
                },
                Failure,
                "bytes come, but no reading",
            ),
            (
                Readings {
                    came: false,
                    faults: 3,
                    ..sound()
                },
                Failure,
                "cannot measure",
            ),
            (
                Readings {
                    came: false,
                    out_of_range_looks: 9,
                    ..sound()
                },
                Failure,
                "outside the probe's range",
            ),
            (
                Readings {
                    valid_looks: 990,
                    out_of_range_looks: 10,
                    ..sound()
                },
                Failure,
                "10 of 1000 looks",
            ),
            (
                Readings {
                    rate_hz: 500.0,
                    ..sound()
                },
                Warning,
                "500 readings a second; probe.rate_hz is 650",
            ),
            (
                Readings {
                    rate_hz: 900.0,
                    ..sound()
                },
                Note,
                "900 readings a second",
            ),
            (
                Readings {
                    age_mean_s: 0.0031,
                    ..sound()
                },
                Warning,
                "age 3.10 ms in the mean",
            ),
            (
                Readings {
                    age_max_s: 0.0101,
                    ..sound()
                },
                Failure,
                "10.10 ms at most",
            ),
            (
                Readings {
                    position_farthest_m: -950e-6,
                    ..sound()
                },
                Failure,
                "-950.0 um at the farthest",
            ),
            (
                Readings {
                    noise_rms_m: 0.0,
                    ..sound()
                },
                Note,
                "every reading is the same",
            ),
            (
                Readings { gaps: 1, ..sound() },
                Warning,
                "1 readings missing",
            ),
            (
                Readings {
                    damaged_bytes: 7,
                    ..sound()
                },
                Warning,
                "7 damaged bytes",
            ),
        ];
        for (seen, verdict, words) in cases {
            let found = bad(seen.clone());
            assert_eq!(
                (found.len(), found[0].0),
                (1, verdict),
                "{seen:?}: {found:?}"
            );
            assert!(found[0].1.contains(words), "{}: {words}", found[0].1);
        }
    }

    #[test]
    fn noise_is_the_deviation_of_readings_each_counted_once() {
        let reading = |sequence, position_m, validity| Reading {
            sequence,
            position_m,
            validity,
            age_ns: 1_000_000,
        };
        let mut tally = Tally::default();
        for (sequence, position_m) in [(1, 1e-6), (1, 1e-6), (2, 3e-6), (2, 3e-6), (2, 3e-6)] {
            tally.take(&reading(sequence, position_m, Validity::Valid));
        }
        tally.take(&reading(3, 1.0, Validity::OutOfRange));
        let figures = tally.figures();
        assert_eq!(
            (
                figures.looks,
                figures.valid_looks,
                figures.out_of_range_looks
            ),
            (6, 5, 1)
        );
        assert!(
            (figures.position_mean_m - 2e-6).abs() < 1e-18
                && (figures.noise_rms_m - 1e-6).abs() < 1e-18
        );
        assert_eq!(
            (figures.position_farthest_m, figures.age_max_s),
            (3e-6, 1e-3)
        );
        assert_eq!(Tally::default().figures().noise_rms_m, 0.0);
    }

    #[test]
    fn lengths_are_in_the_unit_that_a_person_reads() {
        assert_eq!(
            [40e-9, 1.5e-6, 2e-3].map(length),
            ["40.0 nm", "1.50 um", "2.00 mm"]
        );
    }
}

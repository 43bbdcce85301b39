//! How old a reading is: never older than it says, and not handed out where nobody can say.

use std::time::Duration;

use bench_hal::Validity;
use bench_hal::serial::emulator::Fault;
use bench_hal::serial::{Polling, ProbeSettings, Protocol, SerialProbe, ascii};

use crate::support::probes::{
    RANGE_M, all, capancdt, is_near, keyence, keyence_polled, optoncdt, ramp, still,
};
use crate::support::rehearsal::{Rehearsal, latest, more, until};

#[test]
fn before_the_first_value_the_reading_is_missing() {
    for protocol in all() {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        rehearsal.inject_fault(Fault::Silence);
        let mut probe = rehearsal.open(&protocol);
        let turns = |probe: &mut SerialProbe| {
            (
                latest(probe).validity,
                latest(probe).sequence,
                latest(probe).age_ns,
            )
        };
        let (first, second) = (turns(&mut probe), turns(&mut probe));
        assert_eq!(
            ((first.0, first.1), (second.0, second.1)),
            ((Validity::Missing, 0), (Validity::Missing, 0))
        );
        assert!(
            second.2 > first.2,
            "{protocol:?}: the age of nothing grows, too"
        );
    }
}

#[test]
fn a_reading_of_a_polled_probe_is_never_older_than_its_age_says_however_late_the_answers() {
    // Within the timeout this holds however the threads are kept from running; later answers: see the exchange's tests.
    let polling = Polling {
        timeout: Duration::from_secs(1),
        ..Polling::default()
    };
    for protocol in [capancdt(), keyence_polled()].map(finer) {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, ramp);
        let mut probe = SerialProbe::open(ProbeSettings {
            polling,
            ..rehearsal.settings(&protocol)
        })
        .unwrap();
        more(&mut probe, 20);
        for fault in [
            Fault::Late { by_ns: 30_000_000 },
            Fault::None,
            Fault::Late { by_ns: 100_000_000 },
        ] {
            rehearsal.inject_fault(fault);
            more_checked(&rehearsal, &mut probe, 8);
        }
    }
}

#[test]
fn answers_later_than_the_timeout_are_used_with_their_true_age() {
    let polling = Polling {
        timeout: Duration::from_millis(40),
        ..Polling::default()
    };
    let rehearsal = Rehearsal::new(&capancdt(), 1000.0, still);
    let mut probe = SerialProbe::open(ProbeSettings {
        polling,
        ..rehearsal.settings(&capancdt())
    })
    .unwrap();
    more(&mut probe, 3);
    rehearsal.inject_fault(Fault::Late { by_ns: 100_000_000 });
    until(&mut probe, "timed out", |_, statistics| {
        statistics.timeouts > 3
    });
    assert!(more(&mut probe, 2).age_ns >= 100_000_000);
    rehearsal.inject_fault(Fault::None);
    until(&mut probe, "young again", |reading, _| {
        reading.age_ns < 30_000_000
    });
}

/// The same probe with steps that are much shorter than a millisecond of [`ramp`].
fn finer(protocol: Protocol) -> Protocol {
    match protocol {
        Protocol::Ascii(settings) => Protocol::Ascii(ascii::Settings {
            unit_m: 1e-6,
            line: "M1,{value:10.5}".into(),
            ..settings
        }),
        other => other,
    }
}

/// Waits for so many more readings: each was made no longer ago than it says, up to the probe's period of 1 ms (it sends
/// its latest measurement, which is as old as that) and a step of its output.
fn more_checked(rehearsal: &Rehearsal, probe: &mut SerialProbe, count: u64) {
    let goal = probe.statistics().published + count;
    while probe.statistics().published < goal {
        let now_ns = rehearsal.now_ns();
        let reading = latest(probe);
        let made_ns = (reading.position_m / RANGE_M * 100.0 * 1e9) as u64;
        let true_age_ns = now_ns - made_ns.min(now_ns);
        assert!(
            true_age_ns <= reading.age_ns + 1_100_000,
            "made {true_age_ns} ns ago, says {} ns",
            reading.age_ns
        );
        std::thread::sleep(Duration::from_micros(500));
    }
}

#[test]
fn late_values_of_a_stream_are_still_values_and_their_lateness_cannot_be_known() {
    for protocol in [optoncdt(), keyence()] {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open(&protocol);
        more(&mut probe, 3);
        rehearsal.inject_fault(Fault::Late { by_ns: 50_000_000 });
        assert!(is_near(more(&mut probe, 50).position_m, 60e-6));
    }
}

#[test]
fn the_known_latency_and_the_time_on_the_line_count_to_the_age() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let latency = Duration::from_secs(700);
    let mut settings = ProbeSettings {
        latency,
        ..rehearsal.settings(&optoncdt())
    };
    settings.port.baud = 300; // three characters of ten bits: 100 ms
    let mut probe = SerialProbe::open(settings).unwrap();
    let youngest_ns = (0..50).map(|_| more(&mut probe, 1).age_ns).min().unwrap();
    assert!(youngest_ns >= 700_100_000_000, "{youngest_ns}");
}

#[test]
fn what_came_before_the_port_was_open_is_not_read() {
    for protocol in [optoncdt(), keyence()] {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        std::thread::sleep(Duration::from_millis(50)); // some fifty values wait in the terminal
        rehearsal.inject_fault(Fault::Silence);
        let mut probe = rehearsal.open(&protocol);
        std::thread::sleep(Duration::from_millis(50));
        assert_eq!(
            (latest(&mut probe).validity, probe.statistics().bytes),
            (Validity::Missing, 0),
            "{protocol:?}"
        );
    }
}

#[test]
fn what_a_reader_finds_after_it_was_kept_from_looking_is_not_handed_out() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let kept = || std::thread::sleep(Duration::from_millis(100));
    let mut probe = SerialProbe::open_with(rehearsal.settings(&optoncdt()), kept).unwrap();
    until(&mut probe, "read", |_, statistics| statistics.values > 0);
    until(&mut probe, "a reading of unknown age", |_, statistics| {
        statistics.unknown_age > 0
    });
    more(&mut probe, 3);
}

#[test]
fn a_batch_gives_its_newest_and_counts_the_others_and_the_gaps() {
    let rehearsal = Rehearsal::new(&capancdt(), 4000.0, still);
    let interval = |ms| Polling {
        interval: Duration::from_millis(ms),
        ..Polling::default()
    };
    let mut probe = SerialProbe::open(ProbeSettings {
        polling: interval(3),
        ..rehearsal.settings(&capancdt())
    })
    .unwrap();
    more(&mut probe, 20);
    let statistics = probe.statistics();
    assert!(
        statistics.superseded > statistics.published,
        "12 values an answer: {statistics:?}"
    );
    until(&mut probe, "all numbered", |reading, _| {
        reading.sequence >= statistics.values + statistics.gaps
    });
    drop(probe);
    let mut slow = SerialProbe::open(ProbeSettings {
        polling: interval(50),
        ..rehearsal.settings(&capancdt())
    })
    .unwrap();
    until(&mut slow, "gaps", |_, statistics| statistics.gaps > 500);
    // 200 measurements in 50 ms, 20 in the answer: nine of ten are lost, and numbered nevertheless.
    assert!(more(&mut slow, 1).sequence > 500);
}

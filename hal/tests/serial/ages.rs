//! The age of a reading: never less than the true age, and no reading if the age is unknown.

use std::io::Write;
use std::sync::Arc;
use std::time::Duration;

use bench_hal::Validity;
use bench_hal::serial::emulator::Fault;
use bench_hal::serial::{
    Polling, PortSettings, ProbeSettings, Protocol, SerialProbe, ascii, optoncdt,
};
use serialport::{SerialPort, TTYPort};

use crate::support::probes::{
    RANGE_M, all, capancdt_with, fine_keyence_with, is_near, keyence, optoncdt, ramp, still,
};
use crate::support::rehearsal::{Rehearsal, latest, more, until, wait_for};

#[test]
fn reading_is_missing_before_the_first_value() {
    for protocol in all() {
        let rehearsal = Rehearsal::with_fault(&protocol, 1000.0, still, Fault::Silence);
        let mut probe = rehearsal.open();
        let (first, second) = (latest(&mut probe), latest(&mut probe));
        for reading in [first, second] {
            assert_eq!(
                (reading.validity, reading.sequence),
                (Validity::Missing, 0),
                "{protocol:?}"
            );
        }
        assert!(
            second.age_ns > first.age_ns,
            "{protocol:?}: the age grows without readings, too"
        );
    }
}

/// Long enough that a suspended thread does not cause a timeout. The tests of the poller cover later answers.
const LONG_TIMEOUT: Polling = Polling {
    interval: Duration::ZERO,
    timeout: Duration::from_secs(1),
    quiet: Duration::from_millis(20),
};

#[test]
fn capancdt_age_is_never_understated_with_late_answers() {
    age_is_never_understated_with_late_answers(capancdt_with(LONG_TIMEOUT));
}

#[test]
fn ascii_age_is_never_understated_with_late_answers() {
    age_is_never_understated_with_late_answers(fine_keyence_with(LONG_TIMEOUT));
}

fn age_is_never_understated_with_late_answers(protocol: Arc<dyn Protocol>) {
    let rehearsal = Rehearsal::new(&protocol, 1000.0, ramp);
    let mut probe = rehearsal.open();
    more(&mut probe, 20);
    for fault in [
        Fault::Late { by_ns: 30_000_000 },
        Fault::None,
        Fault::Late { by_ns: 100_000_000 },
    ] {
        rehearsal.inject_fault(fault);
        more_with_age_checked(&rehearsal, &mut probe, 8);
    }
}

/// Waits for `count` more readings. The true age of each must not exceed the stated age by more than the sampling period
/// of 1 ms (the probe sends its latest measurement, which is up to 1 ms old) and a step of the output.
fn more_with_age_checked(rehearsal: &Rehearsal, probe: &mut SerialProbe, count: u64) {
    let goal = probe.statistics().published + count;
    while probe.statistics().published < goal {
        let now_ns = rehearsal.now_ns();
        let reading = latest(probe);
        let measured_ns = (reading.position_m / RANGE_M * 100.0 * 1e9) as u64;
        let true_age_ns = now_ns.saturating_sub(measured_ns);
        assert!(
            true_age_ns <= reading.age_ns + 1_100_000,
            "measured {true_age_ns} ns ago, stated {} ns",
            reading.age_ns
        );
        std::thread::sleep(Duration::from_micros(500));
    }
}

#[test]
fn answers_after_the_timeout_are_used_with_their_true_age() {
    let polling = Polling {
        timeout: Duration::from_millis(40),
        ..Polling::default()
    };
    let rehearsal = Rehearsal::new(&capancdt_with(polling), 1000.0, still);
    let mut probe = rehearsal.open();
    more(&mut probe, 3);
    rehearsal.inject_fault(Fault::Late { by_ns: 100_000_000 });
    until(&mut probe, "timeouts", |_, statistics| {
        statistics.timeouts > 3
    });
    assert!(more(&mut probe, 2).age_ns >= 100_000_000);
    rehearsal.inject_fault(Fault::None);
    until(&mut probe, "a small age", |reading, _| {
        reading.age_ns < 30_000_000
    });
}

#[test]
fn late_stream_values_are_used() {
    for protocol in [optoncdt(), keyence()] {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open();
        more(&mut probe, 3);
        rehearsal.inject_fault(Fault::Late { by_ns: 50_000_000 });
        assert!(is_near(more(&mut probe, 50).position_m, 60e-6));
    }
}

#[test]
fn age_includes_latency_and_time_on_the_line() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let mut settings = ProbeSettings {
        latency: Duration::from_secs(700),
        ..rehearsal.settings()
    };
    settings.port.baud = 300; // three characters of ten bits: 100 ms
    let mut probe = SerialProbe::open(settings).unwrap();
    let least_ns = (0..50).map(|_| more(&mut probe, 1).age_ns).min().unwrap();
    // Latency of 700 s and 0.1 s on the line. The upper bound allows 10 s for the fastest of 50 readings on a loaded machine.
    assert!(
        (700_100_000_000..710_100_000_000).contains(&least_ns),
        "{least_ns}"
    );
}

/// The terminal itself is used here instead of an emulated probe, so that all old bytes are certainly in the input queue
/// when the port is opened. The first new message follows them: that it is the only one read shows that they were discarded.
fn old_bytes_are_discarded(protocol: Arc<dyn Protocol>, old: &[u8], new: &[u8]) {
    let (mut master, slave) = TTYPort::pair().unwrap();
    let old = old.repeat(20);
    master.write_all(&old).unwrap();
    // The kernel transfers the bytes.
    wait_for("the old bytes", || {
        slave.bytes_to_read().unwrap() >= old.len() as u32
    });
    let path = slave.name().unwrap();
    let locks = tempfile::tempdir().unwrap();
    let port = PortSettings {
        lock_dir: locks.path().into(),
        ..PortSettings::new(path, 921_600)
    };
    let mut probe = SerialProbe::open(ProbeSettings::new(port, protocol)).unwrap();
    master.write_all(new).unwrap();
    until(&mut probe, "the new message", |_, statistics| {
        statistics.bytes >= new.len() as u64
    });
    let statistics = probe.statistics();
    assert_eq!(statistics.bytes, new.len() as u64, "{statistics:?}");
}

#[test]
fn discards_binary_data_received_before_opening() {
    let message = |x| optoncdt::message(x, true);
    old_bytes_are_discarded(optoncdt(), &message(20_000), &message(30_000));
}

#[test]
fn discards_lines_received_before_opening() {
    let format = ascii::LineFormat::new(ascii::Settings::keyence_lk_g(RANGE_M)).unwrap();
    let line = |position_m| format.write(ascii::Output::Position(position_m));
    old_bytes_are_discarded(keyence(), &line(50e-6), &line(60e-6));
}

#[test]
fn does_not_publish_bytes_received_during_reader_suspension() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let suspend = || std::thread::sleep(Duration::from_millis(100));
    let mut probe = SerialProbe::open_with(rehearsal.settings(), suspend).unwrap();
    until(&mut probe, "values", |_, statistics| statistics.values > 0);
    until(&mut probe, "a value of unknown age", |_, statistics| {
        statistics.unknown_age > 0
    });
    more(&mut probe, 3);
}

fn polled_every(interval_ms: u64) -> Arc<dyn Protocol> {
    capancdt_with(Polling {
        interval: Duration::from_millis(interval_ms),
        ..Polling::default()
    })
}

#[test]
fn publishes_the_newest_value_of_a_batch_and_counts_the_others() {
    let rehearsal = Rehearsal::new(&polled_every(3), 4000.0, still);
    let mut probe = rehearsal.open();
    more(&mut probe, 20);
    let statistics = probe.statistics();
    assert!(
        statistics.superseded > statistics.published,
        "12 values per answer: {statistics:?}"
    );
    until(&mut probe, "all numbered", |reading, _| {
        reading.sequence >= statistics.values + statistics.gaps
    });
}

#[test]
fn sequence_counts_values_that_were_lost() {
    // 200 measurements in 50 ms, 20 in the answer: nine of ten are lost, but numbered.
    let rehearsal = Rehearsal::new(&polled_every(50), 4000.0, still);
    let mut probe = rehearsal.open();
    until(&mut probe, "gaps", |_, statistics| statistics.gaps > 500);
    assert!(more(&mut probe, 1).sequence > 500);
}

//! The driver over a pseudo terminal, against the pretend probe of each protocol, well and with every fault.

use bench_hal::Validity;
use bench_hal::serial::emulator::Fault;
use bench_hal::serial::{Mounting, Parity, PortSettings, ProbeSettings, Protocol, SerialProbe};

use crate::support::probes::{
    RANGE_M, all, capancdt, is_near, keyence_polled, optoncdt, ramp, still,
};
use crate::support::rehearsal::{Rehearsal, latest, more, until};

/// Runs `test` against each protocol's probe at 1 kHz, once readings come in, with a stage that moves so.
fn against_each(
    motion: fn(u64) -> f64,
    mut test: impl FnMut(&Rehearsal, &mut SerialProbe, &Protocol),
) {
    for protocol in all() {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, motion);
        let mut probe = rehearsal.open(&protocol);
        more(&mut probe, 3);
        test(&rehearsal, &mut probe, &protocol);
    }
}

#[test]
fn a_healthy_probe_is_read_where_it_is() {
    against_each(still, |_, probe, protocol| {
        let reading = more(probe, 50);
        assert_eq!(reading.validity, Validity::Valid, "{protocol:?}");
        assert!(
            is_near(reading.position_m, 60e-6),
            "{protocol:?} {reading:?}"
        );
        let statistics = probe.statistics();
        assert!(
            statistics.running && statistics.out_of_range == 0,
            "{statistics:?}"
        );
        assert_eq!(
            statistics.values,
            statistics.published + statistics.superseded + statistics.unknown_age,
            "{statistics:?}"
        );
        until(probe, "a rate", |_, statistics| statistics.rate_hz > 0.0);
    });
}

#[test]
fn mounting_turns_and_shifts_the_reading() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let mounting = Mounting {
        gain: -1.0,
        offset_m: 100e-6,
    };
    let mut probe = SerialProbe::open(ProbeSettings {
        mounting,
        ..rehearsal.settings(&optoncdt())
    })
    .unwrap();
    assert!(is_near(more(&mut probe, 3).position_m, 40e-6));
}

#[test]
fn silence_leaves_the_sequence_and_lets_the_age_grow() {
    against_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Silence);
        let old = until(probe, "old", |reading, _| reading.age_ns > 30_000_000); // nothing more is under way
        let older = until(probe, "older", |reading, _| reading.age_ns > 150_000_000);
        assert_eq!(
            (older.sequence, older.position_m),
            (old.sequence, old.position_m),
            "{protocol:?}"
        );
        rehearsal.inject_fault(Fault::None);
        until(probe, "young again", |reading, _| {
            reading.age_ns < 30_000_000 && reading.sequence > older.sequence
        });
    });
}

#[test]
fn a_polled_probe_that_falls_silent_is_reported_with_a_remedy() {
    for protocol in [capancdt(), keyence_polled()] {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open(&protocol);
        more(&mut probe, 3);
        rehearsal.inject_fault(Fault::Silence);
        until(&mut probe, "timed out", |_, statistics| {
            statistics.timeouts >= 2
        });
        let error = probe.statistics().last_error.unwrap().to_string();
        assert!(
            error.contains("did not answer") && error.contains("baud rate"),
            "{error}"
        );
    }
}

#[test]
fn damaged_bytes_are_counted_and_good_values_still_come() {
    against_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Corrupt { every: 97 });
        let damaged = probe.statistics().damaged_bytes;
        let goal = (damaged + 20, probe.statistics().published + 20);
        until(probe, "damaged and well", |reading, statistics| {
            // A checksum sees every single wrong byte; the others believe a wrong digit or data bit.
            let checked = matches!(protocol, Protocol::Capancdt(_));
            assert!(
                !checked
                    || reading.validity == Validity::Valid && is_near(reading.position_m, 60e-6),
                "{reading:?}"
            );
            statistics.damaged_bytes >= goal.0 && statistics.published >= goal.1
        });
    });
}

#[test]
fn a_stuck_value_is_handed_on_as_what_it_is_new_values_that_do_not_change() {
    against_each(ramp, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Stuck);
        more(probe, 10); // what was under way
        let first = latest(probe);
        let later = more(probe, 100);
        assert!(later.sequence > first.sequence, "{protocol:?}");
        assert_eq!(
            later.position_m.to_bits(),
            first.position_m.to_bits(),
            "{protocol:?}"
        );
    });
}

#[test]
fn a_jumping_value_is_handed_on() {
    against_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Jump {
            every: 2,
            by_m: 50e-6,
        });
        let jumped = until(probe, "jumped", |reading, _| {
            is_near(reading.position_m, 110e-6)
        });
        assert_eq!(jumped.validity, Validity::Valid, "{protocol:?}");
        until(probe, "back", |reading, _| {
            is_near(reading.position_m, 60e-6)
        });
    });
}

#[test]
fn out_of_range_is_said_and_the_position_is_the_ranges_end() {
    against_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::OutOfRange);
        let beyond = until(probe, "out of range", |reading, _| {
            reading.validity == Validity::OutOfRange
        });
        assert_eq!(beyond.position_m, RANGE_M, "{protocol:?}");
        assert!(probe.statistics().out_of_range > 0);
        rehearsal.inject_fault(Fault::None);
        until(probe, "back", |reading, _| {
            reading.validity == Validity::Valid && reading.sequence > beyond.sequence
        });
    });
}

#[test]
fn after_a_reset_of_the_probe_readings_go_on_and_the_sequence_does_not_fall() {
    against_each(still, |rehearsal, probe, protocol| {
        let before = more(probe, 200);
        rehearsal.inject_fault(Fault::Reset);
        let after = more(probe, 50);
        assert!(
            after.sequence > before.sequence && after.validity == Validity::Valid,
            "{protocol:?}"
        );
        if matches!(protocol, Protocol::Capancdt(_)) {
            let statistics = probe.statistics();
            assert_eq!(statistics.restarts, 1, "{statistics:?}");
            assert!(
                statistics
                    .last_error
                    .is_some_and(|error| error.what.contains("restarted")),
                "{statistics:?}"
            );
        }
    });
}

#[test]
fn a_pulled_cable_makes_the_last_reading_faulty_and_is_said() {
    for protocol in all() {
        let mut rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open(&protocol);
        let before = more(&mut probe, 3);
        rehearsal.unplug();
        let lost = until(&mut probe, "lost", |_, statistics| !statistics.running);
        let lost = if lost.validity == Validity::Faulty {
            lost
        } else {
            latest(&mut probe)
        };
        assert_eq!(lost.validity, Validity::Faulty, "{protocol:?}");
        assert!(lost.sequence >= before.sequence && is_near(lost.position_m, 60e-6));
        let (first, second) = (latest(&mut probe), latest(&mut probe));
        assert!(second.sequence == lost.sequence && second.age_ns > first.age_ns);
        let error = probe.statistics().last_error.unwrap().to_string();
        assert!(
            error.contains("serial port") && error.contains("open the probe again"),
            "{error}"
        );
    }
}

#[test]
fn a_pseudo_terminal_that_drops_parity_is_used_and_said() {
    let rehearsal = Rehearsal::new(&capancdt(), 1000.0, still);
    let settings = rehearsal.settings(&capancdt());
    let port = PortSettings {
        parity: Parity::Even,
        baud: 230_400,
        ..settings.port.clone()
    };
    let mut probe = SerialProbe::open(ProbeSettings { port, ..settings }).unwrap();
    more(&mut probe, 3);
    let notes = format!("{:?}", probe.notes());
    assert!(
        notes.contains("no parity: Even was dropped") && notes.contains("no low latency"),
        "{notes}"
    );
}

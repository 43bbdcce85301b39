//! The driver with the emulated probe of each protocol over a pseudo terminal, without faults and with each fault.

use std::sync::Arc;

use bench_hal::Validity;
use bench_hal::serial::emulator::Fault;
use bench_hal::serial::{Mounting, Parity, PortSettings, ProbeSettings, Protocol, SerialProbe};

use crate::support::probes::{
    RANGE_M, all, capancdt, is_capancdt, is_near, keyence_polled, optoncdt, ramp, still,
};
use crate::support::rehearsal::{Motion, Rehearsal, latest, more, until};

/// Runs `test` with the probe of each protocol at 1 kHz when readings arrive.
fn with_each(
    motion: Motion,
    mut test: impl FnMut(&Rehearsal, &mut SerialProbe, &Arc<dyn Protocol>),
) {
    for protocol in all() {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, motion);
        let mut probe = rehearsal.open();
        more(&mut probe, 3);
        test(&rehearsal, &mut probe, &protocol);
    }
}

#[test]
fn reads_the_position_of_a_probe_without_fault() {
    with_each(still, |rehearsal, probe, protocol| {
        let reading = more(probe, 50);
        assert_eq!(reading.validity, Validity::Valid, "{protocol:?}");
        assert!(
            is_near(reading.position_m, 60e-6),
            "{protocol:?} {reading:?}"
        );
        until(probe, "a rate", |_, statistics| statistics.rate_hz > 0.0);
        let statistics = probe.statistics();
        assert!(
            statistics.running && statistics.out_of_range == 0,
            "{statistics:?}"
        );
        // The counters are not read atomically, so they are compared while the probe is silent.
        rehearsal.inject_fault(Fault::Silence);
        until(probe, "all values accounted for", |_, statistics| {
            statistics.values
                == statistics.published + statistics.superseded + statistics.unknown_age
        });
    });
}

#[test]
fn applies_gain_and_offset_of_the_mounting() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let mounting = Mounting {
        gain: -1.0,
        offset_m: 100e-6,
    };
    let mut probe = SerialProbe::open(ProbeSettings {
        mounting,
        ..rehearsal.settings()
    })
    .unwrap();
    assert!(is_near(more(&mut probe, 3).position_m, 40e-6));
}

#[test]
fn silence_keeps_the_reading_and_its_age_grows() {
    with_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Silence);
        let mut previous = latest(probe);
        let old = until(probe, "an old reading", |reading, statistics| {
            if reading.sequence == previous.sequence {
                assert_eq!(reading.position_m, previous.position_m, "{protocol:?}");
                assert!(reading.age_ns >= previous.age_ns, "{protocol:?}");
            }
            assert!(reading.sequence <= statistics.values + statistics.gaps);
            previous = *reading;
            reading.age_ns > 150_000_000
        });
        rehearsal.inject_fault(Fault::None);
        until(probe, "a new reading", |reading, _| {
            reading.age_ns < 30_000_000 && reading.sequence > old.sequence
        });
    });
}

#[test]
fn reports_a_polled_probe_that_does_not_answer() {
    for protocol in [capancdt(), keyence_polled()] {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open();
        more(&mut probe, 3);
        rehearsal.inject_fault(Fault::Silence);
        until(&mut probe, "timeouts", |_, statistics| {
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
fn counts_damaged_bytes_and_continues_with_good_values() {
    with_each(still, |rehearsal, probe, protocol| {
        // A slow reader gets answers of up to 93 bytes: three of four must arrive without a wrong byte.
        rehearsal.inject_fault(Fault::Corrupt { every: 397 });
        let before = probe.statistics();
        // A checksum detects every single wrong byte; the other protocols accept a wrong digit or data bit.
        let has_checksum = is_capancdt(protocol);
        until(probe, "damage and values", |reading, statistics| {
            let is_correct =
                reading.validity == Validity::Valid && is_near(reading.position_m, 60e-6);
            assert!(!has_checksum || is_correct, "{reading:?}");
            statistics.damaged_bytes >= before.damaged_bytes + 20
                && statistics.published >= before.published + 20
        });
    });
}

#[test]
fn publishes_constant_values_of_a_stuck_probe_as_new() {
    for protocol in all() {
        let rehearsal = Rehearsal::with_fault(&protocol, 1000.0, ramp, Fault::Stuck);
        let mut probe = rehearsal.open();
        let first = more(&mut probe, 3);
        let later = more(&mut probe, 100);
        assert!(later.sequence > first.sequence, "{protocol:?}");
        assert_eq!(
            later.position_m.to_bits(),
            first.position_m.to_bits(),
            "{protocol:?}"
        );
    }
}

#[test]
fn publishes_jumps_as_measured() {
    with_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::Jump {
            every: 2,
            by_m: 50e-6,
        });
        let jump = until(probe, "a jump", |reading, _| {
            is_near(reading.position_m, 110e-6)
        });
        assert_eq!(jump.validity, Validity::Valid, "{protocol:?}");
        until(probe, "the position without jump", |reading, _| {
            is_near(reading.position_m, 60e-6)
        });
    });
}

#[test]
fn out_of_range_gives_the_end_of_the_range() {
    with_each(still, |rehearsal, probe, protocol| {
        rehearsal.inject_fault(Fault::OutOfRange);
        let outside = until(probe, "out of range", |reading, _| {
            reading.validity == Validity::OutOfRange
        });
        assert_eq!(outside.position_m, RANGE_M, "{protocol:?}");
        assert!(probe.statistics().out_of_range > 0);
        rehearsal.inject_fault(Fault::None);
        until(probe, "a valid reading", |reading, _| {
            reading.validity == Validity::Valid && reading.sequence > outside.sequence
        });
    });
}

#[test]
fn sequence_does_not_decrease_when_the_probe_restarts() {
    with_each(still, |rehearsal, probe, protocol| {
        let before = more(probe, 200);
        rehearsal.inject_fault(Fault::Reset);
        let after = more(probe, 50);
        assert!(
            after.sequence > before.sequence && after.validity == Validity::Valid,
            "{protocol:?}"
        );
    });
}

#[test]
fn reports_a_restart_that_the_counter_shows() {
    let rehearsal = Rehearsal::new(&capancdt(), 1000.0, still);
    let mut probe = rehearsal.open();
    // A restart shows only if the probe is polled again before its counter has reached the former value: within 10 s here.
    until(&mut probe, "10000 measurements", |reading, _| {
        reading.sequence >= 10_000
    });
    rehearsal.inject_fault(Fault::Reset);
    more(&mut probe, 50);
    let statistics = probe.statistics();
    assert_eq!(statistics.restarts, 1, "{statistics:?}");
}

#[test]
fn lost_port_makes_the_last_reading_faulty() {
    for protocol in all() {
        let mut rehearsal = Rehearsal::new(&protocol, 1000.0, still);
        let mut probe = rehearsal.open();
        let before = more(&mut probe, 3);
        rehearsal.unplug();
        until(&mut probe, "the end of the reader", |_, statistics| {
            !statistics.running
        });
        let lost = latest(&mut probe);
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
fn pseudo_terminal_without_parity_is_used_with_a_note() {
    let rehearsal = Rehearsal::new(&capancdt(), 1000.0, still);
    let settings = rehearsal.settings();
    let port = PortSettings {
        parity: Parity::Even,
        baud: 230_400,
        ..settings.port.clone()
    };
    let mut probe = SerialProbe::open(ProbeSettings { port, ..settings }).unwrap();
    more(&mut probe, 3);
    let notes = format!("{:?}", probe.notes());
    assert!(
        notes.contains("no parity: Even was ignored") && notes.contains("no low latency"),
        "{notes}"
    );
}

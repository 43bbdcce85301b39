//! Trips by the amplifier: its faults, its refusals, and invalid currents.
use super::*;

#[test]
fn amplifier_fault_trips_with_the_device_code() {
    let faults = [(AT..AT + 1, Fault::AmplifierFault(0x2310))];
    let trip = trips(
        &mut Bench::running(&stage(), &faults, constant()),
        AT,
        "amplifier",
    );
    assert!(
        matches!(trip, Trip::Amplifier { code: 0x2310, .. }),
        "{trip:?}"
    );
}

#[test]
fn refused_command_switches_the_amplifier_off_in_the_same_tick() {
    let mut bench = Bench::running(
        &stage(),
        &[(AT..AT + 1, Fault::RefusedCommand(-7))],
        constant(),
    );
    assert!(matches!(
        trips(&mut bench, AT, "amplifier"),
        Trip::Amplifier { code: -7, .. }
    ));
    let in_tick: Vec<AmplifierCall> = bench
        .amplifier_calls()
        .iter()
        .filter(|(tick, _)| *tick == AT)
        .map(|(_, call)| *call)
        .collect();
    assert_eq!(
        in_tick,
        [
            AmplifierCall::Command {
                current_a: SOME_A,
                refused: true
            },
            AmplifierCall::Disable
        ]
    );
    assert_eq!(
        bench.ticks().at(AT).requested_a,
        SOME_A,
        "the record has the requested current"
    );
}

#[test]
fn non_finite_returned_current_switches_the_amplifier_off() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::ReturnedCurrent(value))],
            constant(),
        );
        runs_without_trip(&mut bench, AT - 1);
        bench.run(1 + AFTER);
        // The command was sent before the current was returned. The record has zero, and the amplifier is disabled in that tick.
        assert_eq!(bench.ticks().at(AT).command_a.to_bits(), 0);
        assert_eq!(
            (bench.state(), bench.amplifier_is_on()),
            (State::Tripped, false)
        );
        assert_eq!((bench.trips().len(), bench.trips()[0].tick), (1, AT));
        let EventKind::Trip(trip) = bench.trips()[0].kind else {
            unreachable!()
        };
        assert_eq!(trip.reason(), "amplifier");
        let calls = bench.amplifier_calls();
        assert!(
            !calls
                .iter()
                .any(|(tick, call)| *tick > AT && *call != AmplifierCall::Disable)
        );
        assert_eq!(
            calls.iter().rev().find(|(tick, _)| *tick == AT),
            Some(&(AT, AmplifierCall::Disable))
        );
    }
}

#[test]
fn failed_enable_trips_and_the_program_does_not_start() {
    let mut bench = Bench::still(&stage(), &[(AT..AT + 1, Fault::RefusedEnable(31))]);
    bench.run(AT);
    bench.request(Request::Arm);
    bench.request(Request::Start(constant()));
    bench.run(1 + AFTER);
    assert!(matches!(
        assert_off_after_trip(&bench, AT, "amplifier"),
        Trip::Amplifier { code: 31, .. }
    ));
    assert_eq!(bench.returned_programs, 1, "the program is returned unused");
}

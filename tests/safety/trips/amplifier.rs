//! Trips by the amplifier: its faults, its refusals, and invalid currents.
use super::*;

#[test]
fn amplifier_fault_trips_with_the_device_code() {
    let faults = [(AT..AT + 1, Fault::Faulted(0x2310))];
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
    let mut bench = Bench::running(&stage(), &[(AT..AT + 1, Fault::Refuses(-7))], constant());
    assert!(matches!(
        trips(&mut bench, AT, "amplifier"),
        Trip::Amplifier { code: -7, .. }
    ));
    let in_tick: Vec<Told> = bench
        .told()
        .iter()
        .filter(|(tick, _)| *tick == AT)
        .map(|(_, told)| *told)
        .collect();
    assert_eq!(
        in_tick,
        [
            Told::Command {
                current_a: SOME_A,
                refused: true
            },
            Told::Disable
        ]
    );
    assert_eq!(
        bench.ticks().at(AT).requested_a,
        SOME_A,
        "the record says what was asked for"
    );
}

#[test]
fn non_finite_returned_current_switches_the_amplifier_off() {
    for nonsense in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut bench = Bench::running(
            &stage(),
            &[(AT..AT + 1, Fault::Gives(nonsense))],
            constant(),
        );
        nothing_trips(&mut bench, AT - 1);
        bench.run(1 + AFTER);
        // The command went out before the answer came: the record shows zero, the amplifier is disabled in the same tick.
        assert_eq!(bench.ticks().at(AT).command_a.to_bits(), 0);
        assert_eq!((bench.state(), bench.is_on()), (State::Tripped, false));
        assert_eq!((bench.trips().len(), bench.trips()[0].tick), (1, AT));
        let EventKind::Trip(trip) = bench.trips()[0].kind else {
            unreachable!()
        };
        assert_eq!(trip.reason(), "amplifier");
        let told = bench.told();
        assert!(
            !told
                .iter()
                .any(|(tick, told)| *tick > AT && *told != Told::Disable)
        );
        assert_eq!(
            told.iter().rev().find(|(tick, _)| *tick == AT),
            Some(&(AT, Told::Disable))
        );
    }
}

#[test]
fn failed_enable_trips_and_the_program_does_not_start() {
    let mut bench = Bench::still(&stage(), &[(AT..AT + 1, Fault::DoesNotEnable(31))]);
    bench.run(AT);
    bench.order(Request::Arm);
    bench.order(Request::Start(constant()));
    bench.run(1 + AFTER);
    assert!(matches!(
        prove_that_it_is_off(&bench, AT, "amplifier"),
        Trip::Amplifier { code: 31, .. }
    ));
    assert_eq!(bench.handed_back, 1, "the program is handed back unused");
}

//! The CANopen driver with the emulated drive: every fault in every state.
use super::*;

/// A fault and its required effect.
struct Case {
    fault: &'static str,
    /// While the amplifier is in use, the loop trips within this number of ticks, with this code.
    found: (u64, u32),
    /// The current is zero within this number of ticks.
    zero: u64,
    /// Arming is refused with this code if the fault existed before; `None`: a drive that is off does not show the fault.
    armed_into: Option<u32>,
}

const fn case(fault: &'static str, found: (u64, u32), zero: u64, armed_into: Option<u32>) -> Case {
    Case {
        fault,
        found,
        zero,
        armed_into,
    }
}

/// A status frame arrives every 2 ms, and up to a tick passes until the loop reads it.
const STATUS: u64 = 3;
/// No status frame for 20 ms.
const SILENCE: u64 = 22;

/// The table of `hal/README.md` in ticks of a millisecond.
const CASES: [Case; 12] = [
    case(
        "amplifier.silence",
        (SILENCE, STATUS_LOST),
        SILENCE + SWITCH_OFF,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.late=200ms",
        (SILENCE, STATUS_LOST),
        SILENCE + SWITCH_OFF,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.unplugged",
        (SILENCE, STATUS_LOST),
        UNHEARD,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.short-frames",
        (STATUS, MALFORMED),
        STATUS + SWITCH_OFF,
        Some(MALFORMED),
    ),
    case(
        "amplifier.senseless-status",
        (STATUS, MALFORMED),
        STATUS + SWITCH_OFF,
        Some(NOT_REMOTE),
    ),
    case(
        "amplifier.target-ignored",
        (STATUS, TARGET_IGNORED),
        0,
        Some(TARGET_IGNORED),
    ),
    case("amplifier.switches-off", (STATUS, SWITCHED_OFF), 0, None),
    case(
        "amplifier.fault=0x2310",
        (FRAME, EMERGENCY + 0x2310),
        0,
        Some(EMERGENCY + 0x2310),
    ),
    case(
        "amplifier.emergency=0x4210",
        (FRAME, EMERGENCY + 0x4210),
        FRAME + SWITCH_OFF,
        None,
    ),
    case("amplifier.reset", (FRAME, RESTARTED), 0, Some(RESTARTED)),
    case(
        "amplifier.bus-off",
        (FRAME, BUS_OFF),
        UNHEARD,
        Some(BUS_OFF),
    ),
    case(INTERFACE_DOWN, (FRAME, BUS_DOWN), UNHEARD, Some(BUS_DOWN)),
];

#[test]
fn runs_without_fault_complete_without_a_trip() {
    for run in [Run::Chirp, Run::Control] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(run);
        lab.bench.run(1000);
        assert_eq!(lab.bench.trips(), []);
        assert_eq!(lab.bench.state(), State::Running);
        lab.assert_next_run_completes();
    }
}

#[test]
fn every_fault_during_a_run_ends_the_current_in_time_and_the_next_run_completes() {
    for run in [Run::Chirp, Run::Control] {
        for case in &CASES {
            let mut lab = Lab::new();
            lab.run_until_current_flows(run);
            let begin = lab.last_tick();
            lab.begin_fault(case.fault);
            let zero = lab.ticks_with_current(AFTER);
            assert!(
                zero <= case.zero,
                "{}: current for {zero} ticks, {} are allowed",
                case.fault,
                case.zero
            );
            assert!(
                !lab.drive.is_enabled(),
                "{}: {}",
                case.fault,
                lab.drive.state()
            );
            lab.assert_trip_with_code(case.found.1, begin..=begin + case.found.0);
            match run {
                Run::Chirp => lab.assert_next_run_completes(),
                Run::Control => lab.assert_next_program_completes(),
            }
        }
    }
}

#[test]
fn every_fault_while_armed_switches_the_amplifier_off_in_time() {
    for case in &CASES {
        let mut lab = Lab::new();
        lab.arm();
        let begin = lab.last_tick();
        lab.begin_fault(case.fault);
        let off = lab.ticks_enabled(AFTER);
        let allowed = case.zero.max(case.found.0 + SWITCH_OFF);
        assert!(
            off <= allowed,
            "{}: enabled for {off} ticks, {allowed} are allowed",
            case.fault
        );
        lab.assert_trip_with_code(case.found.1, begin..=begin + case.found.0);
        lab.assert_next_run_completes();
    }
}

#[test]
fn every_fault_while_disarmed_gives_no_current_and_prevents_arming() {
    for case in &CASES {
        let mut lab = Lab::new();
        lab.bench.run(50);
        lab.begin_fault(case.fault);
        assert_eq!(lab.ticks_enabled(AFTER), 0, "{}", case.fault);
        assert_eq!(lab.bench.state(), State::Disarmed);
        let begin = lab.last_tick();
        lab.bench.request(Request::Arm);
        lab.bench
            .request(Request::Start(program(&lab.config, Run::Chirp)));
        // The run begins with 50 ms at zero current: the fault is found before a current flows.
        assert_eq!(lab.ticks_with_current(50), 0, "{}", case.fault);
        match case.armed_into {
            Some(code) => {
                // A drive that does not answer is given up after state_timeout, 2 s; then the loop trips in its next tick.
                assert_eq!(lab.ticks_with_current(2050), 0, "{}", case.fault);
                lab.assert_trip_with_code(code, begin..=begin + 2040);
                assert_eq!(
                    lab.ticks_enabled(AFTER),
                    0,
                    "{}: {}",
                    case.fault,
                    lab.drive.state()
                );
            }
            None => assert_eq!(lab.bench.trips(), [], "{}", case.fault),
        }
        lab.assert_next_run_completes();
    }
}

#[test]
fn same_fault_gives_an_identical_run() {
    let run = || {
        let mut lab = Lab::new();
        lab.run_until_current_flows(Run::Control);
        lab.begin_fault("amplifier.silence");
        lab.bench.run(AFTER);
        lab.bench
            .all
            .iter()
            .map(|published| format!("{published:?}"))
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn disobedient_drive_is_stopped_by_nmt_or_by_the_lost_heartbeat() {
    // After 70 ms without confirmation and a repeat of 10 ms: NMT stop; 70 ms later the drive detects the lost heartbeat.
    for (fault, off) in [
        ("amplifier.set-points-ignored", 85),
        ("amplifier.orders-ignored", 175),
    ] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(Run::Chirp);
        lab.begin_fault(fault);
        lab.bench.request(Request::Stop);
        let zero = lab.ticks_with_current(AFTER);
        assert!(
            (60..=off).contains(&zero),
            "{fault}: current for {zero} ticks"
        );
        assert!(!lab.drive.is_enabled());
        lab.bench.request(Request::Arm);
        lab.bench.run(1);
        let at = lab.last_tick();
        lab.assert_trip_with_code(STILL_ENABLED, at..=at);
        lab.assert_next_run_completes();
    }
}

#[test]
fn drive_that_ignores_set_points_trips_on_its_measured_current() {
    for run in [Run::Chirp, Run::Control] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(run);
        lab.inject("amplifier.set-points-ignored");
        let begin = lab.last_tick();
        // The trip occurs within two windows of 50 ms, plus 2 ms of status period, plus the time until commands differ by 0.1 A.
        // NMT then stops the drive (85 ms).
        let flowed = lab.ticks_with_current(1500);
        let (trip, tick) = lab.trip().expect("it trips");
        assert!(
            matches!(trip, Trip::CurrentNotFollowed { .. }),
            "{run:?}: {trip:?}"
        );
        assert!(
            tick - begin <= 1000 && flowed <= tick - begin + 85,
            "{run:?}: {} ticks, {flowed}",
            tick - begin
        );
    }
}

#[test]
fn dropped_loop_leaves_the_drive_without_current() {
    let mut lab = Lab::new();
    lab.run_until_current_flows(Run::Control);
    let Lab {
        bench, drive, host, ..
    } = lab;
    assert!(matches!(bench.all.last(), Some(LoopMessage::Tick(_))));
    drop(bench);
    host.sleep(Duration::from_millis(2));
    assert!(
        drive.current_a() == 0.0 && !drive.is_enabled(),
        "{}",
        drive.state()
    );
}

#[test]
fn hung_service_thread_trips_the_loop_within_20_ms_in_every_state() {
    // The limit is 20 ms, a step of the bus 0.1 ms; one more tick until the loop looks.
    const HUNG: u64 = 22;
    for run in [None, Some(Run::Chirp), Some(Run::Control)] {
        let mut lab = Lab::new();
        match run {
            Some(run) => lab.run_until_current_flows(run),
            None => lab.arm(),
        }
        let begin = lab.last_tick();
        lab.host.set_hung("can-service", true);
        let zero = lab.ticks_with_current(AFTER);
        assert!(zero <= HUNG + SWITCH_OFF, "current for {zero} ticks");
        assert!(!lab.drive.is_enabled(), "{}", lab.drive.state());
        lab.assert_trip_with_code(SERVICE_HUNG, begin + 20..=begin + HUNG);
        lab.host.set_hung("can-service", false);
        lab.assert_next_run_completes();
    }
}

#[test]
fn hung_service_thread_prevents_arming() {
    let mut lab = Lab::new();
    lab.bench.run(50);
    lab.host.set_hung("can-service", true);
    lab.bench.run(50);
    assert_eq!(lab.bench.state(), State::Disarmed);
    lab.bench.request(Request::Arm);
    lab.bench.run(1);
    let at = lab.last_tick();
    lab.assert_trip_with_code(SERVICE_HUNG, at..=at);
    assert!(!lab.drive.is_enabled());
    lab.host.set_hung("can-service", false);
    lab.assert_next_run_completes();
}

//! The VESC driver with the emulated VESC: every fault in every state.
use super::*;

/// A VESC, whose codes are 1: silent, 2: bus-off, 3: interface down. STATUS arrives every 20 ms, and its loss is detected after
/// 100 ms; the VESC itself detects the loss of commands after 500 ms.
const VESC: &str =
    "amplifier.device={ kind = \"vesc\", interface = \"can0\", bit_rate = 500000, node = 23 }";

#[test]
fn every_vesc_fault_ends_the_current_in_time_and_the_next_run_completes() {
    let cases = [
        ("amplifier.silence", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.short-frames", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.late=400ms", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.unplugged", (122, 1), 502),
        ("amplifier.bus-off", (FRAME, 2), 502),
        (INTERFACE_DOWN, (FRAME, 3), 502),
    ];
    for (fault, (found, code), zero) in cases {
        for run in [None, Some(Run::Chirp), Some(Run::Control)] {
            let mut lab = Lab::of(config(&[VESC]));
            match run {
                Some(run) => lab.run_until_current_flows(run),
                None => lab.arm(),
            }
            let begin = lab.last_tick();
            lab.begin_fault(fault);
            let ticks = lab.ticks_with_current(600);
            assert!(
                ticks <= zero,
                "{fault}: current for {ticks} ticks, {zero} are allowed"
            );
            lab.assert_trip_with_code(code, begin..=begin + found);
            lab.end_fault();
            lab.bench.run(200); // delayed frames arrive
            lab.assert_next_run_completes();
        }
    }
}

#[test]
fn hung_thread_of_the_driver_trips_the_loop_within_20_ms() {
    for run in [None, Some(Run::Chirp), Some(Run::Control)] {
        let mut lab = Lab::of(config(&[VESC]));
        match run {
            Some(run) => lab.run_until_current_flows(run),
            None => lab.arm(),
        }
        let begin = lab.last_tick();
        lab.host.set_hung("can-vesc", true);
        let zero = lab.ticks_with_current(100);
        assert!(zero <= 22 + SWITCH_OFF, "current for {zero} ticks");
        lab.assert_trip_with_code(7, begin + 20..=begin + 22);
        lab.host.set_hung("can-vesc", false);
        lab.assert_next_run_completes();
    }
}

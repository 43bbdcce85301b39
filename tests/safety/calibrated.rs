//! The interlocks judge readings and set-points of the devices, whatever a calibration makes of them.
use bench_rig::calibration::{
    AmplifierCalibration, Calibration, ChainCalibration, Correction, ProbeCalibration,
};
use bench_rt::arming::Trip;
use bench_rt::record::EventKind;

use crate::safety::faulty_rig::Fault;
use crate::safety::rig::{AmplifierCall, Bench, endless, stage};

/// Tick in which a reading or a command changes.
const AT: u64 = 100;

const IDENTITY: Correction = Correction {
    current_gain: 1.0,
    current_offset_a: 0.0,
    probe_gain: 1.0,
    probe_offset_m: 0.0,
};

/// The file of a calibration with this correction.
pub fn calibration(correction: &Correction) -> Calibration {
    Calibration {
        made: "2026-01-01T00:00:00Z".into(),
        recording: String::new(),
        amplifier: AmplifierCalibration {
            device: String::new(),
            current_gain: correction.current_gain,
            current_offset_a: correction.current_offset_a,
            measures_current: true,
        },
        probe: ProbeCalibration {
            device: String::new(),
            gain: correction.probe_gain,
            offset_m: correction.probe_offset_m,
            noise_rms_m: 0.0,
        },
        chain: ChainCalibration {
            compliance_m_per_a: 1.0,
            compliance_sigma_m_per_a: 0.0,
            model_m_per_a: 1.0,
            nonlinearity_ratio: 0.0,
            hysteresis_ratio: 0.0,
            delay_s: None,
            delay_sigma_s: None,
        },
    }
}

/// A run at a constant current, with a correction and faults.
fn run(correction: Correction, current_a: f64, faults: &[(std::ops::Range<u64>, Fault)]) -> Bench {
    Bench::running(&stage(), faults, endless(move |_| current_a)).with_correction(correction)
}

/// The first trip and its tick.
fn first_trip(bench: &mut Bench, ticks: u64) -> Option<(Trip, u64)> {
    bench.run(ticks);
    let event = *bench.trips().first()?;
    match event.kind {
        EventKind::Trip(trip) => Some((trip, event.tick)),
        _ => None,
    }
}

fn largest_set_point_a(bench: &Bench) -> f64 {
    let set_points = bench.amplifier_calls().into_iter();
    let set_points = set_points.filter_map(|(_, call)| match call {
        AmplifierCall::Command { current_a, .. } => Some(current_a.abs()),
        AmplifierCall::Enable { .. } | AmplifierCall::Disable => None,
    });
    set_points.fold(0.0, f64::max)
}

#[test]
fn trips_by_the_raw_reading_beyond_the_soft_limit() {
    let limit_m = stage().interlock.soft_limit_m;
    let correction = Correction {
        probe_gain: 0.02,
        ..IDENTITY
    };
    for side in [1.0, -1.0] {
        let reading = |reading_m| [(AT..AT + 1, Fault::Position(side * reading_m))];
        let within = first_trip(&mut run(correction, 0.1, &reading(limit_m)), 2 * AT);
        assert_eq!(within, None);
        let beyond_m = limit_m.next_up();
        let beyond = first_trip(&mut run(correction, 0.1, &reading(beyond_m)), 2 * AT);
        let trip = Trip::Travel {
            position_m: side * beyond_m,
            limit_m,
        };
        assert_eq!(beyond, Some((trip, AT)));
    }
}

#[test]
fn trips_by_the_corrected_position_beyond_the_soft_limit() {
    let limit_m = stage().interlock.soft_limit_m;
    let correction = Correction {
        probe_gain: 1.25,
        probe_offset_m: 20e-6,
        ..IDENTITY
    };
    let reading = |position_m: f64| [(AT..AT + 1, Fault::Position((position_m - 20e-6) / 1.25))];
    let within = first_trip(&mut run(correction, 0.1, &reading(limit_m * 0.999)), 2 * AT);
    assert_eq!(within, None);
    let beyond = first_trip(&mut run(correction, 0.1, &reading(limit_m * 1.001)), 2 * AT);
    let (trip, at) = beyond.expect("a trip");
    assert_eq!((trip.reason(), at), ("travel", AT));
}

#[test]
fn refuses_set_point_beyond_the_peak_current() {
    let peak_a = stage().motor.peak_current_a();
    let correction = Correction {
        current_gain: 0.1,
        ..IDENTITY
    };
    // 9 % of the peak needs a set-point of 90 % of it; 11 % would need 110 %.
    let mut allowed = run(correction, 0.09 * peak_a, &[]);
    assert_eq!(first_trip(&mut allowed, AT), None);
    assert!((largest_set_point_a(&allowed) / peak_a - 0.9).abs() < 1e-9);
    let mut refused = run(correction, 0.11 * peak_a, &[]);
    let (trip, at) = first_trip(&mut refused, AT).expect("a trip");
    assert_eq!((trip.reason(), at), ("peak_current", 0));
    assert_eq!(largest_set_point_a(&refused), 0.0, "no set-point was sent");
}

#[test]
fn heats_the_motor_by_the_larger_of_current_and_set_point() {
    let config = stage();
    let (rated_a, tau_s) = (
        config.motor.continuous_current_a(),
        config.motor.thermal_time_constant_s,
    );
    // In all cases the larger of both is 6 A.
    for (current_gain, current_a) in [(1.0, 6.0), (0.5, 3.0), (2.0, 6.0)] {
        let correction = Correction {
            current_gain,
            ..IDENTITY
        };
        // thermal' = (i^2 - thermal) / tau reaches rated^2 at t = -tau ln(1 - (rated/i)^2).
        let ratio = rated_a / 6.0;
        let warm_s = -tau_s * f64::ln(1.0 - ratio * ratio);
        let warm = warm_s * config.servo.rate_hz;
        let mut bench = run(correction, current_a, &[]);
        let (trip, at) = first_trip(&mut bench, warm as u64 + 100).expect("a trip");
        assert_eq!(trip.reason(), "continuous_current");
        // Euler's steps differ from the closed form by T/(2 tau), here by less than 2 ticks.
        assert!((at as f64 - warm).abs() < 3.0, "{at} instead of {warm}");
    }
}

#[test]
fn trips_when_the_accepted_set_point_differs_from_the_one_sent() {
    let limit_a = stage().interlock.current_error_a;
    for side in [1.0, -1.0] {
        let returned = |error_a: f64| {
            let returned_a = 0.5 + side * error_a;
            [(AT..AT + 1, Fault::ReturnedCurrent(returned_a))]
        };
        let near = first_trip(&mut run(IDENTITY, 0.5, &returned(0.99 * limit_a)), 2 * AT);
        assert_eq!(near, None);
        let mut bench = run(IDENTITY, 0.5, &returned(1.01 * limit_a));
        let (trip, at) = first_trip(&mut bench, 2 * AT).expect("a trip");
        assert_eq!((trip.reason(), at), ("set_point_not_accepted", AT));
        assert!(!bench.amplifier_is_on());
    }
}

#[test]
fn allows_the_amplifier_to_limit_size_and_slope() {
    let mut config = stage();
    config.amplifier.current_limit_a = 1.0;
    let jump = |tick: u64| if tick < AT { 0.2 } else { 2.0 };
    // At tick 100 the set-point jumps from 0.2 A to 2 A. The amplifier reaches half, then all of its limit of 1 A.
    let faults = [
        (AT..AT + 1, Fault::ReturnedCurrent(0.6)),
        (AT + 1..3 * AT, Fault::ReturnedCurrent(1.0)),
    ];
    let mut bench = Bench::running(&config, &faults, endless(jump));
    assert_eq!(first_trip(&mut bench, 2 * AT), None);
    assert_eq!(bench.tick().command_a, 1.0);
}

#[test]
fn trips_when_the_amplifier_reports_itself_disabled() {
    let mut bench = run(IDENTITY, 0.1, &[(AT..AT + 1, Fault::ReportsDisabled)]);
    let trip = first_trip(&mut bench, 2 * AT);
    assert_eq!(trip, Some((Trip::AmplifierDisabled, AT)));
    assert!(!bench.amplifier_is_on());
}

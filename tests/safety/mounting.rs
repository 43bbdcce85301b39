//! The gain of the mounting is applied in the driver: the travel is judged in the metres of the stage and of the probe.
use bench_config::{Config, Source, load};
use bench_experiment::{Plan, run};
use bench_hal::{Reading, Tick, Validity};
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::Trip;
use bench_rt::thread::Pace;

use crate::safety::rig::{interlocks, stage};

/// The first check of a reading at `position_m`, behind a mounting with this gain.
fn checked(position_m: f64, gain: f64) -> Result<(), Trip> {
    let reading = Reading {
        position_m,
        sequence: 1,
        age_ns: 0,
        validity: Validity::Valid,
    };
    interlocks(&stage())
        .with_mounting_gain(gain)
        .check_reading(&reading, Tick::default())
}

#[test]
fn the_stricter_of_position_and_raw_travel_decides() {
    let limit_m = stage().interlock.soft_limit_m;
    for gain in [0.02_f64, 0.75, 1.0, 1.25, 50.0, -0.02, -1.0, -50.0] {
        let permitted_m = limit_m * gain.abs().min(1.0);
        for side in [1.0, -1.0] {
            assert_eq!(checked(0.999 * side * permitted_m, gain), Ok(()), "{gain}");
            let trip = checked(1.001 * side * permitted_m, gain);
            assert!(
                matches!(trip, Err(Trip::Travel { limit_m: limit, .. }) if limit == limit_m),
                "{gain}: {trip:?}"
            );
        }
    }
}

#[test]
fn raw_travel_of_a_gain_that_is_not_a_number_trips() {
    for gain in [0.0, f64::NAN] {
        assert_eq!(checked(0.0, gain), Err(Trip::ProbeInvalid), "{gain}");
    }
}

/// The profile `lab` with a mounting of this gain, and a sine sweep at 2 Hz to 4 Hz with 0.4 A: by the static compliance of
/// 154 um/A the stage moves by 62 um, with 2 % more at 4 Hz. The limit is 100 um.
fn swept(gain: f64) -> Config {
    let offset = format!("probe.device.mounting.offset_m={}", -0.001 * gain);
    let gain = format!("probe.device.mounting.gain={gain}");
    let sets = [
        gain.as_str(),
        offset.as_str(),
        "calibration.accepted_by=A. Smith",
        "interlock.soft_limit_m=100um",
        "chirp.start_hz=2",
        "chirp.stop_hz=4",
        "chirp.duration_s=3",
        "chirp.fade_in_s=1",
        "chirp.amplitude=[{ frequency_hz = 1.0, current_a = 0.4 }]",
    ];
    load(&Source {
        config: Some("lab".into()),
        sets: sets.iter().map(|set| set.to_string()).collect(),
        ..Source::default()
    })
    .expect("accepted")
}

/// The simulated probe gives positions of the stage, as a driver does behind its mounting.
fn trip_of(config: Config) -> Option<Trip> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = SimulatedRig::new(&config).expect("a rig");
    let plan = Plan::chirp(config);
    let ended = run(
        &plan,
        Box::new(rig),
        Pace::Virtual,
        folder.path(),
        &mut |_, _| {},
    );
    ended.expect("a run").end.servo.trip.map(|(trip, _)| trip)
}

#[test]
fn run_trips_by_the_raw_travel_of_its_mounting() {
    // 62 um of the stage are 124 um of the probe.
    let trip = trip_of(swept(0.5));
    assert!(
        matches!(trip, Some(Trip::Travel { position_m, limit_m })
            if position_m.abs() > 100e-6 && position_m.abs() < 110e-6 && (limit_m - 100e-6).abs() < 1e-12),
        "{trip:?}"
    );
    // 62 um of the stage are 77.5 um, and 31 um, of the probe.
    for gain in [0.8, 2.0] {
        assert_eq!(trip_of(swept(gain)), None, "{gain}");
    }
}

/// A plan predicts the travel that trips: 0.5 of the limit of 100 um.
#[test]
fn plan_counts_the_raw_travel() {
    assert!((swept(0.5).excitation_limits().travel_m - 50e-6).abs() < 1e-12);
    assert!((swept(2.0).excitation_limits().travel_m - 100e-6).abs() < 1e-12);
}

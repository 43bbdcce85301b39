//! Replay: the loop makes the same decisions from its recording, bit for bit, and alterations are found.
use std::ops::Range;
use std::path::{Path, PathBuf};

use bench_config::{
    AmplitudePoint, Config, DampingPoint, DampingSettings, PlantSettings, ReferenceSettings, Sweep,
    whole,
};
use bench_excitation::{SineReference, StepReference};
use bench_experiment::{
    Plan, ReadSignals, ReplayError, Replayed, RunKind, analyse, never_cancels, replay,
};
use bench_hal::Validity;
use bench_recording::{Header, Recorder, Recording};
use bench_rig::calibration::Correction;
use bench_rig::simulated::SimulatedRig;
use bench_rt::arming::State;
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord, flag};
use bench_rt::servo::Request;
use bench_rt::thread::Pace;

use crate::safety::calibrated::calibration;
use crate::safety::faulty_rig::{Fault, FaultyRig};
use crate::safety::rig::{Bench, stage};

fn short_chirp(sweep: Sweep) -> Plan {
    let mut config: Config = stage();
    (
        config.chirp.sweep,
        config.chirp.duration_s,
        config.chirp.fade_in_s,
    ) = (sweep, 1.0, 0.2);
    (config.chirp.quiet_before_s, config.chirp.quiet_after_s) = (0.1, 0.1);
    config.chirp.amplitude = vec![AmplitudePoint {
        frequency_hz: 1.0,
        current_a: 0.2,
    }];
    Plan::chirp(config)
}

fn control(controller: &str) -> Plan {
    let mut config = stage();
    config.control.controller = controller.into();
    config.control.duration_s = 1.0;
    Plan::control(config).expect("a plan")
}

fn record(plan: &Plan, faults: &[(Range<u64>, Fault)], folder: &Path) -> PathBuf {
    let rig = SimulatedRig::new(&plan.config).expect("a rig");
    let rig = Box::new(FaultyRig::new(rig, faults));
    let run =
        bench_experiment::run(plan, rig, Pace::Virtual, folder, &mut |_, _| {}).expect("a run");
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    path
}

fn replayed(path: &Path) -> Replayed {
    replay(&Recording::open(path).expect("a recording")).expect("it can be replayed")
}

fn assert_identical(path: &Path, what: &str) {
    let recording = Recording::open(path).expect("a recording");
    let replayed = replayed(path);
    assert_eq!((replayed.different, replayed.first), (0, None), "{what}");
    assert_eq!(
        replayed.ticks,
        recording.tick_count(),
        "{what}: every tick is compared"
    );
}

#[test]
fn chirps_and_closed_loops_replay_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut hold = control("fast");
    hold.config.control.reference = ReferenceSettings::Sine(SineReference {
        amplitude_m: 20e-6,
        frequency_hz: 3.0,
    });
    let plans = [
        short_chirp(Sweep::Linear),
        short_chirp(Sweep::Logarithmic),
        control("fast"),
        control("slow"),
        hold,
    ];
    for plan in plans {
        let path = record(&plan, &[], folder.path());
        let recording = Recording::open(&path).expect("a recording");
        let moving = recording
            .ticks()
            .expect("readable")
            .filter(|r| r.as_ref().is_ok_and(|r| r.command_a != 0.0))
            .count();
        assert!(moving > 4000, "only {moving} non-zero commands to compare");
        assert_identical(&path, plan.kind.name());
    }
}

/// The damping of the profile, 0.009 at 179 rad/s, with another second measurement.
fn set_second_damping(config: &mut Config, omega_rad_s: f64, ratio: f64) {
    let PlantSettings::Sr4dof(settings) = &mut config.plant else {
        panic!("the profile is an SR4DoF")
    };
    let first = DampingPoint {
        omega_rad_s: 179.0,
        ratio: 0.009,
    };
    let second = DampingPoint { omega_rad_s, ratio };
    settings.damping = DampingSettings::Measured { first, second };
}

/// Below 0.009 x 179/520 = 0.0031 the coefficient of the stiffness is negative. Earlier versions recorded such runs; a new run is
/// refused (tests/config_settings/rejected.rs).
#[test]
fn recording_with_refused_damping_is_read_replayed_and_identified() {
    let mut plan = short_chirp(Sweep::Linear);
    set_second_damping(&mut plan.config, 520.0, 0.003);
    plan.config.chirp.duration_s = 10.0;
    (plan.config.chirp.start_hz, plan.config.chirp.stop_hz) = (5.0, 100.0);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = record(&plan, &[], folder.path());
    assert_identical(&path, "negative damping");
    let recording = Recording::open(&path).expect("a recording");
    let read = Plan::of(&recording).expect("a plan");
    assert_eq!(read.config.plant, plan.config.plant);
    let analysis = analyse(
        &recording,
        ReadSignals::default(),
        &read.config,
        &mut never_cancels,
    )
    .expect("an analysis");
    assert!(analysis.frf.len() > 100, "{}", analysis.frf.len());
}

/// Two ratios at one frequency.
#[test]
fn recorded_configuration_with_undetermined_damping_is_read() {
    let mut plan = short_chirp(Sweep::Linear);
    set_second_damping(&mut plan.config, 179.0, 0.004);
    let text = plan.config_toml().expect("TOML");
    let read = whole("a recording", &text).expect("a configuration");
    assert_eq!(read.plant, plan.config.plant);
}

#[test]
fn calibrated_runs_replay_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The position -0.9 reading is within the limit of 0.9 mm; the reading of 0.95 mm itself is not.
    let beyond = [(4000..4001, Fault::Position(0.00095))];
    let cases: [(&[_], Option<u64>); 2] = [(&[], None), (&beyond, Some(4000))];
    for (faults, tripped_at) in cases {
        let mut plan = short_chirp(Sweep::Linear);
        plan.calibration = Some(calibration(&Correction {
            current_gain: 0.93,
            current_offset_a: 0.004,
            probe_gain: -0.9,
            probe_offset_m: 13e-6,
        }));
        let path = record(&plan, faults, folder.path());
        let recording = Recording::open(&path).expect("a recording");
        let trips = recording.events().iter();
        let trips = trips.filter(|event| matches!(event.kind, EventKind::Trip(_)));
        assert_eq!(trips.map(|event| event.tick).next(), tripped_at);
        for record in recording.ticks().expect("readable") {
            let record = record.expect("readable");
            let raw_m = record.raw_position_m.expect("the reading is recorded");
            assert!((record.position_m - (13e-6 - 0.9 * raw_m)).abs() < 1e-18);
        }
        assert_identical(&path, "calibrated");
    }
}

#[test]
fn tripped_runs_replay_bit_for_bit() {
    const AT: u64 = 4000;
    let once = |fault| [(AT..AT + 1, fault)];
    let lasting = |fault| [(AT..AT + 2000, fault)];
    let cases = [
        (once(Fault::Position(0.00095)), AT, "travel"),
        (once(Fault::Position(f64::NAN)), AT, "probe_invalid"),
        (once(Fault::Validity(Validity::Faulty)), AT, "probe_invalid"),
        (once(Fault::Age(1_000_001)), AT, "probe_stale"),
        (lasting(Fault::RepeatedSample), AT + 5, "probe_stale"),
        (once(Fault::AmplifierFault(77)), AT, "amplifier"),
        (once(Fault::RefusedCommand(78)), AT, "amplifier"),
        (once(Fault::ReturnedCurrent(f64::NAN)), AT, "amplifier"),
        (
            once(Fault::ReturnedCurrent(9.0)),
            AT,
            "set_point_not_accepted",
        ),
        (once(Fault::ReportsDisabled), AT, "amplifier_disabled"),
        ([(0..1, Fault::RefusedEnable(79))], 0, "amplifier"),
    ];
    for (faults, at, reason) in cases {
        for plan in [control("fast"), short_chirp(Sweep::Linear)] {
            let folder = tempfile::tempdir().expect("a temporary folder");
            let path = record(&plan, &faults, folder.path());
            let recording = Recording::open(&path).expect("a recording");
            let trip = recording.events().iter().find_map(|e| match e.kind {
                EventKind::Trip(trip) => Some((trip.reason(), e.tick)),
                EventKind::Request(_)
                | EventKind::State { .. }
                | EventKind::Completed
                | EventKind::ResetFailed { .. }
                | EventKind::Override
                | EventKind::Clock(_)
                | EventKind::Lost { .. } => None,
            });
            assert_eq!(trip, Some((reason, at)));
            // The loop continues for 0.1 s after a trip.
            assert!(
                (at + 499..=at + 502).contains(&recording.last_tick()),
                "{}",
                recording.last_tick()
            );
            assert_identical(&path, &format!("{reason} in {}", plan.kind.name()));
        }
    }
}

#[test]
fn peak_current_trip_by_the_controller_replays_bit_for_bit() {
    // A step of 500 um through a controller of 0.1 A/um asks for 50 A.
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("stiff.toml");
    let text = "title = \"too stiff\"\n[[section]]\nkind = \"gain\"\ngain_a_per_um = 0.1\n";
    std::fs::write(&file, text).expect("a file");
    let mut config = stage();
    config.control.controller = file.display().to_string();
    config.control.reference = ReferenceSettings::Step(StepReference {
        amplitude_m: 500e-6,
        at_s: 0.01,
    });
    let path = record(&Plan::control(config).expect("a plan"), &[], folder.path());
    // The recording contains the controller, so its file is not needed.
    std::fs::remove_file(file).expect("the file exists");
    let recording = Recording::open(&path).expect("a recording");
    assert!(
        recording
            .events()
            .iter()
            .any(|e| matches!(e.kind, EventKind::Trip(t) if t.reason() == "peak_current"))
    );
    assert_identical(&path, "peak current");
}

#[test]
fn enabling_replays_bit_for_bit() {
    let pending = (0..120, Fault::PendingEnable);
    let cases = [
        (vec![], None),
        (vec![pending.clone()], None),
        (
            vec![(70..71, Fault::FailedEnable(7)), pending.clone()],
            Some(70),
        ),
        (
            vec![(70..71, Fault::AmplifierFault(7)), pending.clone()],
            Some(70),
        ),
        (vec![(70..71, Fault::Position(0.00095)), pending], Some(70)),
        (vec![(20..21, Fault::Age(1_000_001))], Some(20)),
    ];
    for (faults, tripped_at) in cases {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut plan = short_chirp(Sweep::Linear);
        plan.config.servo.healthy_s = Some(0.01); // 50 ticks
        let path = record(&plan, &faults, folder.path());
        let recording = Recording::open(&path).expect("a recording");
        let trips = recording.events().iter();
        let trips = trips.filter(|event| matches!(event.kind, EventKind::Trip(_)));
        assert_eq!(trips.map(|event| event.tick).next(), tripped_at);
        let states: Vec<_> = recording.ticks().expect("readable").collect();
        let enabling = states
            .iter()
            .flatten()
            .filter(|r| r.state == State::Enabling);
        assert!(enabling.count() >= 20);
        assert_identical(&path, &format!("{faults:?}"));
    }
}

/// Recordings of earlier versions have no state Enabling.
#[test]
fn recordings_without_the_state_enabling_replay_bit_for_bit() {
    let cases = [
        vec![],
        vec![(0..1, Fault::RefusedEnable(79))],
        vec![(4000..4001, Fault::Position(0.00095))],
    ];
    for faults in cases {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = record(&control("fast"), &faults, folder.path());
        let old = folder.path().join("old.mcap");
        copy(
            &path,
            &old,
            |_| {},
            |event| match event.kind {
                EventKind::State {
                    from: State::Disarmed,
                    to: State::Enabling,
                } if faults == [(0..1, Fault::RefusedEnable(79))] => Some(Event {
                    kind: EventKind::State {
                        from: State::Disarmed,
                        to: State::Armed,
                    },
                    ..event
                }),
                EventKind::State {
                    to: State::Enabling,
                    ..
                } => None,
                EventKind::State {
                    from: State::Enabling,
                    to,
                } => {
                    let from = if to == State::Armed {
                        State::Disarmed
                    } else {
                        State::Armed
                    };
                    Some(Event {
                        kind: EventKind::State { from, to },
                        ..event
                    })
                }
                _ => Some(event),
            },
        );
        assert_identical(&old, &format!("{faults:?}"));
    }
}

/// Copies a recording and applies `alter` to its ticks.
fn copy_altered(path: &Path, to: &Path, alter: impl Fn(&mut TickRecord)) {
    copy(path, to, alter, Some);
}

/// Copies a recording and applies `alter` to its ticks and `convert` to its events.
fn copy(
    path: &Path,
    to: &Path,
    alter: impl Fn(&mut TickRecord),
    convert: impl Fn(Event) -> Option<Event>,
) {
    let old = Recording::open(path).expect("a recording");
    let header = Header {
        config_toml: old.config_toml().expect("a configuration").into(),
        period_s: old.period_s().expect("a period"),
        started_ns: 0,
        metadata: old.metadata().clone(),
    };
    let mut new = Recorder::create(to, &header).expect("a new file");
    for attachment in old.attachments().iter().filter(|a| a.name != "config.toml") {
        new.attach(&attachment.name, &attachment.media_type, &attachment.data)
            .expect("a good disk");
    }
    let mut events = old.events().iter().peekable();
    for record in old.ticks().expect("readable") {
        let mut record = record.expect("readable");
        while let Some(event) = events.next_if(|event| event.tick <= record.tick) {
            if let Some(event) = convert(*event) {
                new.record(&LoopMessage::Event(event)).expect("a good disk");
            }
        }
        alter(&mut record);
        new.record(&LoopMessage::Tick(record)).expect("a good disk");
    }
    new.finish(&[]).expect("a good disk");
}

#[test]
fn one_altered_bit_of_a_reading_is_found_at_its_tick() {
    // A change of the reading by d changes the command of the same tick by b d, where b is the product of the first coefficients
    // of the sections. Bit 24 of a reading near 30 um is 30e-6 2^-28 = 1e-13 m. Fast controller: b = 460 A/m (K T/2 = 5.1, pole
    // 9e-5, the others near one), so 5e-11 A. Slow controller: b = 0.12e6 T/2 (w T/2)^2 = 1e-3 A/m, so 1e-16 A. This is near the
    // resolution of a command of 0.1 A (1.4e-17 A), so bit 40 is altered for the slow controller.
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (controller, bit) in [("fast", 24), ("slow", 40)] {
        let path = record(&control(controller), &[], folder.path());
        let at = 5000;
        let original = Recording::open(&path).expect("a recording");
        let recorded = original
            .ticks()
            .expect("readable")
            .nth(at as usize)
            .expect("5000 ticks")
            .expect("readable");
        assert!(
            recorded.flags & flag::ACTIVE != 0 && recorded.position_m.abs() > 1e-6,
            "{recorded:?}"
        );

        let same = folder.path().join(format!("{controller}_same.mcap"));
        copy_altered(&path, &same, |_| {});
        assert_identical(&same, "copied without alteration");

        let altered = folder.path().join(format!("{controller}_altered.mcap"));
        copy_altered(&path, &altered, |record| {
            if record.tick == at {
                record.position_m = f64::from_bits(record.position_m.to_bits() ^ (1 << bit));
            }
        });
        let found = replayed(&altered);
        let first = found.first.expect("a difference");
        assert_eq!(
            (first.tick, first.recorded_a.to_bits()),
            (at, recorded.command_a.to_bits()),
            "{controller}"
        );
        assert!(first.replayed_a.to_bits() != recorded.command_a.to_bits() && found.different >= 1);
    }
}

#[test]
fn altered_command_request_flag_or_reference_is_found_at_its_tick() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = record(&short_chirp(Sweep::Logarithmic), &[], folder.path());
    let alterations: [fn(&mut TickRecord); 4] = [
        |r| r.command_a = r.command_a.next_up(),
        |r| r.requested_a = r.requested_a.next_up(),
        |r| r.flags ^= flag::ACTIVE,
        |r| r.reference_m = -0.0,
    ];
    for (n, alter) in alterations.into_iter().enumerate() {
        let altered = folder.path().join(format!("altered_{n}.mcap"));
        copy_altered(&path, &altered, |record| {
            if record.tick == 3000 {
                alter(record);
            }
        });
        let found = replayed(&altered);
        assert_eq!(
            (found.first.map(|d| d.tick), found.different),
            (Some(3000), 1),
            "alteration {n}"
        );
    }
}

#[test]
fn refused_and_accepted_clear_requests_replay_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plan = control("fast");
    let faults = [
        (100..101, Fault::AmplifierFault(77)),
        (0..200, Fault::RefusedClear),
    ];
    let mut bench = Bench::running(&plan.config, &faults, plan.program().expect("a program"));
    bench.run(150);
    bench.request(Request::Clear);
    bench.run(100);
    bench.request(Request::Clear);
    bench.run(100);
    let metadata = [("run".to_string(), plan.kind.name().to_string())].into();
    let header = Header {
        config_toml: plan.config_toml().expect("a configuration"),
        metadata,
        ..Header::default()
    };
    let path = folder.path().join("cleared.mcap");
    let mut recorder = Recorder::create(&path, &header).expect("a new file");
    for (name, kind, text) in plan.attachments().expect("texts") {
        recorder
            .attach(name, kind, text.as_bytes())
            .expect("a good disk");
    }
    bench
        .all
        .iter()
        .for_each(|published| recorder.record(published).expect("a good disk"));
    recorder.finish(&[]).expect("a good disk");
    assert_identical(&path, "two clears, the first one refused");
}

#[test]
fn truncated_recording_replays_up_to_its_end() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = record(&control("fast"), &[], folder.path());
    let bytes = std::fs::read(&path).expect("just written");
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() / 2]).expect("a good disk");
    let recording = Recording::open(&cut).expect("readable up to the cut");
    assert!(recording.truncated() && recording.tick_count() >= 2500);
    assert_identical(&cut, "cut in the middle");
}

#[test]
fn recordings_that_cannot_be_replayed_name_the_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let write = |name: &str, header: &Header, ticks: &[TickRecord]| {
        let path = folder.path().join(name);
        let mut recorder = Recorder::create(&path, header).expect("a new file");
        ticks.iter().for_each(|t| {
            recorder
                .record(&LoopMessage::Tick(*t))
                .expect("a good disk")
        });
        recorder.finish(&[]).expect("a good disk");
        replay(&Recording::open(&path).expect("a recording"))
            .expect_err("it cannot be replayed")
            .to_string()
    };
    let tick = |tick| TickRecord {
        tick,
        scheduled_ns: tick * 200_000,
        ..TickRecord::default()
    };
    let ticks = [tick(0), tick(1)];
    let plan = control("fast");
    let whole = plan.config_toml().expect("a configuration");
    let kind = |kind: &str| [("run".to_string(), kind.to_string())].into();

    let other_configuration = write(
        "other_configuration.mcap",
        &Header {
            config_toml: "a = 1\n".into(),
            ..Header::default()
        },
        &ticks,
    );
    assert!(
        other_configuration.contains("configuration"),
        "{other_configuration}"
    );
    let text = write(
        "text.mcap",
        &Header {
            config_toml: "not toml".into(),
            ..Header::default()
        },
        &ticks,
    );
    assert!(text.contains("configuration"), "{text}");
    let header = Header {
        config_toml: whole.clone(),
        ..Header::default()
    };
    let without_kind = write("without_kind.mcap", &header, &ticks);
    assert!(
        without_kind.contains("kind of run") && without_kind.contains("bench chirp"),
        "{without_kind}"
    );
    let header = Header {
        metadata: kind(RunKind::Control.name()),
        ..header
    };
    let without_controller = write("without_controller.mcap", &header, &ticks);
    assert!(
        without_controller.contains("controller"),
        "{without_controller}"
    );
    let lost = write("lost.mcap", &header, &[tick(0), tick(5)]);
    assert!(
        lost.contains("4 records") && lost.contains("tick 0"),
        "{lost}"
    );
}

#[test]
fn recording_with_decreasing_times_replays_without_panic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = record(&control("fast"), &[], folder.path());
    let backwards = folder.path().join("backwards.mcap");
    copy_altered(&path, &backwards, |record| {
        record.scheduled_ns = 1_000_000_000_000 - record.scheduled_ns
    });
    let outcome: Result<Replayed, ReplayError> =
        replay(&Recording::open(&backwards).expect("a recording"));
    assert!(outcome.is_ok(), "{outcome:?}");
}

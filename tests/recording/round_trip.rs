//! Recorded data are read back unchanged; missing data are counted.
use std::path::PathBuf;

use bench_hal::Validity;
use bench_recording::{Gap, Recorder, Recording, RecordingError, recover};
use bench_rt::arming::{State, Trip};
use bench_rt::record::{
    ClockTimes, Event, EventKind, LoopMessage, Origin, Refusal, RequestEvent, RequestKind,
    TickRecord,
};
use bench_rt::tuning::{Factors, Tune};

use crate::recording::common::{
    CONFIG, PERIOD_NS, STARTED_NS, bits, events_of, header, run, tick, ticks_of, write,
};

fn fresh() -> (tempfile::TempDir, PathBuf) {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("run.mcap");
    (dir, path)
}

fn read_back(published: &[LoopMessage]) -> (Recording, Vec<TickRecord>) {
    let (_dir, path) = fresh();
    write(&path, published);
    let recording = Recording::open(&path).expect("complete");
    let ticks = recording
        .ticks()
        .expect("complete")
        .collect::<Result<_, _>>()
        .expect("complete");
    (recording, ticks)
}

#[test]
fn tick_fields_round_trip_bit_for_bit() {
    let nan_with_payload = f64::from_bits(0x7ff8_0000_dead_beef);
    let doubles = [
        0.0,
        -0.0,
        f64::MIN_POSITIVE / 8.0,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        nan_with_payload,
    ];
    let validities = [
        Validity::Valid,
        Validity::OutOfRange,
        Validity::Faulty,
        Validity::Missing,
    ];
    let states = [
        State::Disarmed,
        State::Armed,
        State::Running,
        State::Tripped,
    ];
    let odd = |n: usize| TickRecord {
        tick: n as u64,
        scheduled_ns: u64::MAX - 100 + n as u64,
        woke_ns: u64::MAX,
        done_ns: 0,
        reference_m: doubles[n % 7],
        position_m: doubles[(n + 1) % 7],
        requested_a: doubles[(n + 2) % 7],
        command_a: doubles[(n + 3) % 7],
        probe_sequence: u64::MAX - n as u64,
        probe_age_ns: 1 << n,
        validity: validities[n % 4],
        state: states[n / 4 % 4],
        flags: u32::MAX >> n,
        missed_ticks: 0,
        raw_position_m: n.is_multiple_of(3).then_some(doubles[(n + 5) % 7]),
        raw_command_a: n.is_multiple_of(3).then_some(doubles[(n + 6) % 7]),
        actual_a: n.is_multiple_of(2).then_some(doubles[(n + 4) % 7]),
    };
    let put: Vec<_> = (0..28).map(odd).collect();
    let (_, got) = read_back(
        &put.iter()
            .map(|t| LoopMessage::Tick(*t))
            .collect::<Vec<_>>(),
    );
    assert_eq!(
        got.iter().map(bits).collect::<Vec<_>>(),
        put.iter().map(bits).collect::<Vec<_>>()
    );
}

#[test]
fn events_of_every_kind_round_trip_in_order() {
    let trips = [
        Trip::Travel {
            position_m: -4.1e-3,
            limit_m: 4e-3,
        },
        Trip::PeakCurrent {
            command_a: -0.0,
            limit_a: 3.0,
        },
        Trip::ContinuousCurrent {
            thermal_a: 1.1,
            limit_a: 1.0,
        },
        Trip::CommandNotFinite,
        Trip::ProbeInvalid,
        Trip::ProbeStale {
            age_s: 0.1 + 0.2,
            limit_s: 0.01,
        },
        Trip::ProbeStuck {
            unchanged_s: 0.05,
            limit_s: 0.04,
        },
        Trip::Overruns {
            count: u32::MAX,
            limit: 10,
        },
        Trip::ModelError {
            error_m: -0.0,
            modelled_m: 0.1 + 0.2,
            limit_m: 1e-5,
        },
        Trip::CurrentNotFollowed {
            actual_a: -0.75,
            command_a: 0.25,
        },
        Trip::SetPointNotAccepted {
            accepted_a: 9.0,
            expected_a: -0.5,
        },
        Trip::AmplifierDisabled,
        Trip::Amplifier {
            code: i64::MIN,
            text: None,
        },
    ];
    let states = [
        State::Disarmed,
        State::Armed,
        State::Running,
        State::Tripped,
    ];
    let factors = Factors {
        reference: -0.1,
        gain: 1.0 / 3.0,
    };
    let orders = [
        RequestKind::Arm,
        RequestKind::Start,
        RequestKind::Finish,
        RequestKind::Stop,
        RequestKind::Clear,
        RequestKind::Tune(Tune::new(factors, 500).expect("within the limits")),
    ];
    let refusals = [
        None,
        Some(Refusal::NotDisarmed),
        Some(Refusal::NotArmed),
        Some(Refusal::NoRun),
        Some(Refusal::NoTrip),
        Some(Refusal::Tripped),
        Some(Refusal::NotTunable),
    ];
    let origins = [Origin::Supervisor, Origin::Signal, Origin::Lease];
    let answers = orders.iter().flat_map(|&kind| {
        refusals
            .iter()
            .zip(origins.iter().cycle())
            .map(move |(refusal, origin)| RequestEvent {
                id: u64::MAX,
                origin: *origin,
                kind,
                refusal: *refusal,
            })
    });
    let mut kinds: Vec<_> = answers.map(EventKind::Request).collect();
    kinds.extend(
        states
            .iter()
            .flat_map(|from| states.map(|to| EventKind::State { from: *from, to })),
    );
    kinds.extend(trips.map(EventKind::Trip));
    kinds.push(EventKind::ResetFailed {
        code: i64::MIN,
        text: None,
    });
    kinds.extend([EventKind::Completed, EventKind::Lost { records: u64::MAX }]);
    kinds.push(EventKind::Clock(ClockTimes {
        loop_ns: u64::MAX,
        monotonic_ns: 1,
        wall_ns: STARTED_NS,
    }));
    let put: Vec<_> = (0..)
        .zip(kinds)
        .map(|(tick, kind)| Event { tick, kind })
        .collect();
    let mut published: Vec<_> = put.iter().map(|e| LoopMessage::Event(*e)).collect();
    published.insert(3, LoopMessage::Tick(tick(0)));
    let (recording, _) = read_back(&published);
    assert_eq!(recording.events(), put);
    // Compare Debug texts, because -0.0 == 0.0.
    assert_eq!(format!("{:?}", recording.events()), format!("{put:?}"));
}

#[test]
fn file_contains_configuration_metadata_and_results() {
    let (recording, ticks) = read_back(&run(10));
    assert_eq!(recording.config_toml(), Some(CONFIG));
    assert_eq!(recording.metadata()["host"], "test");
    assert_eq!(recording.period_ns(), Some(PERIOD_NS));
    let result = recording.attachment("result.json").expect("attached");
    assert_eq!(
        (result.media_type.as_str(), &result.data[..2]),
        ("application/json", &b"{\""[..])
    );
    assert_eq!(
        (
            recording.tick_count(),
            recording.first_tick(),
            recording.last_tick()
        ),
        (10, 0, 9)
    );
    assert_eq!((ticks.len(), recording.truncated()), (10, false));
}

#[test]
fn existing_file_is_not_overwritten() {
    let (_dir, path) = fresh();
    write(&path, &run(10));
    let before = std::fs::read(&path).expect("just written");
    let refused = Recorder::create(&path, &header()).err().expect("refused");
    assert!(
        matches!(refused, RecordingError::Exists { .. }),
        "{refused}"
    );
    assert!(
        refused
            .to_string()
            .contains("never overwritten; choose another name"),
        "{refused}"
    );
    assert_eq!(std::fs::read(&path).expect("still there"), before);
}

#[test]
fn equal_runs_give_equal_bytes_and_one_bit_changes_the_digest() {
    let (dir, path) = fresh();
    let published = run(12_000);
    let (one, two) = (
        write(&path, &published),
        write(&dir.path().join("two.mcap"), &published),
    );
    assert_eq!(
        std::fs::read(&one.path).expect("written"),
        std::fs::read(&two.path).expect("written")
    );
    assert_eq!(one.loop_digest, two.loop_digest);
    assert_eq!(
        Recording::open(&path).expect("complete").loop_digest(),
        one.loop_digest
    );

    let mut other = published;
    let Some(LoopMessage::Tick(t)) = other.get_mut(6000) else {
        panic!("a tick")
    };
    t.command_a = f64::from_bits(t.command_a.to_bits() ^ 1);
    assert_ne!(
        write(&dir.path().join("other.mcap"), &other).loop_digest,
        one.loop_digest
    );
}

#[test]
fn missing_ticks_count_as_overruns_if_flagged_and_as_lost_otherwise() {
    let overrun = TickRecord {
        missed_ticks: 2,
        ..tick(13)
    }; // 11 and 12 are missed ticks
    let mut published: Vec<_> = (0..=10)
        .map(tick)
        .chain([overrun])
        .map(LoopMessage::Tick)
        .collect();
    published.extend((20..25).map(tick).map(LoopMessage::Tick)); // 14..=19 are lost: six ticks without a flag
    let (_dir, path) = fresh();
    let totals = write(&path, &published);
    assert_eq!(
        (totals.ticks, totals.overruns, totals.lost_records),
        (17, 2, 6)
    );
    assert_eq!((totals.first_tick, totals.last_tick), (Some(0), Some(24)));

    let recording = Recording::open(&path).expect("complete");
    assert_eq!((recording.overruns(), recording.lost_records()), (2, 6));
    let expected = [
        Gap {
            after_tick: 10,
            before_tick: 13,
            missed: 2,
            lost: 0,
        },
        Gap {
            after_tick: 13,
            before_tick: 20,
            missed: 0,
            lost: 6,
        },
    ];
    assert_eq!(recording.gaps(), expected);
}

#[test]
fn timing_is_summarised_per_second_and_per_run() {
    // Lateness 1..=5000 ns in the first second, ten times that in the second; compute 700 ns throughout.
    let late = |n: u64| {
        let woke_ns = n * PERIOD_NS + (n % 5000 + 1) * if n < 5000 { 1 } else { 10 };
        TickRecord {
            woke_ns,
            done_ns: woke_ns + 700,
            ..tick(n)
        }
    };
    let published: Vec<_> = (0..10_000).map(|n| LoopMessage::Tick(late(n))).collect();
    let (_dir, path) = fresh();
    let totals = write(&path, &published);
    let timings = Recording::open(&path).expect("complete").timings().to_vec();
    let within = |value: u64, truth: u64| value >= truth && value as f64 <= truth as f64 * 1.001;

    assert_eq!(timings.len(), 2);
    let (first, second) = (&timings[0], &timings[1]);
    assert_eq!(
        (first.first_tick, first.last_tick, first.ticks),
        (0, 4999, 5000)
    );
    assert_eq!(
        (second.first_tick, second.last_tick, second.ticks),
        (5000, 9999, 5000)
    );
    assert!(
        within(first.lateness_p50_ns, 2500) && within(first.lateness_p99_ns, 4950),
        "{first:?}"
    );
    assert!(
        within(second.lateness_p50_ns, 25_000) && within(second.lateness_p9999_ns, 50_000),
        "{second:?}"
    );
    assert_eq!(
        (first.lateness_max_ns, second.lateness_max_ns),
        (5000, 50_000)
    );
    assert_eq!((first.compute_p50_ns, second.compute_max_ns), (700, 700));
    // Rank 9900 of 10,000: in the first second all 5000 values are at most 5000 ns; in the second second, x / 10 values are at
    // most x. So min(x, 5000) + x / 10 = 9900, that is x = 49,000.
    assert!(
        within(totals.lateness.p99_ns, 49_000),
        "{:?}",
        totals.lateness
    );
    assert_eq!(
        (totals.lateness.max_ns, totals.compute.p9999_ns),
        (50_000, 700)
    );
}

#[test]
fn killed_process_loses_at_most_a_tenth_of_a_second() {
    let (_dir, path) = fresh();
    let mut recorder = Recorder::create(&path, &header()).expect("fresh");
    let published = run(7_499); // 1.4998 s: the chunks up to 1.4 s are full
    published
        .iter()
        .for_each(|p| recorder.record(p).expect("good disk"));
    std::mem::forget(recorder); // like a killed process: nothing more is written

    let recording = Recording::open(&path).expect("readable up to the cut");
    assert!(recording.truncated());
    assert_eq!(recording.tick_count(), 7000);
    assert_eq!(recording.config_toml(), Some(CONFIG));
    let ticks: Vec<_> = recording
        .ticks()
        .expect("opened")
        .map(|t| t.expect("readable"))
        .collect();
    assert_eq!(
        ticks.iter().map(bits).collect::<Vec<_>>(),
        (0..7000).map(|n| bits(&tick(n))).collect::<Vec<_>>()
    );
}

#[test]
fn rejects_ticks_out_of_order() {
    let (_dir, path) = fresh();
    let mut recorder = Recorder::create(&path, &header()).expect("fresh");
    recorder.record(&LoopMessage::Tick(tick(5))).expect("first");
    let refused = recorder
        .record(&LoopMessage::Tick(tick(5)))
        .expect_err("twice");
    assert!(
        matches!(
            refused,
            RecordingError::Order {
                tick: 5,
                after: 5,
                ..
            }
        ),
        "{refused}"
    );
}

#[test]
fn recovered_file_is_complete_and_reports_the_truncation() {
    let (dir, path) = fresh();
    let published = run(12_000);
    write(&path, &published);
    let bytes = std::fs::read(&path).expect("written");
    let cut = dir.path().join("cut.mcap");
    std::fs::write(&cut, &bytes[..bytes.len() * 6 / 10]).expect("temporary");

    let recovery = recover(&cut, &dir.path().join("whole.mcap")).expect("recoverable");
    let recovered = recovery.first;
    let whole = Recording::open(&recovered.totals.path).expect("complete");
    let old = Recording::open(&cut).expect("readable");
    assert!(old.truncated() && !whole.truncated());
    assert!(
        (5000..12_000).contains(&whole.tick_count()),
        "{}",
        whole.tick_count()
    );
    assert_eq!(whole.loop_digest(), old.loop_digest());
    assert_eq!(
        whole.events(),
        &events_of(&published)[..2],
        "the last event is after the cut"
    );
    assert_eq!(
        (whole.config_toml(), whole.period_ns()),
        (Some(CONFIG), Some(PERIOD_NS))
    );
    assert!(
        whole.metadata()["recovered"].starts_with("readable up to byte"),
        "{:?}",
        whole.metadata()
    );
    assert_eq!(
        recovered.cut.expect("was cut").of_bytes,
        bytes.len() as u64 * 6 / 10
    );
    assert_eq!(
        ticks_of(&published)[..whole.tick_count() as usize]
            .last()
            .map(|t| t.tick),
        Some(whole.last_tick())
    );
}

#[test]
fn lateness_includes_the_missed_periods() {
    let folder = tempfile::tempdir().expect("temporary directory");
    let ticks = [0, 1, 5].map(|number| {
        let missed_ticks = if number == 5 { 3 } else { 0 };
        let woke_ns = number * PERIOD_NS + 100;
        LoopMessage::Tick(TickRecord {
            missed_ticks,
            woke_ns,
            done_ns: woke_ns + 1,
            ..tick(number)
        })
    });
    let totals = write(&folder.path().join("late.mcap"), &ticks);
    assert_eq!(totals.overruns, 3);
    assert_eq!(totals.lateness.max_ns, 3 * PERIOD_NS + 100);
    assert_eq!(totals.lateness.p50_ns, 100);
}

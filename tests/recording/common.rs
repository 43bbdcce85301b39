//! Synthetic runs, and functions that write and read them.
use std::collections::BTreeMap;
use std::path::Path;

use bench_hal::Validity;
use bench_recording::{DiskState, DiskWatch, Header, Recorder, Totals};
use bench_rt::arming::{State, Trip};
use bench_rt::record::{
    Event, EventKind, LoopMessage, Origin, RequestEvent, RequestKind, TickRecord,
};

/// 5 kHz.
pub const PERIOD_NS: u64 = 200_000;
/// A moment in 2026.
pub const STARTED_NS: u64 = 1_790_000_000_000_000_000;

pub const CONFIG: &str = "profile = \"stage\"\n[loop]\nservo_rate_hz = 5000\n";

pub fn header() -> Header {
    let metadata = [
        ("version", "0.1.0"),
        ("host", "test"),
        ("policy", "virtual"),
    ];
    Header {
        config_toml: CONFIG.into(),
        period_s: PERIOD_NS as f64 * 1e-9,
        started_ns: STARTED_NS,
        metadata: BTreeMap::from(metadata.map(|(k, v)| (k.to_string(), v.to_string()))),
    }
}

/// A tick similar to one of the simulator: a moving stage, a noisy probe, a command. All values are functions of the number,
/// so every run is the same.
pub fn tick(number: u64) -> TickRecord {
    let t = number as f64 * 2e-4;
    let noise = (number.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / 2f64.powi(53) - 0.5;
    let scheduled_ns = number * PERIOD_NS;
    TickRecord {
        tick: number,
        scheduled_ns,
        woke_ns: scheduled_ns,
        done_ns: scheduled_ns,
        reference_m: 1e-4 * (30.0 * t).sin(),
        position_m: 1e-4 * (30.0 * t - 0.1).sin() + 1e-8 * noise,
        requested_a: 0.2 * (30.0 * t).cos() + 1e-3 * noise,
        command_a: 0.2 * (30.0 * t).cos(),
        probe_sequence: number + 1,
        probe_age_ns: 50_000,
        validity: Validity::Valid,
        state: State::Running,
        flags: 1,
        missed_ticks: 0,
        raw_position_m: None,
        raw_command_a: None,
        actual_a: None,
    }
}

/// A run of `ticks` ticks with three events: arm request, change of state, and trip.
pub fn run(ticks: u64) -> Vec<LoopMessage> {
    let event = |tick, kind| LoopMessage::Event(Event { tick, kind });
    let mut run = vec![
        event(
            0,
            EventKind::Request(RequestEvent {
                id: 1,
                kind: RequestKind::Arm,
                origin: Origin::Supervisor,
                refusal: None,
            }),
        ),
        event(
            0,
            EventKind::State {
                from: State::Disarmed,
                to: State::Armed,
            },
        ),
    ];
    run.extend((0..ticks).map(|n| LoopMessage::Tick(tick(n))));
    run.push(event(
        ticks - 1,
        EventKind::Trip(Trip::Travel {
            position_m: 4.1e-3,
            limit_m: 4e-3,
        }),
    ));
    run
}

/// Writes `run` and finishes with one result.
pub fn write(path: &Path, run: &[LoopMessage]) -> Totals {
    let mut recorder = Recorder::create(path, &header()).expect("a fresh file");
    run.iter()
        .for_each(|p| recorder.record(p).expect("a good disk"));
    recorder
        .finish(&[(
            "result.json",
            "application/json",
            b"{\"outcome\":\"completed\"}",
        )])
        .expect("a good disk")
}

/// All bits of a tick, because -0.0 == 0.0 and NaN != NaN.
pub fn bits(t: &TickRecord) -> (TickRecord, [u64; 4], [Option<u64>; 3]) {
    let floats = [t.reference_m, t.position_m, t.requested_a, t.command_a].map(f64::to_bits);
    let rest = TickRecord {
        reference_m: 0.0,
        position_m: 0.0,
        requested_a: 0.0,
        command_a: 0.0,
        raw_position_m: None,
        raw_command_a: None,
        actual_a: None,
        ..*t
    };
    let optional = [t.raw_position_m, t.raw_command_a, t.actual_a];
    (rest, floats, optional.map(|value| value.map(f64::to_bits)))
}

pub fn ticks_of(run: &[LoopMessage]) -> Vec<TickRecord> {
    let tick = |p: &LoopMessage| {
        if let LoopMessage::Tick(t) = p {
            Some(*t)
        } else {
            None
        }
    };
    run.iter().filter_map(tick).collect()
}

pub fn events_of(run: &[LoopMessage]) -> Vec<Event> {
    let event = |p: &LoopMessage| {
        if let LoopMessage::Event(e) = p {
            Some(*e)
        } else {
            None
        }
    };
    run.iter().filter_map(event).collect()
}

/// A disk on which there is always room.
pub fn disk_with_room() -> DiskWatch {
    let state = DiskState {
        free_bytes: None,
        size_bytes: 0,
    };
    DiskWatch::over(Box::new(move || state), 0)
}

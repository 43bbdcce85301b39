//! `bench export`, at the process boundary: pandas, pyarrow, scipy, pyuff and python-control read back what was recorded.
//!
//! The truth is the recording as the public package `mcap` reads it (`tests/python/export.py`), a closed form, or the table of the
//! response that `bench chirp` wrote.

mod defects;
mod response;
mod signals;
mod targets;

use std::path::Path;
use std::sync::OnceLock;

use bench_hal::Validity;
use bench_recording::{Header, Recorder};
use bench_rt::arming::State;
use bench_rt::record::{LoopMessage, TickRecord};
use bench_test_support::program::Bench;

/// A tick of a run at 5 kHz. Every signal is a number that a text of 13 digits does not hold exactly.
fn tick(n: u64) -> TickRecord {
    let phase = n as f64 * 0.01;
    TickRecord {
        tick: n,
        scheduled_ns: n * 200_000,
        woke_ns: n * 200_000 + 1000 + n % 7,
        done_ns: n * 200_000 + 9000,
        reference_m: 1e-4 * phase.sin(),
        position_m: 0.97e-4 * (phase - 0.3).sin(),
        requested_a: 0.1 * phase.cos(),
        command_a: -0.099 * phase.cos(),
        actual_a: (!n.is_multiple_of(3)).then(|| 0.098 * phase.cos()),
        raw_position_m: None,
        raw_command_a: None,
        probe_sequence: u64::MAX - n,
        probe_age_ns: n % 11,
        validity: Validity::Valid,
        state: State::Running,
        flags: n as u32 % 32,
        missed_ticks: 0,
    }
}

/// Records ticks of a loop with this period.
fn record(path: &Path, period_s: f64, ticks: impl Iterator<Item = TickRecord>) {
    let header = Header {
        config_toml: String::new(),
        period_s,
        started_ns: 1_790_000_000_000_000_000,
        metadata: Default::default(),
    };
    let mut recorder = Recorder::create(path, &header).expect("a fresh file");
    for tick in ticks {
        let recorded = recorder.record(&LoopMessage::Tick(tick));
        recorded.expect("a good disk");
    }
    recorder.finish(&[]).expect("a good disk");
}

/// A folder with the recording `run.mcap` of ten ticks.
fn short_recording() -> Bench {
    let bench = Bench::new();
    record(&bench.path("run.mcap"), 2e-4, (0..10).map(tick));
    bench
}

/// The files of a chirp.
struct Chirp {
    recording: Vec<u8>,
    /// The table of its response that `bench chirp` wrote.
    response: String,
}

/// A chirp that was made once.
fn chirp() -> &'static Chirp {
    static CHIRP: OnceLock<Chirp> = OnceLock::new();
    CHIRP.get_or_init(|| {
        let bench = Bench::new();
        let made = bench.json("chirp --duration 6 --start 5 --stop 50 --out .");
        let path = |key: &str| made[key].as_str().expect("a path").to_string();
        Chirp {
            recording: std::fs::read(bench.path(path("recording"))).expect("it was written"),
            response: bench.read(path("frf_csv")),
        }
    })
}

/// A folder with the recording `run.mcap` of a chirp.
fn recorded_chirp() -> Bench {
    let bench = Bench::new();
    bench.write("run.mcap", &chirp().recording);
    bench
}

//! An independent program reads a recording: Python with the public packages `mcap` and `mcap-protobuf-support`.
//!
//! `BENCH_PYTHON` names the interpreter (default `python3`). If it or its packages are missing, the test prints a message and passes;
//! with `BENCH_REQUIRE_PYTHON=1`, as in CI, it fails.
use std::path::Path;
use std::process::Command;

use bench_hal::Validity;
use bench_recording::{Header, Recorder};
use bench_rt::arming::{State, Trip};
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};
use bench_test_support::program::Bench;
use serde_json::{Value, json};

const TICKS: u64 = 11_000;
const CONFIG: &str = "profile = \"stage\"\n";

fn tick(n: u64) -> TickRecord {
    let special = [
        -0.0,
        0.0,
        f64::from_bits(0x7ff8_0000_0000_beef),
        f64::NEG_INFINITY,
        5e-324,
        0.1 + 0.2,
    ];
    let scheduled_ns = n * 200_000;
    TickRecord {
        tick: n,
        scheduled_ns,
        woke_ns: scheduled_ns + 1000,
        done_ns: scheduled_ns + 1500,
        reference_m: 1e-4 * (0.01 * n as f64).sin(),
        position_m: special[n as usize % special.len()],
        requested_a: -(n as f64).sqrt(),
        command_a: f64::from_bits(0x3ff0_0000_0000_0000 + n),
        probe_sequence: u64::MAX - n,
        probe_age_ns: n % 7,
        validity: [
            Validity::Valid,
            Validity::OutOfRange,
            Validity::Faulty,
            Validity::Missing,
        ][n as usize % 4],
        state: [
            State::Running,
            State::Armed,
            State::Disarmed,
            State::Tripped,
        ][n as usize % 4],
        flags: n as u32 % 32,
        missed_ticks: 0,
        raw_position_m: [None, Some(f64::NEG_INFINITY), Some(-1e-6 * n as f64)][n as usize % 3],
        raw_command_a: [None, Some(0.0), Some(5e-324)][n as usize % 3],
        actual_a: [None, Some(-0.0), Some(1e-3 * n as f64)][n as usize % 3],
    }
}

/// The row that the Python program prints for a tick.
fn row(t: &TickRecord) -> Value {
    let hex = |x: f64| format!("{:016x}", x.to_bits());
    let validity = match t.validity {
        Validity::Valid => "valid",
        Validity::OutOfRange => "out_of_range",
        Validity::Faulty => "faulty",
        Validity::Missing => "missing",
    };
    json!([
        t.tick,
        t.scheduled_ns,
        t.woke_ns,
        t.done_ns,
        t.probe_sequence,
        t.probe_age_ns,
        t.flags,
        t.missed_ticks,
        hex(t.reference_m),
        hex(t.position_m),
        hex(t.requested_a),
        hex(t.command_a),
        t.actual_a.map(hex),
        t.raw_position_m.map(hex),
        t.raw_command_a.map(hex),
        validity,
        t.state.name()
    ])
}

/// A moment in 2026.
const STARTED_NS: u64 = 1_790_000_000_000_000_000;

fn record(path: &Path) {
    let header = Header {
        config_toml: CONFIG.into(),
        period_s: 2e-4,
        started_ns: STARTED_NS,
        metadata: [("host".to_string(), "bench-1".to_string())].into(),
    };
    let mut recorder = Recorder::create(path, &header).expect("a fresh file");
    for n in 0..TICKS {
        recorder
            .record(&LoopMessage::Tick(tick(n)))
            .expect("a good disk");
    }
    let trip = Trip::Travel {
        position_m: -4.1e-3,
        limit_m: 4e-3,
    };
    for kind in [
        EventKind::Trip(trip),
        EventKind::State {
            from: State::Running,
            to: State::Tripped,
        },
    ] {
        recorder
            .record(&LoopMessage::Event(Event {
                tick: TICKS - 1,
                kind,
            }))
            .expect("a good disk");
    }
    recorder
        .finish(&[("result.json", "application/json", b"{}")])
        .expect("a good disk");
}

/// The output of Python, or the reason why Python is not available.
fn read_by_python(path: &Path, options: &[&str]) -> Result<Value, String> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python)
        .args(["-c", "import mcap, mcap_protobuf"])
        .output();
    match probe {
        Err(e) => return Err(format!("{python}: {e}")),
        Ok(o) if !o.status.success() => return Err(String::from_utf8_lossy(&o.stderr).into_owned()),
        Ok(_) => {}
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/read_recording.py");
    let output = Command::new(&python)
        .arg(script)
        .arg(path)
        .args(options)
        .output()
        .expect("has just run");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(serde_json::from_slice(&output.stdout).expect("one JSON object"))
}

/// As [`read_by_python`]; `None` without Python, if it is not required.
fn python_reading(path: &Path, options: &[&str]) -> Option<Value> {
    match read_by_python(path, options) {
        Ok(read) => Some(read),
        Err(why) => {
            assert!(
                std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
                "Python is required here: {why}"
            );
            eprintln!(
                "not tested: {why}\npip install mcap mcap-protobuf-support, or set BENCH_PYTHON"
            );
            None
        }
    }
}

#[test]
fn python_reads_name_note_operator_and_command_of_a_run_also_after_recovery() {
    let bench = Bench::of(env!("CARGO_BIN_EXE_bench"));
    let given = [
        ["--name", "second flexure"],
        ["--note", "it's <b>\n5 % heavier"],
        ["--operator", "Jörg"],
    ];
    let command = ["control", "--slow", "--duration", "1", "--no-report"];
    let arguments = command.into_iter().chain(given.into_iter().flatten());
    let made = bench.run_with(arguments.chain(["--json"])).json();
    assert_eq!(made["name"], "second flexure");
    assert_eq!(made["operator"], "Jörg");
    let recording = made["recording"].as_str().expect("a path");
    bench.json(&format!("recover {recording} --to copy.mcap"));
    for file in [recording, "copy.mcap"] {
        let Some(read) = python_reading(&bench.path(file), &[]) else {
            return;
        };
        let metadata = &read["metadata"]["bench"];
        for [option, text] in given {
            assert_eq!(metadata[&option[2..]], text, "{file}");
        }
        assert_eq!(
            metadata["command_line"],
            "bench control --slow --duration 1 --no-report --name 'second flexure' --note 'it'\\''s <b>\n5 % heavier' --operator Jörg --json"
        );
        assert_eq!(metadata["profile"], "stage");
    }
}

#[test]
fn python_reads_every_tick_bit_for_bit_with_the_embedded_schema() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("run.mcap");
    record(&path);
    let Some(read) = python_reading(&path, &["--values"]) else {
        return;
    };
    assert_eq!(
        (&read["ticks"], &read["first_tick"], &read["last_tick"]),
        (&json!(TICKS), &json!(0), &json!(10_999))
    );
    assert_eq!(
        (&read["gaps"], &read["log_offsets_ns"]),
        (&json!([]), &json!([STARTED_NS]))
    );
    for n in 0..TICKS {
        assert_eq!(read["values"][n as usize], row(&tick(n)), "tick {n}");
    }
    assert_eq!(read["config_bytes"], json!(CONFIG.len()));
    assert_eq!(read["attachments"]["result.json"], json!(2));
    assert_eq!(
        read["metadata"]["bench"],
        json!({
            "host": "bench-1",
            "period_ns": "200000",
            "period_s": "0.0002",
            "started_ns": STARTED_NS.to_string(),
        })
    );
    assert_events_and_summaries(&read);
}

fn assert_events_and_summaries(read: &Value) {
    let trip = &read["events"][0];
    assert_eq!(
        (&trip["kind"], &trip["reason"], &trip["tick"]),
        (&json!("trip"), &json!("travel"), &json!(10_999))
    );
    assert_eq!(
        (&trip["value"], &trip["limit"]),
        (&json!(-4.1e-3), &json!(4e-3))
    );
    let state = &read["events"][1];
    assert_eq!(
        (&state["from"], &state["to"]),
        (&json!("running"), &json!("tripped"))
    );
    // 11,000 ticks at 5 kHz are two full seconds and 0.2 s. Each tick woke 1000 ns late and computed for 500 ns.
    let ticks: Vec<_> = (0..3)
        .map(|n| read["timings"][n]["ticks"].clone())
        .collect();
    assert_eq!(ticks, [json!(5000), json!(5000), json!(1000)]);
    assert_eq!(read["timings"][1]["lateness_p99_ns"], json!(1000));
    assert_eq!(read["timings"][1]["compute_max_ns"], json!(500));
}

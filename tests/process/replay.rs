//! Exit codes and output of `bench replay`.
use std::path::Path;
use std::process::Output;
use std::time::Duration;

use bench_recording::{Header, Recorder, Recording};
use bench_rt::record::{LoopMessage, TickRecord};

use crate::process::common::{AT_1_KHZ, NO_OVERRUN_LIMIT, Running, bench, recording_in, stderr};

fn replay(path: &Path) -> Output {
    bench(&["replay", "--json"])
        .arg(path)
        .output()
        .expect("it runs")
}

fn json(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(output)))
}

#[test]
fn real_time_run_with_missed_ticks_exits_with_3_and_replays_bit_for_bit() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let arguments = [
        &["control", "--slow", "--duration", "5", "--json"][..],
        &AT_1_KHZ,
        &NO_OVERRUN_LIMIT,
    ]
    .concat();
    let mut running = Running::start(&arguments, folder.path());
    running.until_slept(800);
    // The process is paused for about 50 ms: about 50 ticks at 1 kHz are missed.
    running.freeze();
    std::thread::sleep(Duration::from_millis(50));
    running.thaw();
    let output = running.end();
    let report = json(&output);
    assert_eq!(
        (output.status.code(), report["outcome"].as_str()),
        (Some(3), Some("completed")),
        "{report}"
    );
    let path = recording_in(folder.path());
    let recording = Recording::open(&path).expect("a recording");
    assert!(recording.overruns() >= 45, "{}", recording.overruns());
    assert_eq!(report["overruns"].as_u64(), Some(recording.overruns()));
    assert_eq!(
        recording.tick_count() + recording.overruns(),
        recording.last_tick() + 1
    );

    let output = replay(&path);
    let report = json(&output);
    assert_eq!(
        (output.status.code(), report["identical"].as_bool()),
        (Some(0), Some(true)),
        "{report}"
    );
    assert_eq!(report["ticks"].as_u64(), Some(recording.tick_count()));
}

#[test]
fn more_missed_ticks_than_allowed_trip_and_exit_with_1() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    // The pause misses 2000 ticks at once. A busy machine that misses some ticks does not reach the limit. The arm lease, which a pause
    // uses up as well, is longer.
    let limits = [
        "--set",
        "interlock.overruns_per_s=1000",
        "--set",
        "loop.arm_lease_s=60",
    ];
    let arguments = [
        &["control", "--slow", "--duration", "60", "--json"][..],
        &AT_1_KHZ,
        &limits,
    ]
    .concat();
    let mut running = Running::start(&arguments, folder.path());
    running.until_slept(800);
    running.freeze();
    std::thread::sleep(Duration::from_secs(2));
    running.thaw();
    let output = running.end();
    let report = json(&output);
    assert_eq!(
        (output.status.code(), report["outcome"].as_str()),
        (Some(1), Some("tripped")),
        "{report}"
    );
    assert_eq!(
        report["trip"]["reason"].as_str(),
        Some("overruns"),
        "{report}"
    );
    let path = recording_in(folder.path());
    let recording = Recording::open(&path).expect("a recording");
    let at = report["trip"]["tick"].as_u64().expect("a tick");
    let after = recording
        .ticks()
        .expect("readable")
        .map(|r| r.expect("readable"))
        .filter(|r| r.tick >= at);
    assert!(after.into_iter().all(|r| r.command_a.to_bits() == 0));
    assert_eq!(replay(&path).status.code(), Some(0));
}

#[test]
fn altered_recording_exits_with_1_and_names_the_tick() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = bench(&["control", "--fast", "--duration", "1", "--out"])
        .arg(folder.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let path = recording_in(folder.path());
    assert_eq!(replay(&path).status.code(), Some(0));

    let old = Recording::open(&path).expect("a recording");
    let altered = folder.path().join("altered");
    let header = Header {
        config_toml: old.config_toml().expect("a configuration").into(),
        period_s: old.period_s().expect("a period"),
        started_ns: 0,
        metadata: old.metadata().clone(),
    };
    let mut new = Recorder::create(&altered, &header).expect("a new file");
    for attachment in old.attachments().iter().filter(|a| a.name != "config.toml") {
        new.attach(&attachment.name, &attachment.media_type, &attachment.data)
            .expect("a good disk");
    }
    let mut events = old.events().iter().peekable();
    for record in old.ticks().expect("readable") {
        let mut record: TickRecord = record.expect("readable");
        while let Some(event) = events.next_if(|event| event.tick <= record.tick) {
            new.record(&LoopMessage::Event(*event))
                .expect("a good disk");
        }
        // 2^30 of 2^52: a reading of 50 um changes by 12 pm, the command of the same tick by 460 A/m times that, 5 nA.
        if record.tick == 6000 {
            record.position_m = f64::from_bits(record.position_m.to_bits() ^ (1 << 30));
        }
        new.record(&LoopMessage::Tick(record)).expect("a good disk");
    }
    new.finish(&[]).expect("a good disk");
    let output = replay(&altered);
    let report = json(&output);
    assert_eq!(
        (output.status.code(), report["identical"].as_bool()),
        (Some(1), Some(false)),
        "{report}"
    );
    assert_eq!(report["first"]["tick"].as_u64(), Some(6000), "{report}");
    let output = bench(&["replay"]).arg(&altered).output().expect("it runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.code() == Some(1) && text.contains("DIFFER") && text.contains("tick 6000"),
        "{text}"
    );
}

#[test]
fn rejects_invalid_recordings_with_reason_and_without_panic() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let output = bench(&["control", "--slow", "--duration", "1", "--out"])
        .arg(folder.path())
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let whole = std::fs::read(recording_in(folder.path())).expect("a file");
    let external = folder.path().join("external.mcap");
    mcap::Writer::new(std::fs::File::create(&external).expect("a file"))
        .expect("room")
        .finish()
        .expect("room");
    let external = std::fs::read(external).expect("a file");

    let mut altered = whole.clone();
    altered[whole.len() / 2] ^= 1;
    let cases: [(&str, &[u8], &str); 6] = [
        ("empty", b"", ""),
        ("text", b"time_s,reference_m\n0,0\n", "not an MCAP file"),
        ("external", &external, "without bench's channel /loop"),
        ("head", &whole[..200], "has no ticks"),
        ("altered", &altered, "damaged"),
        ("directory", b"", ""),
    ];
    for (name, bytes, expected) in cases {
        let path = folder.path().join(name);
        if name == "directory" {
            std::fs::create_dir(&path).expect("a folder");
        } else {
            std::fs::write(&path, bytes).expect("a file");
        }
        for command in ["replay", "identify"] {
            let output = bench(&[command]).arg(&path).output().expect("it runs");
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(1), "{command} {name}: {message}");
            assert!(
                message.contains(name) && message.contains(expected),
                "{command} {name}: {message}"
            );
            assert!(
                !message.contains("panicked") && output.stdout.is_empty(),
                "{command} {name}: {message}"
            );
        }
    }
    let output = replay(&folder.path().join("absent"));
    assert!(
        output.status.code() == Some(1) && stderr(&output).contains("no such file"),
        "{}",
        stderr(&output)
    );

    // Cut off in the middle: the readable part replays, and the program reports the cut.
    let cut = folder.path().join("cut.mcap");
    std::fs::write(&cut, &whole[..whole.len() * 2 / 3]).expect("a file");
    let output = replay(&cut);
    let report = json(&output);
    assert_eq!(
        (output.status.code(), report["truncated"].as_bool()),
        (Some(0), Some(true)),
        "{report}"
    );
}

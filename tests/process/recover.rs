//! Damaged recordings, and recordings that python has written: what `bench recover` and `bench identify` make of them.
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use bench_recording::Recording;
use bench_rt::record::TickRecord;
use serde_json::Value;

use crate::process::common::{AT_1_KHZ, bench, recording_in, stderr, stdout};

/// A chirp of 8 s at 1 kHz in virtual time; a chunk holds 100 ticks.
fn chirp(folder: &Path) -> PathBuf {
    let arguments = ["chirp", "--duration", "8", "--start", "5Hz"];
    let output = bench(&[&arguments[..], &AT_1_KHZ[..4]].concat())
        .arg("--out")
        .arg(folder)
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    recording_in(folder)
}

/// The output of `tests/python/damage.py`; `None`, with the reason on standard error, without Python and `mcap`.
fn python(arguments: &[&str]) -> Option<Vec<u8>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python)
        .args(["-c", "import mcap, mcap_protobuf, zstandard"])
        .output();
    if !probe.as_ref().is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "Python is required here: {probe:?}"
        );
        eprintln!(
            "not tested: {probe:?}\npip install mcap mcap-protobuf-support, or set BENCH_PYTHON"
        );
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/damage.py");
    let output = Command::new(&python)
        .arg(script)
        .args(arguments)
        .output()
        .expect("has just run");
    assert!(output.status.success(), "{}", stderr(&output));
    Some(output.stdout)
}

fn recover(path: &Path, to: &Path) -> (Output, Value) {
    let output = bench(&["recover", "--json"])
        .arg(path)
        .arg("--to")
        .arg(to)
        .output()
        .expect("it runs");
    let report = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output, report)
}

fn ticks(path: &Path) -> Vec<TickRecord> {
    let recording = Recording::open(path).expect("complete");
    let ticks = recording.ticks().expect("complete");
    ticks.collect::<Result<_, _>>().expect("complete")
}

/// All bits of a tick of the simulated stage, because -0.0 == 0.0.
fn bits(t: &TickRecord) -> (TickRecord, [u64; 4]) {
    let floats = [t.reference_m, t.position_m, t.requested_a, t.command_a];
    (*t, floats.map(f64::to_bits))
}

fn flip(bytes: &[u8], byte: usize, bit: u32) -> Vec<u8> {
    let mut damaged = bytes.to_vec();
    damaged[byte] ^= 1 << bit;
    damaged
}

#[test]
fn recovery_after_a_bit_flip_gives_back_what_python_reads_and_reports_the_rest() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let Some(flips) = python(&["flips", path.to_str().expect("text"), "20", "200"]) else {
        return;
    };
    let flips: Value = serde_json::from_slice(&flips).expect("JSON");
    let original = std::fs::read(&path).expect("a recording");
    let originals = ticks(&path);
    assert_eq!(flips["ticks"], originals.len(), "python reads every tick");
    let (damaged, to) = (folder.path().join("damaged"), folder.path().join("to"));
    let mut with_loss = 0;
    for case in flips["flips"].as_array().expect("a list") {
        let number = |key: &str| case[key].as_u64().expect("a number");
        let bytes = flip(&original, number("byte") as usize, number("bit") as u32);
        std::fs::write(&damaged, bytes).expect("room");
        let (output, report) = recover(&damaged, &to);
        let code = output.status.code();
        assert!(matches!(code, Some(0 | 3)), "{case}: {}", stderr(&output));
        let python_lacks: BTreeSet<u64> =
            serde_json::from_value(case["absent"].clone()).expect("ticks");
        let recovered = ticks(&to);
        let numbers: BTreeSet<u64> = recovered.iter().map(|tick| tick.tick).collect();
        let lacks = originals.iter().map(|tick| tick.tick);
        let lacks: BTreeSet<u64> = lacks.filter(|tick| !numbers.contains(tick)).collect();
        assert!(
            lacks.is_subset(&python_lacks),
            "{case}: {lacks:?} are missing"
        );
        for tick in &recovered {
            assert_eq!(bits(tick), bits(&originals[tick.tick as usize]), "{case}");
        }
        let missing = report["missing_ticks"].as_array().expect("a list");
        let reported = missing
            .iter()
            .map(|m| m["ticks"].as_u64().expect("a count"));
        assert_eq!(
            reported.sum::<u64>(),
            lacks.len() as u64,
            "{case}: {report}"
        );
        if !lacks.is_empty() {
            with_loss += 1;
            assert_eq!(code, Some(3), "{case}");
            assert!(report["lost_records"].as_u64() >= Some(lacks.len() as u64));
        }
        if code == Some(0) {
            assert_is_equal(&to, &path);
        }
        std::fs::remove_file(&to).expect("just written");
    }
    assert!(
        (100..=200).contains(&with_loss),
        "most bytes belong to chunks: {with_loss}"
    );
}

fn assert_is_equal(one: &Path, other: &Path) {
    let [one, other] = [one, other].map(|path| Recording::open(path).expect("complete"));
    assert_eq!(one.metadata(), other.metadata());
    assert_eq!(one.attachments().len(), other.attachments().len());
    assert_eq!(one.config_toml(), other.config_toml());
    assert_eq!(one.loop_digest(), other.loop_digest());
}

#[test]
fn recovery_without_the_configuration_keeps_all_ticks_and_names_the_loss() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let original = std::fs::read(&path).expect("a recording");
    let damaged = folder.path().join("damaged.mcap");
    std::fs::write(&damaged, flip(&original, 1000, 3)).expect("room");
    let output = bench(&["recover"]).arg(&damaged).output().expect("it runs");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let text = stdout(&output);
    assert!(
        text.contains("the attachment config.toml is missing") && !text.contains("ticks 0 to"),
        "{text}"
    );
    let recovered = folder.path().join("damaged_recovered.mcap");
    assert_eq!(ticks(&recovered).len(), ticks(&path).len());
    for command in ["identify", "replay"] {
        let output = bench(&[command]).arg(&recovered).output().expect("it runs");
        assert_ne!(output.status.code(), Some(0));
        let message = stderr(&output);
        assert!(message.contains("configuration"), "{message}");
    }
}

#[test]
fn every_recording_of_a_joined_file_is_recovered_into_a_file_of_its_own() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let original = std::fs::read(&path).expect("a recording");
    let originals: Vec<_> = ticks(&path).iter().map(bits).collect();
    // In the middle of a chunk that is about half of the recording away from its end.
    let cut = &original[..byte_in_a_chunk(&original)];
    let joined = folder.path().join("joined.mcap");
    let second = original.len() as u64;
    std::fs::write(&joined, [&original, cut].concat()).expect("room");

    let output = bench(&["identify"]).arg(&joined).output().expect("it runs");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    let words = format!("more than one recording, another one begins at byte {second}");
    assert!(
        message.contains(&words) && message.contains("bench recover"),
        "{message}"
    );

    let output = bench(&["recover"]).arg(&joined).output().expect("it runs");
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(3), "{text}");
    let words = format!("2 recordings found in the file, beginning at bytes 0, {second}");
    assert!(
        text.contains(&words) && !text.contains("nothing is missing"),
        "{text}"
    );
    let whole = ticks(&folder.path().join("joined_recovered.mcap"));
    assert!(whole.iter().map(bits).eq(originals.iter().copied()));
    let part = ticks(&folder.path().join("joined_recovered-2.mcap"));
    assert!(part.len() > 1000 && part.len() < originals.len());
    assert!(
        part.iter()
            .map(bits)
            .eq(originals[..part.len()].iter().copied())
    );

    let (_, report) = recover(&joined, &folder.path().join("to.mcap"));
    let other = &report["other_recordings"][0];
    assert_eq!(report["from_byte"], 0);
    assert_eq!(report["ticks"], originals.len());
    assert_eq!(report["cut"], Value::Null);
    assert_eq!(other["from_byte"], second);
    assert_eq!(other["ticks"], part.len());
    assert_eq!(other["cut"]["of_bytes"], second + cut.len() as u64);
    assert!(
        other["recording"]
            .as_str()
            .is_some_and(|name| name.ends_with("to-2.mcap"))
    );
    assert_eq!(report["unused"], serde_json::json!([]));
}

#[test]
fn joined_complete_recordings_are_recovered_without_a_loss() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let original = std::fs::read(&path).expect("a recording");
    let joined = folder.path().join("joined.mcap");
    std::fs::write(&joined, [&original[..], &original].concat()).expect("room");
    let to = folder.path().join("to.mcap");
    let output = bench(&["recover"])
        .arg(&joined)
        .arg("--to")
        .arg(&to)
        .output();
    let output = output.expect("it runs");
    let text = stdout(&output);
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(
        text.contains("2 recordings found") && text.contains("nothing is missing"),
        "{text}"
    );
    assert_is_equal(&to, &path);
    assert_is_equal(&folder.path().join("to-2.mcap"), &path);
}

/// A byte in the content of a chunk in the middle of the file. A record is (opcode, length u64, content), the first follows the
/// magic of 8 bytes, and a chunk has the opcode 6.
fn byte_in_a_chunk(bytes: &[u8]) -> usize {
    let mut at = 8;
    loop {
        let length = bytes[at + 1..at + 9].try_into().expect("eight bytes");
        let end = at + 9 + u64::from_le_bytes(length) as usize;
        if bytes[at] == 6 && at > bytes.len() / 2 {
            return (at + end) / 2;
        }
        at = end;
    }
}

#[test]
fn a_recovered_gap_is_neither_identified_nor_replayed() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let original = std::fs::read(&path).expect("a recording");
    let (damaged, to) = (folder.path().join("damaged"), folder.path().join("to"));
    std::fs::write(&damaged, flip(&original, byte_in_a_chunk(&original), 0)).expect("room");
    let (output, report) = recover(&damaged, &to);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    let missing = &report["missing_ticks"][0];
    assert_eq!(missing["ticks"], 100, "a tenth of a second: {report}");
    for (command, words) in [
        ("identify", "100 records are lost"),
        ("replay", "100 records are missing"),
    ] {
        let output = bench(&[command]).arg(&to).output().expect("it runs");
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn recordings_rewritten_by_python_are_read_in_every_form() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let originals: Vec<_> = ticks(&path).iter().map(bits).collect();
    for way in ["zstd", "lz4", "none", "unchunked"] {
        let to = folder.path().join(way).with_extension("mcap");
        let [from, new] = [&path, &to].map(|path| path.to_str().expect("text"));
        if python(&["rewrite", from, new, way]).is_none() {
            return;
        }
        let recording = Recording::open(&to).expect(way);
        assert!(!recording.truncated());
        let is_unchecked = recording.unchecked_messages() > 0;
        assert_eq!(is_unchecked, way == "unchunked");
        let read: Vec<_> = ticks(&to).iter().map(bits).collect();
        assert!(read == originals, "{way}");
        let output = bench(&["replay"]).arg(&to).output().expect("it runs");
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(0), "{way}: {message}");
        assert_eq!(message.contains("have no CRC"), is_unchecked, "{message}");
        let recovered = folder.path().join("recovered.mcap");
        let (output, _) = recover(&to, &recovered);
        let expected = if is_unchecked { 3 } else { 0 };
        assert_eq!(
            output.status.code(),
            Some(expected),
            "{way}: {}",
            stdout(&output)
        );
        std::fs::remove_file(&recovered).expect("just written");
    }
}

#[test]
fn files_of_other_programs_are_not_called_damaged() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("imu.mcap");
    if python(&["external", path.to_str().expect("text")]).is_none() {
        return;
    }
    for command in ["identify", "replay", "recover"] {
        let output = bench(&[command]).arg(&path).output().expect("it runs");
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            message.contains("not a recording of bench") && message.contains("/imu"),
            "{message}"
        );
        assert!(!message.contains("damaged"), "{message}");
    }
}

#[test]
fn identify_rejects_a_reading_older_than_the_recording() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = chirp(folder.path());
    let to = folder.path().join("old.mcap");
    let [from, new] = [&path, &to].map(|path| path.to_str().expect("text"));
    if python(&["old_reading", from, new, "3000", "9223372036854775807"]).is_none() {
        return;
    }
    let output = bench(&["identify"]).arg(&to).output().expect("it runs");
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(
        message.contains("tick 3000") && message.contains("9.223e9 s"),
        "{message}"
    );
}

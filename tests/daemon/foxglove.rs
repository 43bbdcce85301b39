//! An independent client of the Foxglove protocol. `BENCH_PYTHON`, `BENCH_REQUIRE_PYTHON`: as in tests/support/src/python.rs.
use std::process::Command;

#[test]
fn independent_client_sees_every_message_of_the_recording_beside_a_client_that_does_not_read() {
    let python = std::env::var("BENCH_PYTHON").unwrap_or_else(|_| "python3".into());
    let packages = Command::new(&python)
        .args(["-c", "import websockets, google.protobuf, mcap_protobuf"])
        .output();
    if !packages.is_ok_and(|output| output.status.success()) {
        assert_ne!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref(),
            Ok("1"),
            "{python} lacks the packages of .ci/python-packages.txt"
        );
        println!("not compared: {python} lacks the packages of .ci/python-packages.txt");
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let script = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/python/foxglove_client.py"
    );
    let output = Command::new(&python)
        .args([script, env!("CARGO_BIN_EXE_bench")])
        .arg(folder.path())
        .output()
        .expect("python runs");
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{text}{errors}");
    let ticks = text.lines().find_map(|line| line.strip_prefix("/loop "));
    let ticks: u64 = ticks.and_then(|text| text.parse().ok()).expect("a count");
    // 6 s at 2 kHz in closed loop, and the rest before and after: a tick that a busy machine misses does not count as one of them.
    assert!((12_000..60_000).contains(&ticks), "{text}");
}

//! Name, note and operator of runs that the daemon makes.
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::daemon::common::{Daemon, order};

const RUN: [&str; 4] = ["--slow", "--duration", "1s", "--no-report"];

/// The only recording in a folder.
fn recording(folder: &Path) -> PathBuf {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let mut paths = entries.map(|entry| entry.expect("an entry").path());
    let found = paths.find(|path| path.extension().is_some_and(|ending| ending == "mcap"));
    found.expect("a recording")
}

fn described(path: &Path) -> [Option<String>; 3] {
    let recording = bench_recording::Recording::open(path).expect("a recording");
    let found = bench_experiment::Description::of(&recording);
    [found.name, found.note, found.operator]
}

fn texts(texts: [&str; 3]) -> [Option<String>; 3] {
    texts.map(|text| Some(text.to_string()))
}

fn listed(daemon: &Daemon) -> [Value; 3] {
    let recordings = daemon.get("/api/v1/recordings");
    ["name", "note", "operator"].map(|key| recordings["recordings"][0][key].clone())
}

#[test]
fn run_over_http_is_recorded_with_its_name_and_the_operator_of_the_lease() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    let mut body = order("control", &RUN);
    body["name"] = "first".into();
    body["note"] = "new\nflexure".into();
    let started = daemon.ask("POST", "/api/v1/runs", &lease, Some(body));
    assert_eq!(started.status, 202, "{started:?}");
    daemon.wait_for_end(started.json()["id"].as_u64().expect("a number"), &lease);
    let expected = ["first", "new\nflexure", "anna"];
    assert_eq!(described(&recording(&daemon.recordings())), texts(expected));
    assert_eq!(listed(&daemon), expected.map(Value::from));
}

#[test]
fn command_at_a_terminal_passes_name_note_and_operator_to_the_daemon() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let url = daemon.url();
    for connect in [daemon.socket().display().to_string(), url] {
        let given = [
            "--name",
            "/first",
            "--note",
            "../new",
            "--operator",
            "berta",
        ];
        let arguments = [
            &["control"][..],
            &RUN,
            &given,
            &["--connect", &connect, "--json"],
        ]
        .concat();
        let output = daemon
            .bench(here.path(), &arguments)
            .env("BENCH_TOKEN", daemon.token())
            .output()
            .expect("a process");
        let shown = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{connect}: {shown}");
        let result: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        for (key, text) in [
            ("name", "/first"),
            ("note", "../new"),
            ("operator", "berta"),
        ] {
            assert_eq!(result[key], text, "{connect}");
        }
        let path = result["recording"].as_str().expect("a path");
        let path = [here.path().join(path), daemon.recordings().join(path)]
            .into_iter()
            .find(|path| path.exists());
        let path = path.expect("a recording");
        assert_eq!(
            described(&path),
            texts(["/first", "../new", "berta"]),
            "{connect}"
        );
    }
}

#[test]
fn command_of_an_unknown_user_records_no_operator() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let socket = daemon.socket().display().to_string();
    let arguments = [
        &["control"][..],
        &RUN,
        &["--out", "run", "--connect", &socket, "--json"],
    ]
    .concat();
    let mut command = daemon.bench(here.path(), &arguments);
    let output = command.env_remove("USER").output().expect("a process");
    let shown = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{shown}");
    let result: Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
    assert_eq!(result.get("operator"), None, "{result}");
    let path = recording(&here.path().join("run"));
    assert_eq!(described(&path), [None, None, None]);
}

#[test]
fn refuses_a_folder_whose_name_is_not_utf8_without_a_panic() {
    let daemon = Daemon::start();
    let here = tempfile::tempdir().expect("a folder");
    let mut command = daemon.bench(here.path(), &["control"]);
    command
        .args(RUN)
        .arg("--out")
        .arg(OsStr::from_bytes(b"run\xff"));
    let output = command.output().expect("a process");
    let shown = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{shown}");
    for word in ["--out", "UTF-8", "--connect none"] {
        assert!(shown.contains(word), "{word}: {shown}");
    }
    // Without a daemon the folder is written.
    let alone = command.args(["--connect", "none"]).output();
    let alone = alone.expect("a process");
    let shown = String::from_utf8_lossy(&alone.stderr);
    assert_eq!(alone.status.code(), Some(0), "{shown}");
}

#[test]
fn refuses_names_and_notes_that_a_recording_cannot_contain() {
    let daemon = Daemon::start();
    let lease = daemon.take_lease("anna");
    for (name, note, word) in [
        (
            "x".repeat(201),
            String::new(),
            "name: it has 201 characters",
        ),
        (
            "a\u{7}".into(),
            String::new(),
            "name: it contains a control character",
        ),
        (
            String::new(),
            "x".repeat(2001),
            "note: it has 2001 characters",
        ),
    ] {
        let mut body = order("control", &RUN);
        body["name"] = name.into();
        body["note"] = note.into();
        let refused = daemon.ask("POST", "/api/v1/runs", &lease, Some(body));
        assert_eq!(refused.status, 400, "{refused:?}");
        let message = refused.json()["error"]["message"].to_string();
        assert!(message.contains(word), "{message}");
    }
}

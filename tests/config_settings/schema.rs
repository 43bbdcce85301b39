//! The JSON schema: the file in the repository, and its agreement with the program.
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::config_settings::program::Bench;
use crate::config_settings::{bench_config, toml_files};

#[test]
fn schema_file_is_current() {
    // To renew it: cargo run -- config schema > bench-config/schema.json
    let file = std::fs::read_to_string(bench_config().join("schema.json"))
        .expect("bench-config/schema.json");
    let answer = Bench::new().run("config schema");
    assert!(answer.json()["properties"]["plant"].is_object());
    assert!(
        answer.out == file,
        "bench-config/schema.json is out of date; the command above this line renews it"
    );
}

#[test]
fn json_schema_accepts_and_rejects_as_the_program_does() {
    let bench = Bench::new();
    let show = |options: &str| bench.json(&format!("config show {options}"));
    let mut documents: Vec<Value> = toml_files(&bench_config())
        .iter()
        .map(|path| show(&format!("--config {}", path.display())))
        .collect();
    let valid = documents.len();
    for (pointer, value) in [
        ("/loop/rate_hz", json!(0)),
        ("/plant/mass_asymmetry", json!("10%")),
        ("/plant/damping/kind", json!("foo")),
        ("/plant/model", json!("sr5dof")),
        ("/chirp/amplitude", json!([])),
        ("/loop/computing_delay_periods", json!(1.5)),
        (
            "/control/reference",
            json!({"kind": "step", "amplitude_m": 1e-5}),
        ),
    ] {
        let mut wrong = documents[0].clone();
        *wrong.pointer_mut(pointer).expect("a setting") = value;
        documents.push(wrong);
    }
    let mut unknown = documents[0].clone();
    unknown["plant"]["mass_asymetry"] = json!(0.1);
    documents.push(unknown);
    let Some(errors) = validated(&bench.run("config schema").json(), &documents) else {
        return;
    };
    for (index, found) in errors.iter().enumerate() {
        assert_eq!(
            found.as_array().expect("a list").is_empty(),
            index < valid,
            "document {index}: {found}"
        );
    }
}

/// The errors of Python's `jsonschema` in each document. Without the package: `None`, with the reason on standard error.
fn validated(schema: &Value, documents: &[Value]) -> Option<Vec<Value>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or("python3".into());
    let probe = Command::new(&python)
        .args(["-c", "import jsonschema"])
        .output();
    if !probe.as_ref().is_ok_and(|output| output.status.success()) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "Python is required here: {probe:?}"
        );
        eprintln!("not tested: {probe:?}\npip install jsonschema, or set BENCH_PYTHON");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/python/validate.py");
    let mut child = Command::new(&python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("has just run");
    let request = json!({"schema": schema, "documents": documents});
    serde_json::to_writer(child.stdin.take().expect("piped"), &request).expect("an open pipe");
    let output = child.wait_with_output().expect("an answer");
    assert!(output.status.success());
    Some(serde_json::from_slice(&output.stdout).expect("a JSON array"))
}

//! Independent reference values: `tests/python/truth.py`, with numpy, scipy and mpmath.
//!
//! `BENCH_PYTHON` names the interpreter (default `python3`). Without it or its packages a test prints a note and passes;
//! with `BENCH_REQUIRE_PYTHON=1`, as in CI, it fails.

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::Value;

/// The answers of `truth.py` to the questions, in their order. Without Python: `None`, with the reason on standard error.
pub fn ask(questions: &[Value]) -> Option<Vec<Value>> {
    ask_of("truth.py", questions)
}

/// The answers of a script in `tests/python`.
pub fn ask_of(script: &str, questions: &[Value]) -> Option<Vec<Value>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or("python3".into());
    if let Err(why) = available(&python, script) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "Python is required here: {why}"
        );
        eprintln!("not tested: {why}\npip install -r .ci/python-packages.txt, or set BENCH_PYTHON");
        return None;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../python")
        .join(script);
    let mut child = Command::new(&python)
        .arg(script)
        .env("OPENBLAS_NUM_THREADS", "1")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("has just run");
    let questions_json = serde_json::to_vec(questions).expect("JSON");
    // The script reads all of its input before it writes: neither side can block the other.
    child
        .stdin
        .take()
        .expect("piped")
        .write_all(&questions_json)
        .expect("an open pipe");
    let output = child.wait_with_output().expect("an answer");
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let answers: Vec<Value> = serde_json::from_slice(&output.stdout).expect("a JSON array");
    assert_eq!(answers.len(), questions.len());
    Some(answers)
}

fn available(python: &str, script: &str) -> Result<(), String> {
    let imports = match script {
        "export.py" => "import control, mcap_protobuf, pandas, pyarrow.parquet, pyuff, scipy",
        "tables.py" => "import pyarrow.parquet",
        "measured_margins.py" => "import control, numpy, scipy, mpmath, tomllib",
        _ => "import sys, tomllib, numpy, scipy, mpmath; assert numpy.trapezoid",
    };
    match Command::new(python).args(["-c", imports]).output() {
        Err(e) => Err(format!("{python}: {e}")),
        Ok(o) if !o.status.success() => Err(String::from_utf8_lossy(&o.stderr).into_owned()),
        Ok(_) => Ok(()),
    }
}

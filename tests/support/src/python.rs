//! Independent reference values from numpy and scipy. BENCH_PYTHON names the interpreter (default python3). Without scipy a
//! test passes without the comparison; with BENCH_REQUIRE_PYTHON=1 it fails.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// The numbers that a script of `tests/python` prints, line by line. Without scipy: `None`, with the reason on standard output.
pub fn numbers(script: &str, arguments: &[&str], input: &str) -> Option<Vec<Vec<f64>>> {
    numbers_with("scipy.signal, scipy.linalg", script, arguments, input)
}

/// As [`numbers`], for a script that needs other modules.
pub fn numbers_with(
    modules: &str,
    script: &str,
    arguments: &[&str],
    input: &str,
) -> Option<Vec<Vec<f64>>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or_else(|_| "python3".into());
    if let Err(why) = has_modules(&python, modules) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "{why}, but BENCH_REQUIRE_PYTHON=1: install them or name another interpreter in BENCH_PYTHON"
        );
        println!("not compared: {why}; install them or name another interpreter in BENCH_PYTHON");
        return None;
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../python")
        .join(script);
    let mut command = Command::new(&python);
    command
        .arg(path)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .env("PYTHONDONTWRITEBYTECODE", "1");
    let mut child = command.spawn().unwrap();
    child
        .stdin
        .take()
        .unwrap()
        .write_all(input.as_bytes())
        .unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(
        output.status.success(),
        "{script} failed: {}",
        output.status
    );
    let text = String::from_utf8(output.stdout).unwrap();
    Some(
        text.lines()
            .map(|line| {
                line.split_whitespace()
                    .map(|word| word.parse().unwrap())
                    .collect()
            })
            .collect(),
    )
}

fn has_modules(python: &str, modules: &str) -> Result<(), String> {
    let output = Command::new(python)
        .args(["-c", &format!("import {modules}")])
        .output();
    match output {
        Ok(output) if output.status.success() => Ok(()),
        Ok(_) => Err(format!("{python} does not have all of {modules}")),
        Err(error) => Err(format!("{python} does not start ({error})")),
    }
}

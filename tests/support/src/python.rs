//! Independent reference values from numpy and scipy. BENCH_PYTHON names the interpreter (default python3). Without scipy a
//! test passes without the comparison; with BENCH_REQUIRE_PYTHON=1 it fails.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// The numbers that a script of `tests/python` prints, line by line. Without scipy: `None`, with the reason on standard output.
pub fn numbers(script: &str, arguments: &[&str], input: &str) -> Option<Vec<Vec<f64>>> {
    let python = std::env::var("BENCH_PYTHON").unwrap_or_else(|_| "python3".into());
    if let Err(why) = scipy(&python) {
        assert!(
            std::env::var("BENCH_REQUIRE_PYTHON").as_deref() != Ok("1"),
            "{why}, but BENCH_REQUIRE_PYTHON=1: install scipy or name another interpreter in BENCH_PYTHON"
        );
        println!("not compared: {why}; install scipy or name another interpreter in BENCH_PYTHON");
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

fn scipy(python: &str) -> Result<(), String> {
    let output = Command::new(python)
        .args(["-c", "import scipy.signal, scipy.linalg"])
        .output();
    match output {
        Ok(output) if output.status.success() => Ok(()),
        Ok(_) => Err(format!("{python} has no scipy")),
        Err(error) => Err(format!("{python} does not start ({error})")),
    }
}

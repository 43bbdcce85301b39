//! External programs: scripts of `tests/python` with Python's canopen.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The script `name` on `interface`, with the Python of `.ci/run`.
pub fn script(name: &str, interface: &str) -> Command {
    let python = std::env::var_os("BENCH_PYTHON")
        .expect("BENCH_PYTHON: a python with .ci/python-packages.txt");
    let mut command = Command::new(python);
    command
        .arg(format!(
            "{}/tests/python/{name}",
            env!("CARGO_MANIFEST_DIR")
        ))
        .arg(interface);
    command
}

/// The drive of `canopen_drive.py`.
pub struct PythonDrive {
    process: Child,
    questions: ChildStdin,
    answers: BufReader<ChildStdout>,
}

impl PythonDrive {
    /// Starts the drive on the bus and waits until it is ready.
    pub fn new(interface: &str) -> PythonDrive {
        let mut command = script("canopen_drive.py", interface);
        let mut process = command
            .arg("5")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let questions = process.stdin.take().unwrap();
        let answers = BufReader::new(process.stdout.take().unwrap());
        let mut drive = PythonDrive {
            process,
            questions,
            answers,
        };
        assert_eq!(drive.answer(), "ready");
        drive
    }

    fn answer(&mut self) -> String {
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        line.trim().to_owned()
    }

    fn ask(&mut self, question: &str) -> String {
        writeln!(self.questions, "{question}").unwrap();
        self.answer()
    }

    /// State of the statusword (hexadecimal), followed target (per mille), NMT state.
    pub fn state(&mut self) -> String {
        self.ask("show")
    }

    /// Sends an emergency message and enters the state Fault.
    pub fn inject_fault(&mut self, code: u16) {
        self.ask(&format!("fault {code:x}"));
    }
}

impl Drop for PythonDrive {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

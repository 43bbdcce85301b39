//! `bench emulate` as a program: what it serves, reports and refuses. (The amplifier needs a CAN interface; it is tested in the
//! emulated machine of `.ci/vm`.)
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use bench_config::{Source, load};
use bench_hal::serial::SerialProbe;
use bench_hal::{DisplacementProbe, Reading, Tick, Validity};

/// A test that waits longer than this has failed.
const LIMIT: Duration = Duration::from_secs(60);

fn bench(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    command
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn refusal(arguments: &[&str]) -> String {
    let Output {
        status,
        stdout,
        stderr,
    } = bench(arguments).output().expect("it runs");
    let message = String::from_utf8_lossy(&stderr).into_owned();
    assert!(
        status.code() == Some(2) && stdout.is_empty(),
        "{arguments:?}: {status:?} {message}"
    );
    message
}

/// `bench emulate probe` with a link, a log, and commands on its standard input; killed if a test ends early.
struct Device {
    child: Option<Child>,
    folder: tempfile::TempDir,
}

impl Device {
    fn start(more: &[&str]) -> Device {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut command = bench(&["emulate", "probe", "--config", "lab", "--json"]);
        command.args(more).stdin(Stdio::piped());
        command
            .arg("--pty")
            .arg(folder.path().join("probe"))
            .arg("--log")
            .arg(folder.path().join("log"));
        let child = Some(command.spawn().expect("it starts"));
        let device = Device { child, folder };
        // The link of a device that serves for a short time may be gone again.
        device.until("serving", || !device.log().is_empty());
        device
    }

    fn child(&mut self) -> &mut Child {
        self.child.as_mut().expect("running")
    }

    fn link(&self) -> PathBuf {
        self.folder.path().join("probe")
    }

    fn until(&self, what: &str, mut condition: impl FnMut() -> bool) {
        let start = Instant::now();
        while !condition() {
            assert!(start.elapsed() < LIMIT, "never {what}: {:?}", self.log());
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    /// The complete lines of the log.
    fn log(&self) -> Vec<serde_json::Value> {
        let text = std::fs::read_to_string(self.folder.path().join("log")).unwrap_or_default();
        let complete = text.rsplit_once('\n').map_or("", |(complete, _)| complete);
        complete
            .lines()
            .map(|line| serde_json::from_str(line).expect("a JSON object a line"))
            .collect()
    }

    fn send(&mut self, line: &str) {
        let stdin = self.child().stdin.as_mut().expect("piped");
        writeln!(stdin, "{line}").expect("it listens");
    }

    fn signal(&mut self, signal: i32) {
        // SAFETY: a child of ours that was not waited for yet, so its id is not reused.
        let result = unsafe { libc::kill(self.child().id() as libc::pid_t, signal) };
        assert_eq!(result, 0);
    }

    /// Waits for its end; its one JSON object.
    fn end(&mut self) -> serde_json::Value {
        let output = self
            .child
            .take()
            .expect("running")
            .wait_with_output()
            .expect("a child of ours");
        assert_eq!(
            output.status.code(),
            Some(0),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        serde_json::from_slice(&output.stdout).expect("one JSON object")
    }

    /// A reader of the served probe, as `bench control` would open it.
    fn reader(&self) -> SerialProbe {
        self.reader_with(&[])
    }

    /// A reader with further settings.
    fn reader_with(&self, sets: &[String]) -> SerialProbe {
        let (port, locks) = (self.link(), self.folder.path());
        let line = [
            format!("probe.device.line.port={port:?}"),
            format!("probe.device.line.lock_folder={locks:?}"),
        ];
        let config = load(&Source {
            config: Some("lab".into()),
            sets: [sets, &line].concat(),
            ..Source::default()
        })
        .expect("the settings are valid");
        bench_rig::devices::probe::open(&config.probe, config.servo.priority)
            .expect("the probe is served")
    }

    fn faults(&self) -> Vec<String> {
        let log = self.log();
        let faults = log.iter().filter(|entry| entry["what"] == "fault");
        faults
            .map(|entry| entry["text"].as_str().expect("a text").to_string())
            .collect()
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if let Some(child) = self.child.as_mut() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn until(probe: &mut SerialProbe, what: &str, condition: impl Fn(&Reading) -> bool) -> Reading {
    let start = Instant::now();
    loop {
        let reading = probe.latest(Tick::default());
        if condition(&reading) {
            return reading;
        }
        assert!(
            start.elapsed() < LIMIT,
            "never {what}: {reading:?} {:?}",
            probe.statistics()
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn is_at_rest(reading: &Reading) -> bool {
    // The floor moves the stage by a tenth of a micrometre, the sensor by as much.
    reading.validity == Validity::Valid && reading.position_m.abs() < 3e-6
}

#[test]
fn successive_readers_read_the_position_of_the_stage() {
    let device = Device::start(&[]);
    for _ in 0..3 {
        until(&mut device.reader(), "at rest", is_at_rest);
    }
}

#[test]
fn serves_every_protocol_in_metres_of_the_stage() {
    let optoncdt = "{ kind = \"optoncdt\", sensor_range_m = 0.002, mounting = { gain = -1.0, offset_m = 0.001 }, line = { port = \"unused\", baud = 921600 } }";
    let ascii = "{ kind = \"ascii\", mounting = { gain = 1.0, offset_m = 0.0 }, pattern = \"{value:8.5}\", unit_m = 1e-3, lower_m = -1e-3, upper_m = 1e-3, line = { port = \"unused\", baud = 230400 } }";
    for probe in [optoncdt, ascii] {
        let set = format!("probe.device={probe}");
        let device = Device::start(&["--set", &set]);
        until(&mut device.reader_with(&[set]), "at rest", is_at_rest);
    }
}

#[test]
fn planned_and_typed_faults_take_effect_and_are_logged() {
    let mut device = Device::start(&["--fault", "probe.out-of-range@0..0.2"]);
    let mut reader = device.reader();
    device.until("past the planned fault", || device.faults().len() == 2);
    until(&mut reader, "at rest", is_at_rest);
    device.send("fault out-of-range");
    until(&mut reader, "out of range", |reading| {
        reading.validity == Validity::OutOfRange
    });
    device.send("fault nonsense");
    device.send("fault none");
    until(&mut reader, "at rest", is_at_rest);
    device.send("quit");
    let summary = device.end();
    assert_eq!(summary["faults"], 2);
    assert!(
        summary["measurements"].as_u64() > Some(0) && summary["bytes_sent"].as_u64() > Some(0),
        "{summary}"
    );
    assert_eq!(
        device.faults(),
        [
            "probe.out-of-range",
            "end of probe.out-of-range",
            "probe.out-of-range",
            "none"
        ]
    );
    let first = &device.log()[0];
    let place = first["text"].as_str().expect("a text");
    assert!(
        first["what"] == "serving" && place.contains("capancdt on /dev/pts/"),
        "{first}"
    );
    assert!(
        device
            .log()
            .windows(2)
            .all(|pair| pair[0]["time_s"].as_f64() <= pair[1]["time_s"].as_f64())
    );
}

#[test]
fn bytes_that_are_not_utf_8_do_not_end_the_reading_of_commands() {
    let mut device = Device::start(&[]);
    let stdin = device.child().stdin.as_mut().expect("piped");
    stdin.write_all(b"\xff\xfe\n").expect("it listens");
    // A line without an end for longer than a command may be.
    stdin.write_all(&[b'x'; 10_000]).expect("it listens");
    device.send("");
    device.send("quit");
    assert_eq!(device.end()["faults"], 0);
}

#[test]
fn signal_or_duration_ends_the_emulator_and_removes_the_link() {
    for signal in [Some(libc::SIGTERM), Some(libc::SIGINT), None] {
        let mut device = Device::start(if signal.is_some() {
            &[]
        } else {
            &["--duration", "0.2"]
        });
        let link = device.link();
        signal.into_iter().for_each(|signal| device.signal(signal));
        device.end();
        assert!(!link.is_symlink());
    }
}

#[test]
fn prints_the_path_of_the_terminal_without_a_link() {
    let mut child = bench(&["emulate", "probe", "--config", "lab", "--duration", "60"])
        .spawn()
        .expect("it starts");
    let line = BufReader::new(child.stderr.take().expect("piped"))
        .lines()
        .next()
        .expect("a line")
        .expect("text");
    child.kill().expect("running");
    child.wait().expect("a child of ours");
    assert!(line.contains("capancdt on /dev/pts/"), "{line}");
}

/// The refusal of `bench emulate` with these options.
fn emulate_refusal(options: &str) -> String {
    let arguments: Vec<&str> = ["emulate"]
        .into_iter()
        .chain(options.split_whitespace())
        .collect();
    refusal(&arguments)
}

#[test]
fn rejects_invalid_options_before_serving() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let existing = folder.path().join("existing");
    std::fs::write(&existing, "").expect("a file");
    let with_existing = format!("probe --config lab --pty {}", existing.display());
    let cases = [
        ("probe", "--config lab"),
        ("", "amplifier|probe"),
        ("stage --config lab", "amplifier"),
        ("probe --config lab --port /dev/ttyNONE9", "no such port"),
        ("probe --config lab --interface vcan0", "amplifier"),
        (
            "probe --config lab --measuring-rate 0",
            "--measuring-rate is 0 Hz; give a rate from 0.1 to 1000000 Hz",
        ),
        ("probe --config lab --measuring-rate 1e12", "is 1e12 Hz"),
        ("probe --config lab --fault probe.stuck", "KIND@FROM..TO"),
        ("probe --config lab --fault probe.x@1", "there is no fault"),
        (
            "probe --config lab --fault amplifier.reset@1",
            "no amplifier",
        ),
        (
            "probe --config lab --log /nonexistent/log",
            "/nonexistent/log",
        ),
        (&with_existing, "it exists"),
    ];
    for (options, reason) in cases {
        let message = emulate_refusal(options);
        assert!(message.contains(reason), "{options}: {message}");
    }
    let missing = emulate_refusal("amplifier --config lab --interface no-such-can");
    assert!(
        missing.contains("no-such-can") && missing.contains("vcan0"),
        "{missing}"
    );
}

//! Benchmark of a tick: `cargo bench --bench loop` prints the time of one tick, and of the whole command.
//!
//! Required: below 250 ns for interlocks and fast controller alone, below 1 us with the simulated rig and the record,
//! below 2 s for `bench chirp` as a whole (120 s at 5 kHz, analysis and plot included). `benches/loop.c`, compiled with
//! `cc -O2`, is the same plant, noise and controller without anything else: at most twice its time without a recording, six times with
//! one.

use std::hint::black_box;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bench_config::{Config, ControlSettings, Source, load};
use bench_control::{Controller, ControllerText};
use bench_experiment::{Plan, residuals, rig_model};
use bench_hal::{Reading, Tick, Validity};
use bench_recording::{DiskWatch, Header, Recorder};
use bench_rig::simulated::SimulatedRig;
use bench_rt::clock::Virtual;
use bench_rt::interlock::Interlocks;
use bench_rt::live_loop::run_to_end;
use bench_rt::program::Decision;
use bench_rt::publisher::Publisher;
use bench_rt::record::LoopMessage;
use bench_rt::request::RequestSender;
use bench_rt::residual::Residuals;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use criterion::{Criterion, criterion_group, criterion_main};
use rtrb::{Consumer, RingBuffer};

fn stage() -> Config {
    load(&Source::default()).expect("the default profile is valid")
}

/// Reading and command past the interlocks, error through the fast controller.
fn check_and_control(c: &mut Criterion) {
    time_checks(c, "tick: check + fast controller", None);
    let plan = Plan::control(Config {
        control: fast(),
        ..stage()
    });
    let residuals = residuals(&plan.expect("embedded")).expect("a model");
    assert!(residuals.is_some(), "the monitor is on by default");
    time_checks(c, "tick: check + residuals + fast controller", residuals);
}

fn fast() -> ControlSettings {
    ControlSettings {
        controller: "fast".into(),
        ..stage().control
    }
}

fn time_checks(c: &mut Criterion, name: &str, residuals: Option<Residuals>) {
    let config = stage();
    let sections = ControllerText::find("fast")
        .and_then(|text| text.sections(5000.0))
        .expect("embedded");
    let controller = Controller::new(&sections, 2e-4);
    let mut state = controller.at_rest();
    let mut interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    )
    .with_residuals(residuals);
    interlocks.begin_run();
    let mut number = 0;
    c.bench_function(name, |b| {
        b.iter(|| {
            number += 1;
            let position_m = if number % 2 == 0 { 30e-9 } else { -30e-9 };
            let reading = Reading {
                position_m,
                sequence: number,
                age_ns: 0,
                validity: Validity::Valid,
            };
            let now = Tick {
                number,
                scheduled_ns: number * 200_000,
            };
            let checked = interlocks.check_reading(black_box(&reading), now);
            let moves = interlocks.check_motion(position_m, 0);
            let command_a = controller.update(&mut state, -reading.position_m);
            let passed = interlocks.check_command(command_a);
            interlocks.record_current(command_a, command_a);
            let decision = Decision {
                requested_a: command_a,
                active: true,
                ..Decision::default()
            };
            interlocks.record_motion(&decision, 1.0, command_a);
            black_box((checked.is_ok(), moves.is_ok(), passed.is_ok(), command_a))
        });
    });
}

/// Ticks of a run: two minutes, so that opening and closing the file do not count.
const TICKS: u64 = 600_000;

/// The whole loop as `bench chirp` and `bench control` run it: simulated rig, interlocks, program, ring, recorder.
fn rig_and_record(c: &mut Criterion) {
    let mut group = c.benchmark_group("tick: rig + loop + record");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(8));
    let mut config = stage();
    config.control.duration_s = TICKS as f64 / config.servo.rate_hz;
    let plans = [
        ("chirp", Plan::chirp(config.clone())),
        ("fast", Plan::control(config.clone()).expect("embedded")),
    ];
    for (name, plan) in plans {
        for (target, run) in RUNS {
            group.bench_function(format!("{name}, {target}"), |b| {
                b.iter_custom(|ticks| {
                    let (elapsed, served) = run(&config, &plan);
                    elapsed.mul_f64(ticks as f64 / served as f64)
                });
            });
        }
    }
    let folder = tempfile::tempdir().expect("temporary folder");
    let program = folder.path().join("loop");
    if compiled(&program) {
        let input = input_in_c(&config);
        group.bench_function("fast, in C", |b| {
            b.iter_custom(|ticks| {
                seconds_in_c(&program, &input).mul_f64(ticks as f64 / TICKS as f64)
            });
        });
    }
    group.finish();
}

/// Compiles `loop.c`; `false` without a compiler.
fn compiled(program: &Path) -> bool {
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/loop.c");
    let mut compiler = Command::new("cc");
    compiler
        .args(["-O2", "-o"])
        .arg(program)
        .args([source, "-lm"]);
    compiler.status().is_ok_and(|status| status.success())
}

/// The input of `loop.c`.
fn input_in_c(config: &Config) -> String {
    let plant = rig_model(config).expect("valid");
    let mut numbers = vec![TICKS as f64, plant.lag, plant.modes.len() as f64];
    for mode in &plant.modes {
        numbers.extend(mode.a.as_flattened());
        numbers.extend([mode.current, mode.setpoint, mode.force].as_flattened());
        numbers.extend([mode.output, mode.floor]);
    }
    numbers.push(config.sim.floor.len() as f64);
    for line in &config.sim.floor {
        let rms = line.acceleration_rms_m_per_s2;
        numbers.extend([line.frequency_hz, line.damping_ratio, rms, plant.period_s]);
    }
    numbers.extend([
        config.sim.probe_noise_rms_m,
        config.sim.probe_quantisation_m,
    ]);
    let sections = ControllerText::find("fast")
        .and_then(|text| text.sections(config.servo.rate_hz))
        .expect("embedded");
    numbers.push(sections.len() as f64);
    for section in sections {
        // x+ = A x + B u, y = C x + D u of the transposed direct form II.
        let (a, b, _, b0) = section.tustin(plant.period_s).state_space();
        let (a1, a2) = (-a[(0, 0)], -a[(1, 0)]);
        numbers.extend([b0, b[0] + a1 * b0, b[1] + a2 * b0, a1, a2]);
    }
    let texts: Vec<String> = numbers.iter().map(f64::to_string).collect();
    texts.join(" ")
}

fn seconds_in_c(program: &Path, input: &str) -> Duration {
    let mut child = Command::new(program);
    let child = child.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let mut child = child.expect("runs");
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(input.as_bytes()).expect("reads its input");
    drop(stdin);
    let output = child.wait_with_output().expect("ends");
    let text = String::from_utf8(output.stdout).expect("text");
    let mut numbers = text.split_whitespace().map(|number| number.parse());
    let (Some(Ok(seconds)), Some(Ok(position_m))) = (numbers.next(), numbers.next()) else {
        panic!("not two numbers: {text}");
    };
    assert!(
        f64::abs(position_m) < 1e-3,
        "the loop is stable: {position_m}"
    );
    Duration::from_secs_f64(seconds)
}

/// A run that returns its time and its ticks.
type Run = fn(&Config, &Plan) -> (Duration, u64);

const RUNS: [(&str, Run); 2] = [("not recorded", unrecorded_run), ("recorded", recorded_run)];

/// A run whose ring nobody reads.
fn unrecorded_run(config: &Config, plan: &Plan) -> (Duration, u64) {
    let (mut servo, consumer) = started(config, plan);
    drop(consumer);
    let start = Instant::now();
    run_to_end(
        &mut servo,
        Virtual {
            period_s: config.servo.period_s(),
        },
    );
    assert!(servo.run().outcome().completed);
    (start.elapsed(), TICKS)
}

/// A run, the last record written.
fn recorded_run(config: &Config, plan: &Plan) -> (Duration, u64) {
    let folder = tempfile::tempdir().expect("temporary folder");
    let header = Header {
        period_s: 2e-4,
        started_ns: 0,
        ..Header::default()
    };
    let path = folder.path().join("bench.mcap");
    let recorder = Recorder::create(&path, &header).expect("temporary file");
    let (mut servo, consumer) = started(config, plan);
    let predicted_bytes = bench_recording::predicted_bytes(u64::MAX);
    let disk = DiskWatch::of(&path, predicted_bytes).expect("the file of the recording");
    let recorder = bench_recording::spawn(recorder, consumer, disk, None).expect("a thread");
    let start = Instant::now();
    run_to_end(
        &mut servo,
        Virtual {
            period_s: config.servo.period_s(),
        },
    );
    let ended = servo.run().outcome();
    drop(servo); // the recorder receives its end
    let mut recorder = recorder.join().expect("a whole recording");
    let ticks = recorder.complete().expect("a whole recording").ticks;
    assert!(ended.completed);
    (start.elapsed(), ticks)
}

/// A loop with its orders to run, and the other end of its ring.
fn started(config: &Config, plan: &Plan) -> (Servo, Consumer<LoopMessage>) {
    let (producer, consumer) = RingBuffer::new(1 << 16);
    let (mut requests, taken) = RequestSender::ring(4);
    let (retired, _kept) = RingBuffer::new(4);
    let progress = Arc::new(Progress::default());
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(producer),
        progress,
    };
    let rig = Box::new(SimulatedRig::new(config).expect("valid"));
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    let run = ServoRun::new(interlocks, connections);
    let servo = Servo::new(rig, Box::new(run), config.servo.period_s());
    for order in [Request::Arm, Request::Start(plan.program().expect("valid"))] {
        assert!(requests.send(order).is_ok());
    }
    (servo, consumer)
}

/// The whole command, as typed.
fn whole_command(c: &mut Criterion) {
    let mut group = c.benchmark_group("command");
    group
        .sample_size(10)
        .measurement_time(Duration::from_secs(20));
    group.bench_function("bench chirp", |b| {
        b.iter_custom(|times| {
            let folder = tempfile::tempdir().expect("temporary folder");
            let start = Instant::now();
            for _ in 0..times {
                let done = Command::new(env!("CARGO_BIN_EXE_bench"))
                    .args(["chirp", "--json"])
                    .current_dir(&folder)
                    .output();
                assert!(done.expect("runs").status.success());
            }
            start.elapsed()
        });
    });
    group.finish();
}

criterion_group!(benches, check_and_control, rig_and_record, whole_command);
criterion_main!(benches);

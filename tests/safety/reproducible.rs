//! The same seed and settings give the same run, bit for bit, on any machine.
use std::path::{Path, PathBuf};

use bench_config::{Config, Sweep};
use bench_experiment::Plan;
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;

use crate::safety::rig::stage;

fn control(controller: &str, seed: u64) -> Plan {
    let mut config = stage();
    config.control.controller = controller.into();
    config.control.duration_s = 2.0;
    config.sim.seed = seed;
    Plan::control(config).expect("a plan")
}

fn chirp(sweep: Sweep, seed: u64) -> Plan {
    let mut config: Config = stage();
    (config.chirp.sweep, config.chirp.duration_s, config.sim.seed) = (sweep, 2.0, seed);
    (
        config.chirp.quiet_before_s,
        config.chirp.quiet_after_s,
        config.chirp.fade_in_s,
    ) = (0.1, 0.1, 0.5);
    config.chirp.amplitude.truncate(1);
    Plan::chirp(config)
}

fn digest(plan: &Plan) -> u64 {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = Box::new(SimulatedRig::new(&plan.config).expect("a rig"));
    let run = bench_experiment::run(plan, rig, Pace::Virtual, folder.path(), &mut |_, _| {})
        .expect("a run");
    assert!(run.end.servo.completed, "{:?}", run.end.servo);
    run.finish("{}").expect("a good disk").loop_digest
}

#[test]
fn same_seed_gives_identical_run_and_other_seed_does_not() {
    let plans: [fn(u64) -> Plan; 4] = [
        |seed| control("fast", seed),
        |seed| control("slow", seed),
        |seed| chirp(Sweep::Linear, seed),
        |seed| chirp(Sweep::Logarithmic, seed),
    ];
    let mut all = Vec::new();
    for plan in plans {
        let first = digest(&plan(1));
        assert_eq!(first, digest(&plan(1)));
        all.extend([first, digest(&plan(2))]);
    }
    let distinct: std::collections::BTreeSet<u64> = all.iter().copied().collect();
    assert_eq!(distinct.len(), all.len(), "{all:x?}");
}

#[test]
fn two_second_run_has_the_reference_digest() {
    // A stored value; `bench control --fast --duration 2 --seed 1 --json` prints it as `loop_digest`. It is the same on any
    // x86-64 or ARM machine, because the path from the settings to a command calls no function of the platform's libm (checked
    // by the test below) and sums have a fixed order. It depends on the profile `stage`, the simulated rig, the controller,
    // the fields of a tick and the texts of the events. After an intended change of one of them, put the new value here.
    assert_eq!(
        format!("{:016x}", digest(&control("fast", 1))),
        "c9092a51c497ccd1"
    );
}

/// The modules from the settings to a command.
const COMMAND_PATH: [&str; 20] = [
    "crates/rt/src",
    "crates/rig/src/simulated",
    "crates/excitation/src",
    "crates/control/src/biquad.rs",
    "crates/control/src/section.rs",
    "crates/control/src/controller.rs",
    "crates/control/src/file.rs",
    "crates/control/src/law.rs",
    "crates/control/src/laws",
    "crates/control/src/state_space.rs",
    "crates/plant/src/discrete.rs",
    "crates/plant/src/matrix_exponential.rs",
    "crates/plant/src/modes.rs",
    "crates/plant/src/linear_algebra.rs",
    "crates/plant/src/beam.rs",
    "crates/plant/src/coordinate.rs",
    "crates/plant/src/sr4dof.rs",
    "crates/plant/src/xy.rs",
    "crates/plant/src/lumped.rs",
    "crates/plant/src/quadratic.rs",
];

/// Functions of `f64` whose last bit depends on the platform; `sqrt`, `abs`, `floor` and `round` are exact.
const PLATFORM_FUNCTIONS: [&str; 28] = [
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
    "asinh", "acosh", "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10",
    "powf", "powi", "hypot", "cbrt", "arg", "to_polar",
];

/// The modules whose code runs in a tick. Folders as a whole, so that a new file is among them.
const TICK: [&str; 8] = [
    "crates/rt/src",
    "crates/rig/src/simulated",
    "crates/excitation/src",
    "crates/control/src/biquad.rs",
    "crates/control/src/controller.rs",
    "crates/control/src/law.rs",
    "crates/control/src/laws",
    "crates/control/src/state_space.rs",
];

/// Words of [`NOT_IN_A_TICK`] that a file may have, because it uses them before the first tick.
const EXCEPTIONS: [(&str, &[&str]); 2] = [
    // The error of a thread that the system refuses.
    ("crates/rt/src/live_loop.rs", &["std::io"]),
    // The file that keeps the idle states of the processor off.
    ("crates/rt/src/thread.rs", &["std::fs", "std::io"]),
];

/// Words of locks, prints and files, which must not be in the modules of the tick. `tests/tick_does_not_allocate` covers
/// allocations and system calls.
const NOT_IN_A_TICK: [&str; 9] = [
    "Mutex",
    "RwLock",
    "Condvar",
    "println!",
    "print!",
    "eprintln!",
    "dbg!",
    "std::fs",
    "std::io",
];

/// The code of a file, or of all files in a folder and its folders, without tests.
fn sources(of: &str) -> Vec<(String, String)> {
    let mut files = Vec::new();
    collect(&Path::new(env!("CARGO_MANIFEST_DIR")).join(of), &mut files);
    files.into_iter().map(code_of).collect()
}

fn collect(path: &Path, files: &mut Vec<PathBuf>) {
    let is_test = path.ends_with("tests.rs") || path.ends_with("test_profile.rs");
    if path.is_dir() {
        for entry in std::fs::read_dir(path).expect("a folder") {
            collect(&entry.expect("an entry").path(), files);
        }
    } else if path.extension().is_some_and(|e| e == "rs") && !is_test {
        files.push(path.into());
    }
}

/// Path and code of a file before its tests.
fn code_of(file: PathBuf) -> (String, String) {
    let text = std::fs::read_to_string(&file).expect("text");
    let code = text.split("#[cfg(test)]").next().unwrap_or_default();
    (file.display().to_string(), code.to_string())
}

fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
}

#[test]
fn command_path_calls_no_platform_libm() {
    for (file, text) in COMMAND_PATH.iter().flat_map(|of| sources(of)) {
        for (number, line) in lines(&text) {
            for name in PLATFORM_FUNCTIONS {
                let called = [format!(".{name}("), format!("f64::{name}(")]
                    .iter()
                    .any(|call| line.contains(call.as_str()));
                assert!(!called, "{file}:{}: use libm: {line}", number + 1);
            }
        }
    }
    // nalgebra must use libm too, and must not select kernels for products by the processor.
    let manifest =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml"))
            .expect("a manifest");
    let nalgebra = manifest
        .lines()
        .find(|line| line.starts_with("nalgebra"))
        .expect("a dependency");
    assert!(
        nalgebra.contains("default-features = false") && nalgebra.contains("libm-force"),
        "{nalgebra}"
    );
    assert!(!nalgebra.contains("\"std\""), "{nalgebra}");
}

#[test]
fn tick_code_contains_no_lock_print_or_file_access() {
    for (file, text) in TICK.iter().flat_map(|of| sources(of)) {
        let exception = EXCEPTIONS.iter().find(|(of, _)| file.ends_with(of));
        let allowed = exception.map_or(&[][..], |(_, words)| words);
        for (number, line) in lines(&text) {
            let mut words = NOT_IN_A_TICK.iter().filter(|word| !allowed.contains(word));
            let found = words.find(|word| line.contains(**word));
            assert!(found.is_none(), "{file}:{}: {line}", number + 1);
        }
    }
}

#[test]
fn every_exception_of_the_tick_is_needed() {
    for (of, words) in EXCEPTIONS {
        let sources = sources(of);
        for word in words {
            let mut texts = sources.iter().flat_map(|(_, text)| lines(text));
            assert!(texts.any(|(_, line)| line.contains(word)), "{of}: {word}");
        }
    }
}

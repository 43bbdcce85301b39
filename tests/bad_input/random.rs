//! Random settings, options and files: no command panics, ends by a signal or hangs, and every refusal has a message.
//!
//! `BENCH_RANDOM_CASES` sets the number of cases of each test, `BENCH_RANDOM_SEED` their seed; a failing case prints its
//! arguments.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::bad_input::program::{Answer, Bench};

/// Whether the answer is that of `bench margins` for an unstable loop: exit code 1 and `"stable": false`.
fn is_unstable(answer: &Answer) -> bool {
    answer.code == 1 && answer.json()["stable"] == false
}

/// The number in an environment variable.
fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

/// A fixed seed, so that the cases are the same in every run. A call takes about 10 ms.
fn cases(cases: u32) -> ProptestConfig {
    let seed = number("BENCH_RANDOM_SEED").unwrap_or(20_061_009);
    let chosen = number("BENCH_RANDOM_CASES").and_then(|cases| u32::try_from(cases).ok());
    let cases = chosen.unwrap_or(cases);
    eprintln!("{cases} cases with the seed {seed}");
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(seed),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// A valid or nearly valid key of the configuration.
fn key() -> impl Strategy<Value = String> {
    let keys = include_str!("../../bench-config/stage.toml")
        .lines()
        .filter_map(|line| {
            let key = line.split(['=', '#']).next()?.trim().to_string();
            (!key.is_empty() && !key.contains(['{', '}']))
                .then(|| key.trim_matches(['[', ']']).to_string())
        });
    let tables = [
        "loop",
        "plant",
        "plant.damping",
        "motor",
        "amplifier",
        "probe",
        "interlock",
        "sim",
        "identify",
    ];
    let joined = (
        proptest::sample::select(tables.to_vec()),
        proptest::sample::select(keys.collect::<Vec<_>>()),
    )
        .prop_map(|(table, key)| format!("{table}.{key}"));
    prop_oneof![6 => joined, 1 => "[a-z.]{0,12}", 1 => Just("plant.damping".to_string())]
}

/// A valid or invalid value.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => (-12i32..14, -1.0..1.0f64).prop_map(|(power, x)| format!("{:?}", x * 10f64.powi(power))),
        2 => any::<i64>().prop_map(|n| n.to_string()),
        1 => proptest::sample::select(vec!["nan", "inf", "-inf", "true", "[]", "{}", "\"\"", "[[]]", "1e308", "-0.0"])
            .prop_map(str::to_string),
        1 => proptest::sample::select(vec![
            "{kind=\"uniform\",ratio=0.0}", "{kind=\"uniform\",ratio=0.99}", "{kind=\"rayleigh\",mass_per_s=1e6,stiffness_s=1.0}",
            "{kind=\"measured\",first={omega_rad_s=10.0,ratio=0.1},second={omega_rad_s=10.0,ratio=0.2}}",
        ]).prop_map(str::to_string),
        1 => ".{0,20}",
    ]
}

/// Commands that end within a second, and options with a value. `TABLE` stands for a random CSV file.
const COMMANDS: [(&str, &[&str]); 14] = [
    (
        "chirp --plan --set chirp.duration_s=1.0",
        &[
            "--start",
            "--stop",
            "--amplitude",
            "--excitation",
            "--shape",
            "--sweep",
            "--seed",
        ],
    ),
    (
        "control --duration 20ms --set control.settle_s=0.01 --set control.steady_after_s=0.0",
        &[
            "--reference",
            "--amplitude",
            "--frequency",
            "--speed",
            "--controller",
            "--operating-point",
            "--asymmetry",
            "--seed",
        ],
    ),
    (
        "identify TABLE --input x --output y",
        &[
            "--rate",
            "--time",
            "--period",
            "--skip-periods",
            "--band",
            "--reference",
        ],
    ),
    ("identify TABLE --time t", &["--input", "--output"]),
    (
        "linearity --stop 4kHz",
        &["--scales", "--amplitude", "--seed"],
    ),
    (
        "margins",
        &[
            "--controller",
            "--operating-point",
            "--asymmetry",
            "--config",
        ],
    ),
    (
        "model modes",
        &["--operating-point", "--asymmetry", "--config"],
    ),
    ("model bounds", &["--alpha", "--peak", "--bandwidth"]),
    ("model step", &["--duration", "--count"]),
    (
        "model critical-damping",
        &["--ratio", "--omega-u", "--omega-v"],
    ),
    (
        "model locus --vary plant.mass_asymmetry --count 3",
        &["--from", "--to", "--vary"],
    ),
    (
        "model placement --from 1% --to 2%",
        &["--sensor", "--actuator", "--modes"],
    ),
    (
        "emulate probe --config lab --duration 5ms",
        &["--measuring-rate", "--fault", "--seed", "--port"],
    ),
    ("config show", &["--set", "--config", "--operating-point"]),
];

/// A command with up to three of its options, each with a random value.
fn command_line() -> impl Strategy<Value = Vec<String>> {
    let values = proptest::collection::vec((0usize..20, option_value()), 0..4);
    (0..COMMANDS.len(), values).prop_map(|(command, values)| {
        let (command, options) = COMMANDS[command];
        let options = values
            .into_iter()
            .map(|(option, value)| format!("{}={value}", options[option % options.len()]));
        command
            .split(' ')
            .map(str::to_string)
            .chain(options)
            .collect()
    })
}

/// A number, a quantity, a word of the command line, or any text.
fn option_value() -> impl Strategy<Value = String> {
    let units = [
        "", "Hz", "kHz", "um", "mm", "m", "A", "s", "ms", "%", "rad/s", "mm/s",
    ];
    let words = [
        "step",
        "hold",
        "sine",
        "prbs",
        "fast",
        "model",
        "lab",
        "x",
        "y",
        "t",
        "0",
        "-1",
        "nan",
        "1e999",
        "1:2",
        "5:200",
        "1,2",
        "0.5,1",
        "x1",
        "x1=1,y2=-1",
        "probe.silence@0s",
        "probe.out-of-range@1s..0s",
        "/dev/null",
        "TABLE",
        "loop.rate_hz=1e3",
    ];
    prop_oneof![
        4 => (value(), proptest::sample::select(units.to_vec())).prop_map(|(value, unit)| value + unit),
        3 => proptest::sample::select(words.to_vec()).prop_map(str::to_string),
        1 => ".{0,20}",
    ]
}

/// A table of 100 samples of which one cell is random.
fn table() -> impl Strategy<Value = String> {
    (0usize..303, value()).prop_map(|(place, value)| {
        let cell = |k: usize| match (k == place, k) {
            (true, _) => value.clone(),
            (false, 0..3) => ["t", "x", "y"][k].to_string(),
            (false, _) if k.is_multiple_of(3) => format!("{:.3}", k as f64 / 3000.0),
            (false, _) => format!("{:.6}", f64::sin(0.7 * (k * k) as f64)),
        };
        let rows = (0..101).map(|row| {
            format!(
                "{},{},{}\n",
                cell(3 * row),
                cell(3 * row + 1),
                cell(3 * row + 2)
            )
        });
        rows.collect()
    })
}

/// A text with some of its bytes replaced, removed or inserted.
fn damaged(text: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let change = (
        0..text.len(),
        0usize..12,
        proptest::collection::vec(any::<u8>(), 0..4),
    );
    proptest::collection::vec(change, 1..4).prop_map(move |changes| {
        let mut bytes = text.as_bytes().to_vec();
        for (at, length, new) in changes {
            let at = at.min(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes.splice(at..end, new);
        }
        bytes
    })
}

proptest! {
    #![proptest_config(cases(150))]

    #[test]
    fn no_setting_causes_a_panic(sets in proptest::collection::vec((key(), value()), 1..5)) {
        let bench = Bench::new();
        let sets: Vec<String> = sets.iter().map(|(key, value)| format!("--set={key}={value}").replace('\0', " ")).collect();
        for command in ["config show", "model modes", "margins --fast", "margins --slow --continuous"] {
            let arguments = command.split(' ').map(str::to_string).chain(sets.clone()).chain(["--json".to_string()]);
            let answer = bench.run_with(arguments);
            prop_assert!([0, 2].contains(&answer.code) || is_unstable(&answer), "{sets:?}: {answer:?}");
            if answer.code == 0 {
                answer.json();
            }
        }
        let short = ["--duration=0.02", "--set=control.settle_s=0.01", "--set=control.steady_after_s=0.0"].map(str::to_string);
        bench.run_with(["control".to_string()].into_iter().chain(sets).chain(short));
    }

    #[test]
    fn no_option_causes_a_panic(arguments in command_line(), table in table()) {
        let bench = Bench::new();
        bench.write("TABLE", table);
        let arguments: Vec<String> = arguments.iter().map(|text| text.replace('\0', " ")).collect();
        let answer = bench.run_with(&arguments);
        prop_assert!((0..=3).contains(&answer.code), "{arguments:?}: {answer:?}");
        // A loop that is unstable and a run that trips are results, not errors.
        let has_result = answer.code != 2 && !answer.out.is_empty();
        prop_assert!(answer.code == 0 || has_result || !answer.err.trim().is_empty(), "{arguments:?}: {answer:?}");
    }

    #[test]
    fn no_file_causes_a_panic(
        noise in proptest::collection::vec(any::<u8>(), 0..200),
        profile in damaged(include_str!("../../bench-config/stage.toml")),
        controller in damaged(include_str!("../../bench-config/controllers/fast.toml")),
        reference in damaged("time_s,reference_m\n0,0\n0.01,1e-6\n0.02,-2e-6\n0.5,3e-6\n"),
    ) {
        let bench = Bench::new();
        bench.write("noise", &noise);
        bench.write("profile", &profile);
        bench.write("controller", &controller);
        bench.write("reference", &reference);
        for file in ["noise", "profile"] {
            bench.run(&format!("config check --config {file}"));
        }
        for file in ["noise", "controller"] {
            bench.run(&format!("margins --controller {file}"));
        }
        for file in ["noise", "reference"] {
            bench.run(&format!("control --duration 0.02 --set control.settle_s=0.01 --reference {file}"));
        }
        let recording = bench.run("identify noise");
        prop_assert!([1, 2].contains(&recording.code));
    }
}

//! Random settings and random files: no command panics.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use crate::program::{Answer, Bench};

/// Whether the answer is that of `bench margins` for an unstable loop: exit code 1 and `"stable": false`.
fn is_unstable(answer: &Answer) -> bool {
    answer.code == 1 && answer.json()["stable"] == false
}

/// A fixed seed, so that the cases are the same in every run. A call takes about 10 ms.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20_061_009),
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

//! Whatever it is fed, the program answers with an exit code and a sentence: it never panics, dies or hangs.
//!
//! `program::run_in` asserts that of every single call; the tests below say what the sentence must hold.

use bench_test_support::program;

use std::path::Path;

use program::{Answer, Bench};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

#[test]
fn flags_out_of_reason_are_refused_with_value_and_limit() {
    let cases: &[(&str, &[&str])] = &[
        (
            "margins --set loop.rate_hz=0",
            &["`loop.rate_hz` is 0", "1 to 100000"],
        ),
        (
            "model modes --set plant.motion_stage_mass_kg=-1",
            &["is -1", "0.000001 to 1000"],
        ),
        (
            "chirp --start 5 --stop 5",
            &["--stop 5 is 5 Hz", "starts at 5 Hz"],
        ),
        (
            "chirp --start -1",
            &["--start -1 is -1 Hz", "0.0001 to 50000 Hz"],
        ),
        ("chirp --stop 3000", &["--stop 3000 is 3000 Hz", "2500 Hz"]),
        (
            "chirp --amplitude 100",
            &["100.0", "9.982 A", "the motor's peak current"],
        ),
        (
            "chirp --amplitude 9.98 --set amplifier.current_limit_a=5",
            &["9.98", "5.000 A", "the amplifier's limit"],
        ),
        ("chirp --amplitude 8", &["A/s", "20000 A/s"]),
        ("chirp --amplitude 3.5", &["thermal current", "2.338 A"]),
        ("chirp --amplitude 0.3", &["travel", "900 um"]),
        (
            "chirp --amplitude 0",
            &["--amplitude 0 is 0 A", "to 1000 A"],
        ),
        (
            "chirp --amplitude -1",
            &["--amplitude -1 is -1 A", "to 1000 A"],
        ),
        ("chirp --amplitude garbage", &["garbage", "--amplitude"]),
        (
            "chirp --sweep sideways",
            &["sideways", "linear, logarithmic"],
        ),
        (
            "chirp --duration 0",
            &["--duration 0 is 0 s", "0.001 to 100000 s"],
        ),
        ("chirp --duration -5", &["--duration -5 is -5 s"]),
        ("control --duration -5", &["--duration -5 is -5 s"]),
        ("control --amplitude garbage", &["`garbage`", "50um"]),
        ("control --reference step --amplitude 5%", &["`5%`", "50um"]),
        (
            "control --reference step --amplitude 10m",
            &["is 10", "-1 to 1"],
        ),
        (
            "control --reference sine --frequency 2500",
            &["2500 Hz", "half the servo rate"],
        ),
        (
            "control --reference ramp --speed -1e-4",
            &["--speed -1e-4 is -0.0001 m/s"],
        ),
        (
            "control --reference hold --amplitude 5um",
            &["--amplitude", "step, ramp, sine or chirp"],
        ),
        (
            "control --reference step --frequency 5",
            &["--frequency", "sine"],
        ),
        ("control --speed 1e-5", &["--speed", "ramp"]),
        (
            "control --reference nosuch.csv",
            &["nosuch.csv", "No such file"],
        ),
        ("control --fast --slow", &["--fast", "--slow"]),
        (
            "model modes --operating-point banana",
            &["`banana`", "3.8mm"],
        ),
        (
            "model modes --operating-point 1e9",
            &["--operating-point 1e9 is 1000000000 m", "-0.5 to 0.5 m"],
        ),
        (
            "model modes --operating-point 400%",
            &["0.19 m", "0.0475 m"],
        ),
        ("model modes --asymmetry -100%", &["is -1", "-0.9 to 9"]),
        ("model modes --asymmetry 3mm", &["`3mm`", "10% or 0.1"]),
        (
            "model modes --seed 18446744073709551615",
            &["18446744073709551615", "--seed"],
        ),
        ("model modes --seed -1", &["-1"]),
        (
            "model locus --vary plant.mass_asymmetry --from 1 --to 1",
            &["empty sweep", "both 1"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from 1% --to 2% --count 1",
            &["--count", "2..=100000"],
        ),
        (
            "model locus --vary plant.mass_asymetry --from 0 --to 0.1",
            &["mass_asymetry"],
        ),
        (
            "model locus --vary plant.damping --from 0 --to 0.1",
            &["plant.damping"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from -95% --to 0",
            &["is -0.95", "-0.9 to 9"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from banana --to 0",
            &["`banana`"],
        ),
        (
            "model locus --vary plant.mass_asymmetry --from 0 --to 1 --asymmetry 5%",
            &["--vary", "leave out the option"],
        ),
        ("model locus --from 0 --to 1", &["--vary"]),
        ("model veering --vary plant.mass_asymmetry", &["--from"]),
        (
            "model veering --operating-point 5%",
            &["--vary plant.operating_point_m", "leave out the option"],
        ),
        ("model veering --from 1% --to 1%", &["empty sweep"]),
        ("model veering --modes 3,3", &["--modes [3, 3]", "1 to 4"]),
        ("model veering --modes 3,5", &["--modes [3, 5]", "1 to 4"]),
        (
            "model veering --modes 3",
            &["--modes [3]", "two different modes"],
        ),
        ("model veering --config four-mass", &["no beams", "metres"]),
        ("model conditions --from 1% --to 1%", &["empty sweep"]),
        (
            "model conditions --from 1% --to 2% --modes 3,4",
            &["neither veer nor cross", "0.00095", "--from or --to"],
        ),
        (
            "model conditions --from 1% --to 1.1%",
            &["no two modes veer or cross", "--from or --to"],
        ),
        (
            "model conditions --modes 3,9",
            &["--modes [3, 9]", "1 to 4"],
        ),
        (
            "model conditions --at 20%",
            &["--at 0.0095", "outside of the range"],
        ),
        ("model conditions --at banana", &["`banana`"]),
        ("model placement --from 1% --to 1%", &["empty sweep"]),
        (
            "model placement --from 1% --to 2% --modes 3,4",
            &["neither veer nor cross"],
        ),
        (
            "model placement --sensor x9",
            &["--sensor x9", "no such place", "x1 x2", "did you mean x"],
        ),
        (
            "model placement --actuator x1=0,y2=0",
            &["--actuator", "all weights are 0", "other than 0"],
        ),
        (
            "model placement --sensor x1=banana",
            &["x1=banana", "a weight is a number"],
        ),
        (
            "model placement --sensor x1=inf",
            &["x1=inf", "a weight is a number"],
        ),
        (
            "model bounds --alpha 1",
            &["--alpha is 1", "between 0 and 1"],
        ),
        ("model bounds --alpha nan", &["`nan`", "--alpha"]),
        ("model bounds --peak 1", &["--peak is 1", "above 1"]),
        (
            "model bounds --bandwidth 0",
            &["--bandwidth is 0", "above 0"],
        ),
        ("model step --duration 0", &["--duration is 0", "above 0"]),
        ("model step --count 1", &["--count", "2..=1000000"]),
        (
            "model critical-damping --ratio 1.2",
            &["ratio = 1.2", "(omega_v/omega_u)^2"],
        ),
        (
            "model critical-damping --omega-u 2",
            &["omega_u = 2", "omega_u < omega_v"],
        ),
        ("margins --config nosuch", &["nosuch", "stage, chapter2"]),
        ("margins --controller nosuch", &["nosuch", "fast, slow"]),
        (
            "chirp --pace leisurely",
            &["leisurely", "virtual, realtime"],
        ),
        ("", &["Usage"]),
        ("frobnicate", &["frobnicate"]),
        ("model", &["Usage"]),
        ("identify", &["RECORDING"]),
    ];
    for (arguments, words) in cases {
        let bench = Bench::new();
        bench.run(arguments).is_refused(words);
        assert_eq!(bench.files(), [""; 0], "bench {arguments}");
    }
}

#[test]
fn nan_and_infinity_are_refused_in_every_flag_that_takes_a_number() {
    let chirp =
        ["--start", "--stop", "--duration", "--amplitude"].map(|flag| format!("chirp {flag}"));
    let control = [
        "--duration",
        "--amplitude",
        "--reference sine --frequency",
        "--reference ramp --speed",
    ];
    let model = ["--operating-point", "--asymmetry"].map(|flag| format!("model modes {flag}"));
    for flag in chirp
        .into_iter()
        .chain(control.map(|flag| format!("control {flag}")))
        .chain(model)
    {
        for value in ["nan", "NaN", "inf", "-inf", "1e999"] {
            let bench = Bench::new();
            let answer = bench.run(&format!("{flag} {value}"));
            let named = answer.err.contains(value);
            assert!(
                answer.code == 2 && named && bench.files().is_empty(),
                "{flag} {value}: {answer:?}"
            );
        }
    }
}

#[test]
fn a_chirp_too_long_to_be_analysed_is_refused_at_once() {
    // 1e5 s at 5 kHz are 5e8 ticks, which would be 37 GB of recording and as much memory to analyse it.
    let bench = Bench::new();
    bench
        .run("chirp --duration 1e5")
        .is_refused(&["100000 s", "20000000", "shorten"]);
    bench
        .run("chirp --duration 1e30")
        .is_refused(&["--duration 1e30", "0.001 to 100000 s"]);
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn the_memory_of_a_run_does_not_grow_with_its_duration() {
    // A way that trips as it begins, out of eleven days, in a quarter of what one number a tick would take.
    // `bench margins --fast --asymmetry -10%`: not stable. No amplitude is small enough.
    let bench = Bench::new();
    let refused = bench.run("control --fast --reference chirp --asymmetry -10%");
    refused.is_refused(&["by the model this loop is unstable", "`bench margins`"]);
    assert_eq!(bench.files(), [""; 0]);
    let bench = Bench::new();
    bench.write("far.csv", "0,0\n0.1,0.01\n");
    let run = format!(
        "ulimit -v 2000000; exec {} control --fast --reference far.csv --duration 1e6 --json",
        env!("CARGO_BIN_EXE_bench")
    );
    let output = assert_cmd::Command::new("sh")
        .args(["-c", &run])
        .current_dir(bench.path(""))
        .output()
        .expect("sh");
    let err = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{err}");
    assert!(
        String::from_utf8_lossy(&output.stdout).contains("\"tripped\""),
        "{err}"
    );
}

#[test]
fn a_reference_file_that_cannot_be_followed_is_refused_with_its_line() {
    let cases: &[(&[u8], &[&str])] = &[
        (b"", &["line 1", "no point"]),
        (b"time_s,reference_m\n", &["no point"]),
        (
            b"time_s,reference_m\n0,0\n0,1e-6\n",
            &["line 3", "does not rise"],
        ),
        (b"0,0\n1,NaN\n", &["line 2", "not two finite numbers"]),
        (b"0;0\n", &["line 1", "time_s,reference_m"]),
        (b"\xff\xfe\x00", &["UTF-8"]),
    ];
    for (text, words) in cases {
        let bench = Bench::new();
        bench.write("way.csv", text);
        bench
            .run("control --reference way.csv")
            .is_refused(&[words, &["way.csv"][..]].concat());
        assert_eq!(bench.files(), ["way.csv"]);
    }
    Bench::new()
        .run("control --reference .")
        .is_refused(&["directory"]);
}

#[test]
fn a_reference_beyond_the_stage_is_refused_or_ends_in_a_trip() {
    for options in [
        "--amplitude 0.91mm",
        "--amplitude -1m",
        "--reference sine --amplitude 2mm",
    ] {
        let bench = Bench::new();
        let refused = bench.run(&format!("control --fast {options}"));
        refused.is_refused(&["--amplitude", "the soft limit of 0.0009 m"]);
        assert_eq!(bench.files(), [""; 0], "{options}");
    }
    let bench = Bench::new();
    bench.write("far.csv", "0,0\n0.1,1e300\n");
    let answer = bench.run("control --fast --duration 1 --reference far.csv --json");
    assert_eq!(
        (answer.code, &answer.json()["outcome"]),
        (1, &serde_json::json!("tripped")),
        "{}",
        answer.err
    );
}

#[test]
fn what_is_no_recording_is_said_to_be_none() {
    let bench = Bench::new();
    bench.write("text.mcap", "not a recording");
    bench.write("empty.mcap", "");
    for command in ["identify", "replay", "recover"] {
        for file in ["text.mcap", "empty.mcap", "nosuch.mcap", "."] {
            let answer = bench.run(&format!("{command} {file}"));
            assert!(
                [1, 2].contains(&answer.code) && answer.out.is_empty(),
                "{command} {file}: {answer:?}"
            );
            assert!(
                answer.err.contains(file),
                "{command} {file}: {}",
                answer.err
            );
        }
    }
    assert_eq!(bench.files(), ["empty.mcap", "text.mcap"]);
}

#[test]
fn everything_works_in_an_empty_folder() {
    let bench = Bench::new();
    bench.json("model modes");
    bench.json("margins");
    assert_eq!(bench.files(), [""; 0], "looking leaves nothing behind");
    let control = bench.json("control --duration 0.2");
    assert_eq!(bench.files(), ["recordings"]);
    let chirp = bench.json("chirp --duration 6 --start 5 --stop 50 --out elsewhere/deep");
    for (answer, key) in [
        (&control, "recording"),
        (&chirp, "recording"),
        (&chirp, "frf_csv"),
        (&chirp, "plot"),
    ] {
        assert!(
            bench.path(answer[key].as_str().expect("a path")).exists(),
            "{key}"
        );
    }
}

#[test]
fn two_runs_in_one_second_do_not_overwrite_each_other() {
    let bench = Bench::new();
    let names: Vec<String> = (0..4)
        .map(|_| bench.json("control --duration 0.05")["recording"].to_string())
        .collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), 4, "{names:?}");
}

#[test]
fn where_nothing_can_be_written_nothing_moves_and_the_remedy_is_named() {
    // No one can make a folder in /proc, not even root.
    let proc = Path::new("/proc");
    for arguments in ["control --duration 0.1", "chirp --duration 10"] {
        let answer = program::run_in(proc, arguments.split(' '));
        assert_eq!(answer.code, 1, "{}", answer.err);
        assert!(
            !answer.out.contains("overruns"),
            "the plan, but no results: {}",
            answer.out
        );
        for word in ["recordings", "--out", "nothing was moved"] {
            assert!(answer.err.contains(word), "{word}: {}", answer.err);
        }
    }
    assert_eq!(
        program::run_in(proc, ["margins", "--fast"]).code,
        0,
        "what writes nothing works"
    );
    let bench = Bench::new();
    bench.write("taken", "");
    let answer = bench.run("control --duration 0.1 --out taken");
    assert!(
        answer.code == 1 && answer.err.contains("taken"),
        "{answer:?}"
    );
}

/// `bench margins` of an unstable loop: exit code 1, and an object that says so.
fn is_unstable(answer: &Answer) -> bool {
    answer.code == 1 && answer.json()["stable"] == false
}

/// Cases are the same in every run; a call takes some 10 ms.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20_061_009),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Something like a key of the configuration.
fn key() -> impl Strategy<Value = String> {
    let keys = include_str!("../bench-config/stage.toml")
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

/// Something like a value.
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

/// The default profile with some of its bytes changed, cut out or doubled.
fn damaged(text: &'static str) -> impl Strategy<Value = Vec<u8>> {
    let wound = (
        0..text.len(),
        0usize..12,
        proptest::collection::vec(any::<u8>(), 0..4),
    );
    proptest::collection::vec(wound, 1..4).prop_map(move |wounds| {
        let mut bytes = text.as_bytes().to_vec();
        for (at, length, new) in wounds {
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
    fn no_setting_whatever_makes_a_command_panic(sets in proptest::collection::vec((key(), value()), 1..5)) {
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
    fn no_file_whatever_makes_a_command_panic(
        noise in proptest::collection::vec(any::<u8>(), 0..200),
        profile in damaged(include_str!("../bench-config/stage.toml")),
        controller in damaged(include_str!("../bench-config/controllers/fast.toml")),
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

//! The command: figures of closed loops, page, and what cannot be compared.

use serde_json::Value;

use crate::compare::program::{Bench, number};

fn control(bench: &Bench, arguments: &str) -> (String, Value) {
    let run = bench.json(&format!("control {arguments} --duration 1.5s --no-report"));
    let recording = run["recording"].as_str().expect("a path").to_string();
    (recording, run)
}

fn figure<'a>(comparison: &'a Value, name: &str) -> &'a Value {
    let figures = comparison["others"][0]["figures"]
        .as_array()
        .expect("a list");
    let found = figures.iter().find(|figure| figure["figure"] == name);
    found.unwrap_or_else(|| panic!("{name}: {figures:?}"))
}

#[test]
fn figures_of_two_loops_are_those_of_the_runs() {
    let bench = Bench::new();
    let (slow, slow_run) = control(&bench, "--slow --name slow");
    let (fast, fast_run) = control(&bench, "--fast --name fast");
    let comparison = bench.json(&format!("compare {slow} {fast} --out page.html"));
    assert_eq!(comparison["reference"]["label"], "slow");
    assert_eq!(comparison["others"][0]["label"], "fast");
    for (name, place, key) in [
        ("settling_time_s", "measured", "settling_time_s"),
        ("overshoot_percent", "measured", "overshoot_percent"),
        ("rms_error_m", "whole_run", "rms_error_m"),
        ("peak_current_a", "whole_run", "peak_current_a"),
        ("rms_current_a", "whole_run", "rms_current_a"),
    ] {
        let found = figure(&comparison, name);
        let (first, second) = (number(&slow_run[place][key]), number(&fast_run[place][key]));
        assert_eq!(number(&found["reference"]), first, "{name}");
        assert_eq!(number(&found["other"]), second, "{name}");
        assert_eq!(number(&found["difference"]), second - first, "{name}");
    }
    assert_eq!(figure(&comparison, "overruns")["difference"], 0.0);
    assert_eq!(
        (&comparison["tested"], &comparison["correction"]),
        (&0.into(), &"holm".into())
    );
    let page = bench.read("page.html");
    for part in [
        "fast compared with slow",
        "Settings that differ",
        "control.controller",
        "Step response",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let text = bench.run(&format!("compare {slow} {fast}"));
    assert_eq!(text.code, 0, "{}", text.err);
    assert!(
        text.out.lines().all(|line| line.chars().count() <= 80),
        "{}",
        text.out
    );
}

#[test]
fn runs_of_equal_names_are_distinguished_by_their_paths() {
    let bench = Bench::new();
    for given in ["", "--name slow"] {
        let (recording, _) = control(&bench, &format!("--slow {given}"));
        for folder in ["monday", "tuesday"] {
            std::fs::create_dir_all(bench.path(folder)).expect("a folder");
            let copy = bench.path(folder).join("run.mcap");
            std::fs::copy(bench.path(&recording), copy).expect("a copy");
        }
        let comparison = bench.json("compare monday/run.mcap tuesday/run.mcap");
        let name = given.strip_prefix("--name ").unwrap_or("run");
        let labels = [
            &comparison["reference"]["label"],
            &comparison["others"][0]["label"],
        ];
        let expected = ["monday", "tuesday"].map(|folder| format!("{name} ({folder}/run.mcap)"));
        assert_eq!(labels, expected.each_ref());
    }
}

#[test]
fn warns_of_runs_that_are_cut_off_or_tripped_and_exits_with_code_3() {
    let bench = Bench::new();
    let (whole, _) = control(&bench, "--slow");
    let recorded = std::fs::read(bench.path(&whole)).expect("a recording");
    bench.write("cut.mcap", &recorded[..recorded.len() * 7 / 10]);
    // The reference is beyond the soft limit.
    let tripped = bench.run(
        "control --slow --amplitude 4um --duration 1.5s --no-report --json --set interlock.soft_limit_m=4.2e-6 \
         --set control.min_modulus_margin=0",
    );
    assert_eq!(tripped.code, 1, "{}", tripped.err);
    let tripped = tripped.json()["recording"].as_str().map(String::from);
    let tripped = tripped.expect("a path");
    for (recording, word) in [("cut.mcap", "cut off"), (&tripped, "tripped")] {
        for order in [
            format!("{whole} {recording}"),
            format!("{recording} {whole}"),
        ] {
            let answer = bench.run(&format!("compare {order}"));
            assert_eq!(answer.code, 3, "{answer:?}");
            let lines: Vec<&str> = answer.err.lines().collect();
            let warned = |line: &&str| line.contains(recording) && line.contains(word);
            assert!(lines.len() == 1 && lines.iter().all(warned), "{answer:?}");
        }
    }
    assert_eq!(bench.run(&format!("compare {whole} {whole}")).code, 0);
}

#[test]
fn refuses_runs_with_nothing_in_common_single_recordings_and_more_than_12() {
    let bench = Bench::new();
    let (control, _) = control(&bench, "--slow");
    let chirp = bench.json("chirp --duration 10 --start 5 --stop 100");
    let chirp = chirp["recording"].as_str().expect("a path");
    let answer = bench.run(&format!("compare {control} {chirp}"));
    assert_eq!(answer.code, 2, "{}", answer.err);
    for word in ["nothing in common", "control-slow-step", "_chirp"] {
        assert!(answer.err.contains(word), "{word}: {}", answer.err);
    }
    assert_eq!(bench.run(&format!("compare {control}")).code, 2);
    for command in ["compare", "report"] {
        let recordings = vec![control.as_str(); 13].join(" ");
        let answer = bench.run(&format!("{command} {recordings}"));
        answer.is_refused(&["13 recordings", "at most 12"]);
    }
    let missing = bench.run(&format!("compare {control} missing.mcap"));
    assert!(
        missing.code == 1 && missing.err.contains("missing.mcap"),
        "{missing:?}"
    );
}

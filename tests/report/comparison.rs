//! `bench report`, and the plans of `bench control` and `bench calibrate`.

use bench_recording::Recording;
use bench_test_support::program::Bench;
use serde_json::Value;

/// A short step without noise, so that the prediction can be compared.
const STEP: &str = "control --slow --amplitude 40um --duration 1.5s --set sim.probe_noise_rms_m=0";

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is not a number"))
}

#[test]
fn page_of_a_step_has_the_figures_of_the_run_and_of_the_model() {
    let bench = Bench::new();
    let run = bench.json(STEP);
    let recording = run["recording"].as_str().expect("a path");
    let report = bench.json(&format!("report {recording}"));
    let page = bench.path(report["page"].as_str().expect("a path"));
    let page = std::fs::read_to_string(page).expect("a page");
    for part in [
        "2 % of the step",
        "by the model",
        "measured",
        "Signals",
        "40.000",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for figures in ["measured", "predicted"] {
        let settling_ms = number(&run[figures]["settling_time_s"]) * 1e3;
        let cell = format!("<td class=\"n\">{settling_ms:.1} ms</td>");
        assert!(page.contains(&cell), "{figures}: {cell}");
    }
}

#[test]
fn page_of_several_steps_names_each_recording() {
    let bench = Bench::new();
    let recordings = ["slow", "fast"].map(|controller| {
        let run = bench.json(&format!("control --{controller} --duration 1.5s"));
        run["recording"].as_str().expect("a path").to_string()
    });
    let answer = bench.run(&format!("report {} --out both.html", recordings.join(" ")));
    assert_eq!(answer.code, 0, "{}", answer.err);
    let page = std::fs::read_to_string(bench.path("both.html")).expect("a page");
    for name in ["_control-slow-step", "_control-fast-step"] {
        assert!(page.contains(name), "{name}");
    }
}

#[test]
fn page_of_several_chirps_does_not_need_the_files_of_their_analysis() {
    let bench = Bench::new();
    let made = bench.json("chirp --duration 6 --start 5 --stop 50 --out made");
    let recording = bench.path(made["recording"].as_str().expect("a path"));
    for copy in ["first.mcap", "second.mcap"] {
        std::fs::copy(&recording, bench.path(copy)).expect("a copy");
    }
    // A loop that ends before its step has nothing to draw.
    let short = bench.json("control --fast --duration 0.2s --no-report");
    let short = short["recording"].as_str().expect("a path");
    let answer = bench.run(&format!(
        "report first.mcap second.mcap {short} --out both.html"
    ));
    assert_eq!(answer.code, 0, "{}", answer.err);
    let page = bench.read("both.html");
    for part in ["Frequency responses of the stage", "first", "second"] {
        assert!(page.contains(part), "{part}");
    }
}

#[test]
fn prints_the_page_to_standard_output() {
    let bench = Bench::new();
    let run = bench.json(STEP);
    let answer = bench.run(&format!(
        "report {} --out -",
        run["recording"].as_str().expect("a path")
    ));
    assert_eq!(answer.code, 0, "{}", answer.err);
    assert!(answer.out.starts_with("<!DOCTYPE html>") && answer.out.ends_with("</html>\n"));
}

#[test]
fn refuses_recordings_that_one_plot_cannot_show() {
    let bench = Bench::new();
    let recordings = [0, 1].map(|_| {
        let run = bench.json("control --slow --reference hold --duration 1s");
        run["recording"].as_str().expect("a path").to_string()
    });
    let answer = bench.run(&format!("report {}", recordings.join(" ")));
    assert_eq!(answer.code, 1);
    assert!(answer.err.contains("bench chirp"), "{}", answer.err);
    let missing = bench.run("report missing.mcap");
    assert_eq!(missing.code, 1);
    assert!(missing.err.contains("missing.mcap"), "{}", missing.err);
}

#[test]
fn plan_of_a_loop_predicts_travel_and_current_without_motion() {
    let bench = Bench::new();
    let plan = bench.json(&format!("{STEP} --plan"));
    assert!(!bench.path("recordings").exists(), "nothing is recorded");
    let run = bench.json(STEP);
    let recording = bench.path(run["recording"].as_str().expect("a path"));
    let (mut travel_m, mut current_a) = (0.0_f64, 0.0_f64);
    for record in Recording::open(&recording)
        .expect("readable")
        .ticks()
        .expect("ticks")
    {
        let record = record.expect("a tick");
        travel_m = travel_m.max(record.position_m.abs());
        current_a = current_a.max(record.command_a.abs());
    }
    // The model of the loop is that of the simulated stage; the reading has a resolution.
    for (name, measured, predicted) in [
        ("travel", travel_m, number(&plan["expected"]["travel_m"])),
        ("current", current_a, number(&plan["expected"]["current_a"])),
    ] {
        let ratio = measured / predicted;
        assert!(
            (0.95..1.05).contains(&ratio),
            "{name}: {measured} {predicted}"
        );
    }
    let share = number(&plan["expected"]["travel_m"]) / number(&plan["limits"]["travel_m"]);
    assert!((0.01..1.0).contains(&share), "{plan}");
}

#[test]
fn plan_of_a_loop_is_refused_like_its_run() {
    let bench = Bench::new();
    for options in ["", "--plan"] {
        let answer = bench.run(&format!("control --slow --amplitude 2mm {options}"));
        assert_eq!(answer.code, 2, "{options}: {}", answer.err);
    }
}

#[test]
fn plan_of_a_calibration_adds_both_runs() {
    let bench = Bench::new();
    let plan = bench.json("calibrate --plan");
    assert!(!bench.path("recordings").exists(), "nothing is recorded");
    let part = |name: &str, value: &str| number(&plan[name][value]);
    let sum_s = part("steps", "duration_s") + part("chirp", "duration_s");
    assert_eq!(part("expected", "duration_s"), sum_s);
    let travel_m = part("steps", "travel_m").max(part("chirp", "travel_m"));
    assert_eq!(part("expected", "travel_m"), travel_m);
    let steps = bench.json("calibrate --plan --no-delay");
    assert!(steps["chirp"].is_null());
    assert_eq!(
        number(&steps["expected"]["duration_s"]),
        part("steps", "duration_s")
    );
}

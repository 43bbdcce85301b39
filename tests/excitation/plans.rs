//! `--plan` and `--shape`: predicted values match the run, and plans that would trip are rejected.
use serde_json::Value;

use crate::excitation::program::{Bench, number};
use crate::excitation::rig::{self, travel_m};

const HERE: &str = "--set loop.rate_hz=1000 --set chirp.stop_hz=400";

/// The answers of a plan and of its run, and the measured travel of the run.
fn planned_and_run(options: &str) -> (Value, Value, f64) {
    let bench = Bench::new();
    let plan = bench.json(&format!("chirp {HERE} {options} --plan"));
    assert_eq!(bench.files(), [""; 0], "a plan writes no files");
    let run = bench.json(&format!("chirp {HERE} {options}"));
    let travel_m = travel_m(&bench.path(run["recording"].as_str().expect("a path")));
    (plan, run, travel_m)
}

#[test]
fn predicted_travel_current_and_duration_match_the_run() {
    for options in [
        "--duration 40",
        "--duration 40 --shape model",
        "--excitation multisine --set multisine.periods=6",
        "--excitation multisine --set multisine.periods=6 --shape model",
        "--excitation stepped_sine --start 5 --set stepped_sine.count=20",
        "--excitation prbs --set prbs.order=12 --set prbs.clock_divider=1",
        "--excitation prbs --set prbs.order=12 --set prbs.clock_divider=1 --shape model",
    ] {
        let (plan, run, measured_m) = planned_and_run(options);
        let expected = &plan["expected"];
        assert_eq!(expected, &run["expected"], "{options}");
        assert_eq!(run["expected_travel_m"], expected["travel_m"]);
        // Floor vibration and noise add at most 0.3 um.
        let travel_m = number(&expected["travel_m"]);
        assert!(
            (measured_m - travel_m).abs() < 0.02 * travel_m + 0.5e-6,
            "{options}: {measured_m} for {travel_m}"
        );
        // The ticks of the program, and 100 ticks after the motor is switched off.
        let ticks = number(&expected["duration_s"]) * 1000.0;
        assert!(
            (number(&run["ticks"]) - ticks - 100.0).abs() < 1.5,
            "{options}: {} for {ticks}",
            run["ticks"]
        );
        for (figure, limit) in [
            ("travel_m", "travel_m"),
            ("current_a", "current_a"),
            ("thermal_current_a", "thermal_current_a"),
            ("slew_a_per_s", "slew_a_per_s"),
        ] {
            let (figure, limit) = (number(&expected[figure]), number(&plan["limits"][limit]));
            assert!(
                0.0 < figure && figure <= limit,
                "{options}: {figure} of {limit}"
            );
        }
        assert!(number(&expected["rms_current_a"]) < number(&expected["current_a"]));
    }
}

#[test]
fn shaped_stepped_sine_reaches_the_requested_travel() {
    // A stepped sine is shaped without --shape. Below mode R, G is at lowest_a 154 um/A, so that the current suffices for 100 um.
    let options = "--excitation stepped_sine --start 2 --set stepped_sine.count=12 --set shape.travel_m=100e-6 --stop 29";
    let (plan, _, measured_m) =
        planned_and_run(&format!("{options} --set stepped_sine.settle_s=8.0"));
    // The piecewise curve is up to some per cent below the exact one. During a change of frequency two sines overlap.
    assert!((85e-6..112e-6).contains(&measured_m), "{measured_m}");
    let points = plan["amplitude"].as_array().expect("points");
    assert!(points.len() <= 64 && points.len() > 5, "{}", points.len());
}

#[test]
fn shape_from_a_measured_frf_equals_shape_from_the_model() {
    let bench = Bench::new();
    let measured = bench.json(&format!("chirp {HERE} --start 1 --duration 60"));
    let frf = measured["frf_csv"].as_str().expect("a path");
    let plan_by = |source: &str| {
        bench.json(&format!(
            "chirp {HERE} --start 1 --duration 60 --shape {source} --plan"
        ))
    };
    let (by_model, by_frf) = (plan_by("model"), plan_by(frf));
    let travel = |plan: &Value| number(&plan["expected"]["travel_m"]);
    assert!(
        (0.9..1.1).contains(&(travel(&by_frf) / travel(&by_model))),
        "{} {}",
        travel(&by_frf),
        travel(&by_model)
    );
    let lowest_a = |plan: &Value| {
        let points = plan["amplitude"].as_array().expect("points");
        points
            .iter()
            .map(|p| number(&p["current_a"]))
            .fold(f64::INFINITY, f64::min)
    };
    // The estimate lowers and widens the peak of mode R, which is 0.5 Hz wide.
    assert!(
        (0.8..1.25).contains(&(lowest_a(&by_frf) / lowest_a(&by_model))),
        "{} {}",
        lowest_a(&by_frf),
        lowest_a(&by_model)
    );
}

/// Chains of three masses with light dampers, moved at the first mass and measured at the last: sharp resonances, and sweeps that pass them
/// quickly.
fn chain(seed: u32) -> String {
    let mut state = seed.wrapping_mul(2_654_435_761) | 1;
    let mut between = |low: f64, high: f64| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        low + (high - low) * f64::from(state >> 8) / f64::from(1_u32 << 24)
    };
    let masses: Vec<f64> = (0..3).map(|_| between(0.2, 1.5)).collect();
    let springs: Vec<f64> = (0..3).map(|_| between(2e4, 1.2e5)).collect();
    let (ratio, stop_hz) = (between(0.002, 0.015), between(120.0, 200.0));
    format!(
        "[plant]
model = \"lumped\"
[plant.nodes]
a = {{ mass_kg = {}, actuator = 1.0, sensor = 0.0 }}
b = {{ mass_kg = {}, actuator = 0.0, sensor = 0.3 }}
c = {{ mass_kg = {}, actuator = 0.0, sensor = 1.0 }}
[plant.springs]
base = {{ between = [\"a\", \"ground\"], stiffness_n_per_m = {} }}
first = {{ between = [\"b\", \"a\"], stiffness_n_per_m = {} }}
second = {{ between = [\"c\", \"a\"], stiffness_n_per_m = {} }}
[plant.damping]
kind = \"uniform\"
ratio = {ratio}
[sim]
unmodelled = []
floor = []
[loop]
rate_hz = 1000.0
[chirp]
start_hz = 2.0
stop_hz = {stop_hz}
duration_s = 15.0
",
        masses[0], masses[1], masses[2], springs[0], springs[1], springs[2]
    )
}

/// The travel of a shape is a third of the soft limit of 900 um. All lines of a multisine and of a PRBS together keep it; a sweep and the
/// steps of a sine, which pass modes quickly, may reach two thirds.
#[test]
fn shape_by_the_model_is_accepted_with_every_excitation_of_other_stages() {
    let bench = Bench::new();
    for seed in 1..=6 {
        std::fs::write(bench.path("own.toml"), chain(seed)).expect("a file");
        for (options, most_m) in [
            ("", 600e-6),
            ("--excitation multisine --set multisine.periods=5", 300e-6),
            (
                "--excitation stepped_sine --set stepped_sine.count=20",
                600e-6,
            ),
            ("--excitation prbs --set prbs.clock_divider=2", 300e-6),
        ] {
            let plan = bench.json(&format!(
                "chirp --config own.toml {options} --shape model --plan"
            ));
            let (expected, limits) = (&plan["expected"], &plan["limits"]);
            let travel_m = number(&expected["travel_m"]);
            assert!(
                travel_m <= most_m * (1.0 + 1e-9),
                "{seed} {options}: {travel_m}"
            );
            let ratios = ["travel_m", "current_a", "slew_a_per_s"]
                .map(|key| number(&expected[key]) / number(&limits[key]));
            let largest = ratios.into_iter().fold(0.0, f64::max);
            assert!(largest > 0.2, "{seed} {options}: {ratios:?}");
        }
    }
}

#[test]
fn rejects_plan_beyond_interlock_with_value_limit_and_remedy() {
    for (options, words) in [
        (
            "--amplitude 0.5",
            ["um at 30", "900 um", "--shape model"].as_slice(),
        ),
        (
            "--excitation multisine --amplitude 12",
            &["12.000 A", "9.982 A", "lower chirp.amplitude"],
        ),
        (
            "--excitation multisine --amplitude 8 --set motor.continuous_force_n=10",
            &["thermal current", "0.899 A"],
        ),
        (
            "--excitation prbs --amplitude 2 --set prbs.clock_divider=1",
            &["soft limit of 900 um", "prbs.amplitude_a"],
        ),
        (
            "--excitation stepped_sine --amplitude 1 --set stepped_sine.count=40",
            &["Hz", "the soft limit of 900 um"],
        ),
        (
            "--excitation multisine --set multisine.period_s=0.02 --start 100 --stop 150",
            &["multisine.period_s", "ten"],
        ),
        (
            "--excitation multisine --duration 60s",
            &[
                "--duration 60s is the length of a chirp",
                "multisine.period",
            ],
        ),
        (
            "--excitation stepped_sine --sweep linear",
            &[
                "--sweep goes with --excitation chirp only",
                "`stepped_sine`",
            ],
        ),
        (
            "--excitation prbs --set prbs.clock_divider=2",
            &["prbs.clock_divider", "250 Hz", "400 Hz"],
        ),
        (
            "--excitation prbs --set prbs.clock_divider=1 --shape measured.csv",
            &["--shape", "prbs.amplitude_a"],
        ),
        (
            "--excitation noise",
            &["--excitation", "multisine", "stepped_sine", "prbs"],
        ),
        ("--shape missing.csv", &["missing.csv", "model"]),
        (
            "--set chirp.repetitions=200000",
            &["chirp.repetitions", "10000"],
        ),
        (
            "--set chirp.repetitions=9999",
            &["chirp.duration_s", "ticks"],
        ),
    ] {
        for plan in ["", "--plan"] {
            let bench = Bench::new();
            bench
                .run(&format!("chirp {HERE} {options} {plan} --json"))
                .is_refused(words);
            assert_eq!(bench.files(), [""; 0], "{options}");
        }
    }
}

#[test]
fn recording_without_excitation_kind_is_a_chirp() {
    let config = rig::config(&[]);
    let mut old: toml::Table = toml::Table::try_from(&config).expect("TOML");
    for table in ["excitation", "multisine", "stepped_sine", "prbs", "shape"] {
        assert!(old.remove(table).is_some(), "{table}");
    }
    old["chirp"]
        .as_table_mut()
        .expect("a table")
        .remove("repetitions");
    let text = toml::to_string(&old).expect("TOML");
    assert_eq!(bench_config::whole("an old recording", &text), Ok(config));
}

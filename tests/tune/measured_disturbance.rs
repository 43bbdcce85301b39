//! The disturbance of a recorded closed loop that held its position.

use bench_control::tuning::{DesignOptions, DesignTask, NamedPlant, RigModel};
use bench_experiment::tuning::recorded_disturbance;
use bench_recording::Recording;
use bench_test_support::program::Bench;

use crate::tune::stage::{config, options, requirements};

/// The recording of a run.
fn recorded(bench: &Bench, command: &str) -> String {
    let answer = bench.run(&format!("{command} --no-report --out ."));
    assert_eq!(answer.code, 0, "{}", answer.err);
    let mut recordings = bench.files();
    recordings.retain(|file| file.ends_with(".mcap"));
    assert_eq!(recordings.len(), 1);
    recordings.swap_remove(0)
}

fn held(bench: &Bench, duration: &str) -> String {
    recorded(
        bench,
        &format!("control --slow --reference hold --duration {duration}"),
    )
}

/// The lines of the floor in the simulation in time, and their spectrum in closed form.
#[test]
fn variance_of_a_recorded_disturbance_is_that_of_the_floor() {
    let bench = Bench::new();
    let file = held(&bench, "60s");
    let config = config(&[]);
    let plant = NamedPlant::of("8 % of L", &config.plant).unwrap();
    let options: DesignOptions = options(requirements(bench_control::tuning::Goal::Rms));
    let task = DesignTask::new(&RigModel::from(&config), &[plant], options).unwrap();
    let disturbance = &task.disturbance;
    let recording = Recording::open(&bench.path(&file)).unwrap();
    let noise_rms_m = disturbance.noise_rms_m;
    let measured = recorded_disturbance(&recording, "file", noise_rms_m).unwrap();
    let (from_rad_s, to_rad_s) = (2.0 * std::f64::consts::TAU, 200.0 * std::f64::consts::TAU);
    let grid: Vec<f64> = (0..20_000)
        .map(|i| from_rad_s + (to_rad_s - from_rad_s) * f64::from(i) / 19_999.0)
        .collect();
    let modes = &task.plants[0].modes;
    let variances = disturbance.variances(modes, &grid, config.servo.period_s());
    let expected_m2: f64 = variances.iter().map(|v| v.disturbance_m2).sum();
    let found_m2 = measured.variance_m2(from_rad_s, to_rad_s);
    // 58 s of a disturbance whose lines are some hertz wide: a standard deviation of the variance of about 6 %.
    let ratio = found_m2 / expected_m2;
    assert!((0.8..1.25).contains(&ratio), "{found_m2} for {expected_m2}");
}

#[test]
fn design_for_a_recorded_disturbance_predicts_the_error_of_the_configured_one() {
    let bench = Bench::new();
    let file = held(&bench, "60s");
    let quick = "tune --goal rms --order 3 --operating-points 8% --frequency-tolerance 0 --damping-factor 1 --set sim.unmodelled=[] --without-bound";
    let rms_m = |command: &str| {
        let certificate = bench.json(command);
        certificate["plants"][0]["error_rms_m"].as_f64().unwrap()
    };
    let configured = rms_m(&format!("{quick} --out configured"));
    let measured = rms_m(&format!("{quick} --disturbance {file} --out measured"));
    // Half of the deviation of the variance above, and two controllers that differ a little.
    let ratio = measured / configured;
    assert!((0.88..1.13).contains(&ratio), "{measured} for {configured}");
}

#[test]
fn refuses_a_recording_that_shows_no_disturbance() {
    let refused = |command: &str, words: [&str; 2]| {
        let bench = Bench::new();
        let file = recorded(&bench, command);
        let answer = bench.run(&format!(
            "tune --goal rms --disturbance {file} --out design"
        ));
        assert_eq!(answer.code, 2, "{}", answer.err);
        for word in words {
            assert!(answer.err.contains(word), "{word}: {}", answer.err);
        }
    };
    refused(
        "control --slow --reference hold --duration 1s",
        ["too short", "--duration"],
    );
    refused("control --slow", [".mcap", "--reference hold"]);
}

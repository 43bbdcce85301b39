//! `bench chirp` and `bench control` with each plant.

use serde_json::json;

use crate::program::{Bench, near, number};
use crate::truth;

/// Share of the rows in a band that are within 1 % and 1 degree of the exact response.
fn share_of_accurate_rows(profile: &str, (low_hz, high_hz): (f64, f64)) -> Option<f64> {
    let (bench, clean) = (
        Bench::new(),
        "--set sim.probe_noise_rms_m=0 --set sim.probe_quantisation_m=0 --set sim.floor=[]",
    );
    let answer = bench.json(&format!("chirp --config {profile} {clean}"));
    assert_eq!(answer["outcome"], "completed", "{profile}");
    let text = bench.read(answer["frf_csv"].as_str().expect("a path"));
    let row = |line: &str| {
        line.split(',')
            .map(|field| field.parse().expect("a number"))
            .collect::<Vec<f64>>()
    };
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(row)
        .filter(|row| (low_hz..high_hz).contains(&row[0]))
        .collect();
    let frequencies: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let config = bench.json(&format!("config show --config {profile}"));
    let answers = truth::ask_of(
        "plants.py",
        &[json!({"what": "frf", "config": config, "frequency_hz": frequencies})],
    )?;
    let matching = rows
        .iter()
        .zip(answers[0].as_array().expect("a list"))
        .filter(|(row, truth)| {
            let (re, im) = (number(&truth[0]), number(&truth[1]));
            let turns = (row[2] - im.atan2(re).to_degrees()) / 360.0;
            (row[1] / re.hypot(im) - 1.0).abs() < 0.01
                && (360.0 * (turns - turns.round())).abs() < 1.0
        });
    Some(matching.count() as f64 / rows.len() as f64)
}

#[test]
fn noiseless_chirp_is_within_1_percent_and_1_degree_for_each_plant() {
    for (profile, band_hz) in [
        ("xy", (2.0, 350.0)),
        ("three-mass", (0.025, 0.28)),
        ("four-mass", (0.4, 8.0)),
    ] {
        let Some(share) = share_of_accurate_rows(profile, band_hz) else {
            return;
        };
        println!("{profile} {share}");
        assert!(
            share > 0.99,
            "{profile}: {share} of the response is within 1 % and 1 degree"
        );
    }
}

#[test]
fn each_plant_runs_with_its_controller_and_rejects_those_of_the_stage() {
    let bench = Bench::new();
    for profile in ["xy", "three-mass", "four-mass"] {
        let answer = bench.json(&format!("control --config {profile}"));
        assert_eq!(answer["outcome"], "completed", "{profile}");
        assert!(
            number(&answer["predicted"]["modulus_margin"]) > 0.5,
            "{profile}"
        );
        let settling = |source: &str| number(&answer[source]["settling_time_s"]);
        // Noise and the residual oscillation of the first mode affect the time at which the error stays below 2 %.
        near(
            "the ratio of measured and predicted settling time",
            settling("measured") / settling("predicted"),
            1.0,
            0.1,
        );
        // The slow and the fast controller are designed for the gain of the SR4DoF stage; the fast one also needs a higher sampling rate.
        let refused = |choice: &str, words: &[&str]| {
            bench
                .run(&format!("control --config {profile} {choice}"))
                .is_refused(words)
        };
        refused(
            "--slow",
            &[
                "slow controller",
                "below the limit of 0.3",
                "--controller FILE",
                "nothing was moved",
            ],
        );
        refused("--fast", &["fast"]);
    }
}

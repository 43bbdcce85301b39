//! Requirements for `bench chirp --until-decided` and `bench campaign`: shots within the limits, results of all shots,
//! recordings that are complete after a stop. Verdicts over the grid are in the statistical suite.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use bench_config::Config;
use bench_experiment::sequential::{
    SequenceEnd, SequenceLimits, ShotSummary, default_max_motion_s, until_decided,
};
use bench_experiment::{Plan, Runner, Setup};
use bench_identify::verdict::{Cnmp, MAX_LOOKS};
use bench_recording::Recording;
use bench_test_support::identified::{config, truth};
use bench_test_support::program::{Bench, near, number};
use bench_test_support::sequences::{decided, sequence};

fn settings(more: &[&str]) -> Config {
    let rate = ["loop.rate_hz=1000.0", "chirp.stop_hz=450.0"];
    let sets = rate.iter().chain(more).map(|set| set.to_string());
    config(&sets.collect::<Vec<String>>())
}

fn recordings(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|end| end == "mcap"))
        .collect();
    paths.sort();
    paths
}

/// Noise and a point beside the border of the region with CNMP zeros that make a second shot necessary.
const HARD: [&str; 3] = [
    "sim.probe_noise_rms_m=8e-6",
    "plant.operating_point_m=0.0038",
    "plant.mass_asymmetry=0.01",
];

#[test]
fn shots_stay_within_travel_current_and_motion() {
    let config = settings(&HARD);
    let folder = tempfile::tempdir().expect("a folder");
    let limit_s = default_max_motion_s(&config).expect("a model");
    let ended = sequence(&config, folder.path(), limit_s, |_, _| {});
    let shots = ended.shots.len();
    assert!((2..=MAX_LOOKS).contains(&shots), "{shots}");
    let is_detected = truth(&config) > 0;
    let last = ended.shots.last().expect("a shot");
    assert_eq!(last.cnmp == Cnmp::Detected, is_detected);
    let motion_s = ended.motion_s;
    assert!(motion_s > 3.0 && motion_s <= limit_s, "{motion_s}");
    // A third of the soft limit and six standard deviations of the probe; half of the permitted current: sqrt(2) 26 N / 11.12 N/A.
    let travel_m = 0.0009 / 3.0 + 6.0 * 8e-6;
    let current_a = 0.5 * std::f64::consts::SQRT_2 * 26.0 / 11.12;
    for path in recordings(folder.path()) {
        let recording = Recording::open(&path).expect("a recording");
        let ticks = recording.ticks().expect("ticks");
        let ticks: Vec<_> = ticks.map(|tick| tick.expect("a tick")).collect();
        let largest =
            |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |a, b| a.max(b.abs()));
        let moved_m = largest(&mut ticks.iter().map(|tick| tick.position_m));
        let driven_a = largest(&mut ticks.iter().map(|tick| tick.command_a));
        assert!(moved_m > 10e-6 && moved_m < travel_m, "{moved_m}");
        assert!(
            driven_a > 0.01 && driven_a <= current_a * 1.000_001,
            "{driven_a}"
        );
    }
}

#[test]
fn ends_after_two_shots_where_no_motion_decides() {
    let ended = decided(&settings(&["plant.operating_point_m=0"]));
    assert_eq!(
        (ended.end, ended.shots.len()),
        (SequenceEnd::Undecidable, 2)
    );
}

#[test]
fn no_shot_begins_after_a_stop() {
    let config = settings(&HARD);
    let folder = tempfile::tempdir().expect("a folder");
    let limit_s = default_max_motion_s(&config).expect("a model");
    let stops = |_: &ShotSummary, stop: &AtomicBool| stop.store(true, Ordering::Relaxed);
    let ended = sequence(&config, folder.path(), limit_s, stops);
    assert_eq!(
        (ended.end, ended.shots.len()),
        (SequenceEnd::Interrupted, 1)
    );
    let recording = Recording::open(&recordings(folder.path())[0]).expect("a recording");
    assert!(!recording.truncated());
}

#[test]
fn sequence_keeps_to_its_limit_of_motion() {
    let config = settings(&HARD);
    let folder = tempfile::tempdir().expect("a folder");
    let ended = sequence(&config, folder.path(), 4.2, |_, _| {});
    assert!(ended.motion_s <= 4.2 && ended.motion_s > 2.0);
    assert!(
        matches!(
            ended.end,
            SequenceEnd::LimitReached | SequenceEnd::NeedsMoreMotion { .. }
        ),
        "{:?}",
        ended.end
    );
}

#[test]
fn losses_of_each_shot_are_counted() {
    let config = settings(&HARD);
    let folder = tempfile::tempdir().expect("a folder");
    let max_motion_s = default_max_motion_s(&config).expect("a model");
    let stop = AtomicBool::new(false);
    let limits = SequenceLimits {
        max_motion_s,
        stop: &stop,
    };
    let runner = Runner::new(Setup::simulated(folder.path().into()));
    let mut made = 0;
    // Records that the loop lost at the end of the first run, after the last one that was recorded.
    let mut make_run = |plan: &Plan| {
        let mut run = runner.run(plan, "shot")?;
        made += 1;
        run.end.servo.lost_records = if made == 1 { 3 } else { 0 };
        Ok(run)
    };
    let sequence = until_decided(&config, limits, &mut make_run, &mut |_| {}).expect("shots");
    let lost: Vec<u64> = sequence
        .shots
        .iter()
        .map(|shot| shot.lost_records)
        .collect();
    assert!(lost.len() >= 2 && lost[0] == 3, "{lost:?}");
    assert!(lost[1..].iter().all(|lost| *lost == 0), "{lost:?}");
    assert!(sequence.shots.iter().all(|shot| shot.overruns == 0));
}

#[test]
fn command_reports_shots_verdict_and_page_of_all_shots() {
    let bench = Bench::new();
    let json = bench.json("chirp --until-decided --out .");
    // The default stage has one pair of CNMP zeros (docs/excitation-and-estimators.md).
    assert_eq!(json["cnmp"], "detected", "{json}");
    assert_eq!(json["sequence"]["end"], "decided");
    let shots = json["shots"].as_array().expect("shots");
    let sum: f64 = shots.iter().map(|shot| number(&shot["duration_s"])).sum();
    let motion_s = number(&json["motion_s"]);
    near("motion", motion_s, sum, 1e-9);
    assert!((2.0..20.0).contains(&motion_s), "{motion_s}");
    let recordings = bench.files().into_iter();
    let recordings = recordings.filter(|name| name.ends_with(".mcap"));
    assert_eq!(recordings.count(), shots.len());
    assert_eq!(json["certificate"], serde_json::Value::Null);
    let page = bench.read(json["report"].as_str().expect("a page"));
    let low_hz = number(&shots[0]["low_hz"]);
    let named = format!("{} chirp", shots.len());
    assert!(page.contains(&named) && page.contains(&format!("{low_hz:.1} to")));
}

#[test]
fn refuses_options_that_the_planner_chooses() {
    let bench = Bench::new();
    for option in [
        "--duration 5s",
        "--amplitude 0.1A",
        "--excitation prbs",
        "--shape model",
        "--sweep linear",
    ] {
        let (name, _) = option.split_once(' ').expect("a value");
        let answer = bench.run(&format!("chirp --until-decided {option}"));
        answer.is_refused(&["--until-decided", name]);
    }
    let answer = bench.run("chirp --max-duration 5s");
    answer.is_refused(&["--until-decided"]);
    let answer = bench.run("chirp --until-decided --max-duration 0.5s");
    answer.is_refused(&["--max-duration is 0.5s", "first chirp takes 3."]);
    assert!(bench.files().is_empty());
}

#[test]
fn campaign_has_the_verdicts_of_the_model_in_seconds_of_motion_a_point() {
    let bench = Bench::new();
    let grid = "--operating-points 4%:8%:2 --asymmetries -5%:5%:2 --out quick";
    let json = bench.json(&format!("campaign {grid}"));
    let points = json["points"].as_array().expect("points");
    assert_eq!(points.len(), 4);
    for point in points {
        let has_pairs = number(&point["model_damped_cnmp_pairs"]) > 0.0;
        let expected = if has_pairs { "detected" } else { "excluded" };
        assert_eq!(point["cnmp"], expected, "{point}");
        let motion_s = number(&point["motion_s"]);
        assert!((2.0..30.0).contains(&motion_s), "{point}");
    }
    // The folder belongs to this method.
    let answer = bench.run(&format!("campaign --single-chirp {grid}"));
    answer.is_refused(&["method"]);
}

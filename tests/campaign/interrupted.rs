//! An interrupted campaign continues to the same result; files of another campaign are rejected or measured again.
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench_config::{Source, load};
use bench_experiment::campaign::{Grid, GridPoint, Method, PointResult, Store};
use bench_identify::verdict::Cnmp;
use serde_json::Value;

use crate::campaign::program::{Bench, NO_DAEMON};

/// 4 x 3 points, each with the shortest chirp that passes over all modes.
const GRID: &str = "campaign --operating-points 2%:8%:4 --asymmetries -5%:10%:3 --out c --threads 2 --single-chirp \
                    --set chirp.start_hz=5 --set chirp.duration_s=8 --set chirp.fade_in_s=0.5 --set chirp.quiet_after_s=2";
/// Time limit of a wait, not a requirement.
const WAIT_LIMIT: Duration = Duration::from_secs(240);

fn start(bench: &Bench) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    command
        .current_dir(bench.path(""))
        .envs([NO_DAEMON])
        .args(GRID.split_whitespace())
        .stdin(Stdio::null());
    command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// Existing files of points.
fn points(bench: &Bench) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(bench.path("c/points")) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect();
    files.sort();
    files
}

/// Sends a signal when three points are finished; returns the exit code and the messages.
fn interrupted(bench: &Bench, number: i32) -> (Option<i32>, String) {
    let mut child = start(bench);
    let deadline = Instant::now() + WAIT_LIMIT;
    while points(bench).len() < 3 {
        assert!(
            child.try_wait().expect("the child process").is_none(),
            "the program ended before the signal"
        );
        assert!(
            Instant::now() < deadline,
            "three points are not written within {WAIT_LIMIT:?}"
        );
        std::thread::sleep(Duration::from_millis(10));
    }
    // SAFETY: the child has not been waited for, so its process id is still valid.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, number) }, 0);
    let output = child.wait_with_output().expect("the child process");
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("whole JSON")
}

/// Number of circles with this attribute: dots have a fill, rings a stroke.
fn circles(svg: &str, attribute: &str) -> usize {
    svg.lines()
        .filter(|line| line.starts_with("<circle") && line.contains(attribute))
        .count()
}

#[test]
fn interrupted_campaign_continues_to_the_same_result() {
    let whole = Bench::new();
    let answer = whole.run(&format!("{GRID} --json"));
    assert_eq!(answer.code, 0, "{}", answer.err);
    let report = answer.json();
    let count = |what: &str| report["totals"][what].as_u64().expect("a count") as usize;
    assert_eq!(
        (
            count("points"),
            count("detected") + count("excluded") + count("undecided")
        ),
        (12, 12)
    );
    assert_eq!(
        report["agreement"]["contradicted_as_simulated"], 0,
        "wrong verdicts: {report}"
    );
    // One dot per verdict on each map, and one in the legend. With an estimated offset there are two maps.
    let (svg, maps) = (
        whole.read("c/campaign.svg"),
        if report["offset"].is_null() { 1 } else { 2 },
    );
    assert_eq!(
        circles(&svg, "fill=\"#D55E00\""),
        maps * (count("detected") + 1)
    );
    assert_eq!(
        circles(&svg, "stroke=\"#0072B2\""),
        maps * (count("excluded") + 1)
    );

    for (number, expected) in [(libc::SIGKILL, None), (libc::SIGINT, Some(1))] {
        let stopped = Bench::new();
        let (code, messages) = interrupted(&stopped, number);
        assert_eq!(code, expected, "{messages}");
        let finished = points(&stopped);
        assert!((3..12).contains(&finished.len()), "{finished:?}");
        finished.iter().for_each(|path| {
            assert_eq!(
                json(path),
                json(&whole.path("c/points").join(path.file_name().unwrap()))
            )
        });
        let continued = stopped.run(&format!("{GRID} --json"));
        assert!(
            continued.err.contains(&format!(
                "{} of 12 points are finished already",
                finished.len()
            )),
            "{}",
            continued.err
        );
        assert_eq!((continued.code, &continued.out), (0, &answer.out));
    }

    // If the file of a point is damaged or belongs to another point, the point is measured again.
    let files = points(&whole);
    let text = std::fs::read_to_string(&files[0]).expect("a file");
    std::fs::write(&files[0], &text[..text.len() / 2]).expect("a writable folder");
    std::fs::copy(&files[1], &files[2]).expect("a writable folder");
    let again = whole.run(&format!("{GRID} --json"));
    for words in [
        "is torn or damaged",
        "is of another campaign or another point",
        "10 of 12 points are finished already",
    ] {
        assert!(again.err.contains(words), "{}", again.err);
    }
    assert_eq!((again.code, &again.out), (0, &answer.out));

    // Different settings are rejected; the message lists the differences.
    for (arguments, difference) in [
        (
            format!("{GRID} --seed 7"),
            "`config.sim.seed` is 1 there, 7 here",
        ),
        (
            GRID.replace("10%:3", "10%:2"),
            "`asymmetries.2` is 0.1 there, null here",
        ),
    ] {
        let other = whole.run(&arguments);
        assert!(
            other.code == 2
                && other
                    .err
                    .contains("contains a campaign with other settings"),
            "{other:?}"
        );
        assert!(other.err.contains(difference), "{other:?}");
    }
    assert_eq!(points(&whole), files);
}

#[test]
fn rejects_folder_of_another_program_and_does_not_change_it() {
    let bench = Bench::new();
    std::fs::create_dir(bench.path("c")).expect("a writable folder");
    for text in ["", "not JSON", "{\"format\": \"bench study 1\"}", "[1, 2]"] {
        bench.write("c/campaign.json", text);
        let answer = bench.run(GRID);
        assert!(
            answer.code == 2 && answer.err.contains("does not belong to a campaign"),
            "{answer:?}"
        );
        assert_eq!(bench.read("c/campaign.json"), text);
    }
    assert_eq!(bench.files(), ["c"]);
}

#[test]
fn rejects_invalid_campaigns_with_the_reason() {
    let bench = Bench::new();
    for (arguments, words) in [
        (
            "campaign --config lab --set amplifier.device.interface=no-such-can --set probe.device.line.port=/dev/ttyNONE9",
            "standard input is not a terminal; start it in a terminal, or add --simulate",
        ),
        ("campaign --config xy", "the model `xy` does not have both"),
        ("campaign --asymmetry 2%", "because a campaign varies both"),
        (
            "campaign --operating-points 0%:200%:3",
            "beyond the length of the beams",
        ),
        (
            "campaign --operating-points 0%:8%:2000 --asymmetries -10%:10%:10",
            "20000 points",
        ),
        (
            "campaign --operating-points 0:0.08:3",
            "`0.08` has no unit; write 8% for a ratio of 0.08 of the beam length, or 0.08m for metres",
        ),
        (
            "campaign --asymmetry-tolerance 0",
            "--asymmetry-tolerance is 0",
        ),
        (
            "campaign --operating-point-tolerance 0.002",
            "`0.002` has no unit; write 0.2%",
        ),
        (
            "campaign --operating-point-tolerance 5cm",
            "unknown unit `cm`",
        ),
        (
            "campaign --operating-point-tolerance 100%",
            "--operating-point-tolerance is 100%; give a length between 0 and the beam length",
        ),
        (
            "chirp --config xy --set sim.asymmetry_offset=0.01",
            "`xy` has no mass asymmetry",
        ),
        (
            "chirp --asymmetry -0.8 --set sim.asymmetry_offset=-0.2",
            "m2 is too small",
        ),
    ] {
        let answer = bench.run(arguments);
        assert!(
            answer.code == 2 && answer.err.contains(words),
            "{arguments}: {answer:?}"
        );
    }
    assert_eq!(bench.files(), [""; 0]);
}

#[test]
fn rejects_results_of_simulation_for_devices_and_the_reverse() {
    let config = load(&Source::default()).expect("the default profile");
    let grid = Grid::new(vec![0.0, 0.08], vec![0.1], &config).expect("a grid");
    let point = PointResult {
        cnmp: Cnmp::Excluded,
        why: String::new(),
        modes_hz: vec![29.3],
        signs: "+".into(),
        zeros_rad_s: Vec::new(),
        loop_digest: String::new(),
        motion_s: None,
        load_check: None,
    };
    for simulated_first in [true, false] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let open = |on_devices| {
            Store::open(
                folder.path(),
                &grid,
                &config,
                on_devices,
                Method::SingleChirp,
            )
        };
        let first = open(!simulated_first).expect("a new folder");
        first
            .store
            .add(GridPoint { row: 1, column: 0 }, &point)
            .expect("a point");
        drop(first);
        let error = open(simulated_first)
            .expect_err("the results are of the other kind of stage")
            .to_string();
        assert!(
            error.contains("other settings") && error.contains("`on_devices` is "),
            "{error}"
        );
        assert_eq!(open(!simulated_first).expect("the same").done.len(), 1);
    }
}

/// A folder with one finished point, and the file of the point.
fn store_with_one_point(folder: &Path, grid: &Grid, point: &PointResult) -> PathBuf {
    let config = load(&Source::default()).expect("the default profile");
    let opened =
        Store::open(folder, grid, &config, false, Method::SingleChirp).expect("a new folder");
    let place = GridPoint { row: 1, column: 0 };
    opened.store.add(place, point).expect("a point");
    folder.join("points/0001-0000.json")
}

fn measured_point() -> PointResult {
    PointResult {
        cnmp: Cnmp::Detected,
        why: "two zeros".into(),
        modes_hz: vec![29.3, 101.25],
        signs: "+-".into(),
        zeros_rad_s: vec![[12.5, 340.0]],
        loop_digest: "0123456789abcdef".into(),
        motion_s: None,
        load_check: None,
    }
}

#[test]
fn altered_file_of_a_point_is_not_used() {
    let config = load(&Source::default()).expect("the default profile");
    let grid = Grid::new(vec![0.0, 0.08], vec![0.1], &config).expect("a grid");
    let point = measured_point();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = store_with_one_point(folder.path(), &grid, &point);
    let bytes = std::fs::read(&path).expect("the file of the point");
    let mut rejected = 0;
    for at in 0..bytes.len() {
        let mut altered = bytes.clone();
        altered[at] ^= 1 << (at % 7);
        std::fs::write(&path, altered).expect("room");
        let opened = Store::open(folder.path(), &grid, &config, false, Method::SingleChirp)
            .expect("the folder");
        rejected += opened.rejected.len();
        // Spaces between the values may be altered.
        for (_, result) in opened.done {
            assert_eq!(result, point, "byte {at}");
        }
        assert_eq!(opened.unverified, 0, "byte {at}");
    }
    assert!(
        (bytes.len() / 2..=bytes.len()).contains(&rejected),
        "{rejected}"
    );
}

#[test]
fn file_of_a_point_without_checksum_is_used_and_counted() {
    let config = load(&Source::default()).expect("the default profile");
    let grid = Grid::new(vec![0.0, 0.08], vec![0.1], &config).expect("a grid");
    let point = measured_point();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = store_with_one_point(folder.path(), &grid, &point);
    let mut record = json(&path);
    let removed = record
        .as_object_mut()
        .expect("an object")
        .remove("checksum");
    assert!(removed.is_some_and(|checksum| checksum.is_string()));
    std::fs::write(&path, record.to_string()).expect("room");
    let opened =
        Store::open(folder.path(), &grid, &config, false, Method::SingleChirp).expect("the folder");
    assert_eq!((opened.done.len(), opened.unverified), (1, 1));
    assert_eq!(opened.done[0].1, point);
}

#[test]
fn asymmetry_offset_applies_to_the_simulated_stage_and_not_to_the_model() {
    let bench = Bench::new();
    let short = "--set chirp.duration_s=8 --set chirp.start_hz=5 --set chirp.fade_in_s=0.5 --set chirp.quiet_after_s=1";
    let digest = |more: &str| bench.json(&format!("chirp {short} {more}"))["loop_digest"].clone();
    // 0.125 - 0.125 is 0 without rounding: an identical stage.
    let with_offset = digest("--asymmetry 0.125 --set sim.asymmetry_offset=-0.125");
    assert_eq!(with_offset, digest("--asymmetry 0"));
    assert_ne!(with_offset, digest("--asymmetry 0.125"));
    let model = bench.json("model modes --asymmetry 0.125 --set sim.asymmetry_offset=-0.125");
    assert_eq!(model["mass_asymmetry"], 0.125);
}

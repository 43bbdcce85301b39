//! An interrupted campaign continues to the same result; foreign files are refused or measured again.
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use bench::config::{Source, load};
use bench::experiment::campaign::{Grid, GridPoint, PointResult, Store};
use bench::identify::verdict::Cnmp;
use serde_json::Value;

use crate::program::Bench;

/// 4 x 3 points, each with the shortest chirp that passes over all modes.
const GRID: &str = "campaign --operating-points 2%:8%:4 --asymmetries -5%:10%:3 --out c --threads 2 \
                    --set chirp.start_hz=5 --set chirp.duration_s=8 --set chirp.fade_in_s=0.5 --set chirp.quiet_after_s=2";
/// Time limit of a wait, not a requirement.
const PATIENCE: Duration = Duration::from_secs(240);

fn start(bench: &Bench) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench"));
    command
        .current_dir(bench.path(""))
        .args(GRID.split_whitespace())
        .stdin(Stdio::null());
    command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts")
}

/// Files of points that are there.
fn points(bench: &Bench) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(bench.path("c/points")) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut whole: Vec<PathBuf> = paths
        .filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect();
    whole.sort();
    whole
}

/// Sends a signal when three points are finished; returns the exit code and the messages.
fn interrupted(bench: &Bench, number: i32) -> (Option<i32>, String) {
    let mut child = start(bench);
    let patience = Instant::now() + PATIENCE;
    while points(bench).len() < 3 {
        assert!(
            child.try_wait().expect("a child of ours").is_none(),
            "it ended early"
        );
        assert!(Instant::now() < patience, "nothing is written");
        std::thread::sleep(Duration::from_millis(10));
    }
    // SAFETY: a child of ours that nobody has waited for yet, so its id is its own.
    assert_eq!(unsafe { libc::kill(child.id() as libc::pid_t, number) }, 0);
    let output = child.wait_with_output().expect("a child of ours");
    (
        output.status.code(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("a file")).expect("whole JSON")
}

/// Circles of a colour in a picture, as dots (filled) or rings.
fn circles(svg: &str, attribute: &str) -> usize {
    svg.lines()
        .filter(|line| line.starts_with("<circle") && line.contains(attribute))
        .count()
}

#[test]
fn an_interrupted_campaign_continues_to_the_same_result() {
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
        "never a wrong verdict: {report}"
    );
    // One dot a verdict on each of the maps, of which there are two where an offset is told, and one in the legend.
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
        let broken = Bench::new();
        let (code, said) = interrupted(&broken, number);
        assert_eq!(code, expected, "{said}");
        let kept = points(&broken);
        assert!((3..12).contains(&kept.len()), "{kept:?}");
        kept.iter().for_each(|path| {
            assert_eq!(
                json(path),
                json(&whole.path("c/points").join(path.file_name().unwrap()))
            )
        });
        let going_on = broken.run(&format!("{GRID} --json"));
        assert!(
            going_on
                .err
                .contains(&format!("{} of 12 points are finished already", kept.len())),
            "{}",
            going_on.err
        );
        assert_eq!((going_on.code, &going_on.out), (0, &answer.out));
    }

    // A damaged file, or one of another point, does not count: the point is measured again.
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

    // Other settings are refused with the difference.
    for (arguments, named) in [
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
            other.code == 2 && other.err.contains("holds a campaign with other settings"),
            "{other:?}"
        );
        assert!(other.err.contains(named), "{other:?}");
    }
    assert_eq!(points(&whole), files);
}

#[test]
fn refuses_a_folder_of_something_else_and_does_not_change_it() {
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
    for (arguments, words) in [
        (
            "campaign --config lab",
            "standard input is not a terminal; start it in a terminal, or add --simulate",
        ),
        ("campaign --config xy", "the model `xy` does not have both"),
        ("campaign --asymmetry 2%", "set what a campaign varies"),
        (
            "campaign --operating-points 0%:200%:3",
            "beyond the length of the beams",
        ),
        (
            "campaign --operating-points 0%:8%:2000 --asymmetries -10%:10%:10",
            "20000 points",
        ),
        (
            "campaign --asymmetry-tolerance 0",
            "--asymmetry-tolerance is 0",
        ),
        (
            "chirp --config xy --set sim.asymmetry_offset=0.01",
            "`xy` has no mass asymmetry",
        ),
        (
            "chirp --asymmetry -0.8 --set sim.asymmetry_offset=-0.2",
            "m2 would be too small",
        ),
    ] {
        let answer = bench.run(arguments);
        assert!(
            answer.code == 2 && answer.err.contains(words),
            "{arguments}: {answer:?}"
        );
    }
    assert_eq!(bench.files(), ["c"]);
}

#[test]
fn points_of_the_simulated_stage_do_not_count_for_devices() {
    let config = load(&Source::default()).expect("the default profile");
    let grid = Grid::new(vec![0.0, 0.08], vec![0.1], &config).expect("a grid");
    let point = PointResult {
        cnmp: Cnmp::Excluded,
        why: String::new(),
        modes_hz: vec![29.3],
        signs: "+".into(),
        zeros_rad_s: Vec::new(),
        loop_digest: String::new(),
        load_check: None,
    };
    for simulated_first in [true, false] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let open = |on_devices| Store::open(folder.path(), &grid, &config, on_devices);
        let first = open(!simulated_first).expect("a new folder");
        first
            .store
            .add(GridPoint { row: 1, column: 0 }, &point)
            .expect("a point");
        drop(first);
        let error = open(simulated_first)
            .expect_err("the other stage")
            .to_string();
        assert!(
            error.contains("other settings") && error.contains("`on_devices` is "),
            "{error}"
        );
        assert_eq!(open(!simulated_first).expect("the same").done.len(), 1);
    }
}

#[test]
fn the_simulated_stage_has_the_offset_and_the_model_does_not() {
    let bench = Bench::new();
    let short = "--set chirp.duration_s=8 --set chirp.start_hz=5 --set chirp.fade_in_s=0.5 --set chirp.quiet_after_s=1";
    let digest = |more: &str| bench.json(&format!("chirp {short} {more}"))["loop_digest"].clone();
    // 0.125 - 0.125 is 0 without rounding: the very same stage.
    let made = digest("--asymmetry 0.125 --set sim.asymmetry_offset=-0.125");
    assert_eq!(made, digest("--asymmetry 0"));
    assert_ne!(made, digest("--asymmetry 0.125"));
    let model = bench.json("model modes --asymmetry 0.125 --set sim.asymmetry_offset=-0.125");
    assert_eq!(model["mass_asymmetry"], 0.125);
}

//! Study files, campaign folders, and the thermal state of the motor.

use std::path::Path;

use bench_config::{Config, Source, load};
use bench_experiment::campaign::{Grid, GridPoint, Method, PointResult, Store};
use bench_identify::verdict::Cnmp;
use bench_rig::motor::{Moment, MotorMemory};
use bench_study::{Block, Plan, Shard, StudyFile};

use crate::random_inputs::damage::check_damaged;

fn stage() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

fn moment(unix_s: f64) -> Moment {
    Moment {
        unix_s,
        boot: "boot".into(),
        since_boot_s: unix_s - 1.7e9,
    }
}

#[test]
fn damaged_thermal_state_is_that_of_the_file_or_hot() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("motor.json");
    let mut config = stage();
    config.interlock.heat_file = Some(path.display().to_string());
    let memory = MotorMemory::of(&config).expect("a path");
    let (then, now) = (moment(1.79e9), moment(1.79e9 + 60.0));
    memory.store(2.5, "drive 1", &then).expect("a file");
    let valid = std::fs::read(&path).expect("the file");
    let true_a2 = memory.read(Some("drive 1"), &now).thermal_a2;
    let limit_a2 = memory.model().limit_a2;
    assert!(true_a2 > 0.0 && true_a2 < limit_a2);
    check_damaged("thermal state", &[&valid], |bytes| {
        std::fs::write(&path, bytes).expect("a file");
        let state = memory.read(Some("drive 1"), &now);
        let is_true = (state.thermal_a2 - true_a2).abs() <= 1e-12 * true_a2;
        assert!(is_true || state.thermal_a2 == limit_a2, "{state:?}");
        is_true
    });
}

fn result(index: usize) -> PointResult {
    PointResult {
        cnmp: Cnmp::Undecided,
        why: format!("point {index}"),
        modes_hz: vec![3.25, 27.5, 93.0 + index as f64],
        signs: "+-+".into(),
        zeros_rad_s: vec![[0.1, 200.0]],
        loop_digest: "0123456789abcdef".into(),
        motion_s: None,
        load_check: None,
    }
}

#[test]
fn damaged_point_of_a_campaign_is_the_measured_one_or_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = stage();
    let grid = Grid::new(vec![0.02, 0.04], vec![0.0], &config).expect("a grid");
    let point = grid.points().next().expect("a point");
    let open = || Store::open(folder.path(), &grid, &config, false, Method::SingleChirp);
    open()
        .and_then(|opened| opened.store.add(point, &result(0)))
        .expect("a stored point");
    let path = only_file(&folder.path().join("points"));
    let valid = std::fs::read(&path).expect("the file");
    check_damaged("point of a campaign", &[&valid], |bytes| {
        std::fs::write(&path, bytes).expect("a file");
        let opened = open().expect("campaign.json is intact");
        let expected: &[(GridPoint, PointResult)] = &[(point, result(0))];
        if opened.done.is_empty() {
            assert_eq!(opened.rejected.len(), 1)
        } else {
            assert!(opened.done == expected, "{:?}", opened.done)
        }
        !opened.done.is_empty()
    });
}

fn only_file(folder: &Path) -> std::path::PathBuf {
    let mut entries = std::fs::read_dir(folder).expect("a folder");
    entries.next().expect("a file").expect("an entry").path()
}

/// Draws of a block, and blocks of the study.
const DRAWS: u64 = 500;
const BLOCKS: u64 = 3;

/// A block with a pattern of counts.
fn block(first: u64) -> Block {
    Block {
        first,
        cnmp_pairs: (0..DRAWS as u32)
            .map(|draw| Some((first as u32 + draw) % 3))
            .collect(),
        damped_cnmp_pairs: Vec::new(),
        failures: Vec::new(),
    }
}

fn write_study(path: &Path, plan: &Plan) {
    let mut opened = StudyFile::open(path, plan, Shard::WHOLE).expect("a new study");
    for index in 0..BLOCKS {
        opened.file.append(&block(index * DRAWS)).expect("a block");
    }
}

#[test]
fn damaged_study_gives_only_stored_blocks_or_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("random.study");
    let tolerances = ["plant.mass_asymmetry=+-10%".parse().expect("a tolerance")];
    let plan = Plan::new(&stage(), &tolerances, BLOCKS * DRAWS, false).expect("a plan");
    write_study(&path, &plan);
    let valid = std::fs::read(&path).expect("the file");
    check_damaged("study", &[&valid], |bytes| {
        std::fs::write(&path, bytes).expect("a file");
        let Ok(opened) = StudyFile::open(&path, &plan, Shard::WHOLE) else {
            return false;
        };
        for found in opened.results.blocks() {
            assert_eq!(found, &block(found.first));
        }
        opened.results.is_done()
    });
}

//! The stage with the fast controller, and the certificate of its chirp.
use std::path::PathBuf;
use std::sync::OnceLock;

use bench_config::{Config, Purpose, Source, load};
use bench_experiment::Plan;
use bench_test_support::program::run_in;
use serde_json::Value;
use tempfile::TempDir;

/// The settings of all runs: a short chirp that contains all modes of the model.
pub const SETTINGS: &str = "--set control.controller=fast --set chirp.start_hz=0.5 --set chirp.stop_hz=200 \
     --set chirp.duration_s=40";

/// A completed chirp with its files.
pub struct Chirp {
    folder: TempDir,
    pub report: Value,
}

impl Chirp {
    /// `bench chirp` with more options.
    pub fn new(more: &str) -> Chirp {
        let folder = tempfile::tempdir().expect("a folder");
        let arguments = format!("chirp {SETTINGS} --json --out . {more}");
        let answer = run_in(folder.path(), arguments.split_whitespace());
        assert_eq!(answer.code, 0, "{}", answer.err);
        let report = answer.json();
        Chirp { folder, report }
    }

    /// A file whose path is in the report.
    pub fn file(&self, key: &str) -> PathBuf {
        let path = self.report[key].as_str().expect("a path");
        self.folder.path().join(path)
    }

    pub fn text(&self, key: &str) -> String {
        std::fs::read_to_string(self.file(key)).expect("a file")
    }
}

/// The chirp of the stage as it is modelled.
pub fn chirp() -> &'static Chirp {
    static CHIRP: OnceLock<Chirp> = OnceLock::new();
    CHIRP.get_or_init(|| Chirp::new(""))
}

/// The chirp of a stage with D = -10 %, while the model has +10 %.
pub fn reversed_chirp() -> &'static Chirp {
    static CHIRP: OnceLock<Chirp> = OnceLock::new();
    CHIRP.get_or_init(|| Chirp::new("--set sim.asymmetry_offset=-0.2"))
}

/// The configuration of a closed loop with more settings.
pub fn config(more: &[&str]) -> Config {
    let settings = SETTINGS.split_whitespace().filter(|word| *word != "--set");
    let sets = settings.chain(more.iter().copied()).map(String::from);
    load(&Source {
        sets: sets.collect(),
        purpose: Purpose::Control,
        ..Source::default()
    })
    .expect("valid settings")
}

/// A closed loop with the certificate of [`chirp`] and more settings.
pub fn plan(more: &[&str]) -> Plan {
    let mut config = config(more);
    let path = chirp().file("certificate");
    config.control.certificate = Some(path.display().to_string());
    Plan::control(config).expect("a plan")
}

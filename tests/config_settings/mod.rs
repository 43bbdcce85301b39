//! Settings: three layers of TOML, one schema, and messages with place, value, limit and remedy.
mod controller_files;
mod layers;
mod rejected;
mod schema;

use std::path::{Path, PathBuf};

use bench_test_support::program;

/// Commands that check all settings before they use them.
const COMMANDS: [&str; 5] = ["config check", "model modes", "margins", "chirp", "control"];

fn bench_config() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("bench-config")
}

/// The TOML files of a folder.
fn toml_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("an entry").path());
    let mut files: Vec<PathBuf> = entries
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    files
}

//! The profiles that are embedded in the program, and those of the user.

use std::path::{Path, PathBuf};

use bench_settings::EmbeddedFile;
use bench_settings::files::{find, own, own_folders};

/// The profile that is the base of all others.
pub const DEFAULT: &str = "stage";

/// All embedded profiles. To add one, add its file and its name here.
pub const PROFILES: &[EmbeddedFile] = bench_settings::embedded_files!("": "stage", "chapter2", "xy", "three-mass", "four-mass", "lab", "stage-step", "stage-tracking");

/// Whether an embedded profile or one of the user has this name.
pub fn is_known(name: &str) -> bool {
    find(PROFILES, name).is_some() || own(name, "").is_some()
}

/// Names and files of all own profiles.
pub fn own_profiles() -> Vec<(String, PathBuf)> {
    let folders = own_folders().into_iter();
    let mut profiles: Vec<_> = folders.flat_map(|folder| profiles_in(&folder)).collect();
    profiles.sort();
    profiles
}

fn profiles_in(folder: &Path) -> Vec<(String, PathBuf)> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let files =
        paths.filter(|path| path.is_file() && path.extension().is_some_and(|e| e == "toml"));
    let named = files.filter_map(|path| Some((path.file_stem()?.to_str()?.to_string(), path)));
    named.collect()
}

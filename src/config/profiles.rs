//! The profiles and controllers that are embedded in the program, and those of the user.

use std::path::{Path, PathBuf};

/// A TOML file of `bench-config/`, embedded.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedFile {
    /// Name of the file without its ending, as the user types it.
    pub name: &'static str,
    /// The text of the file.
    pub text: &'static str,
}

/// The profile that is the base of all others.
pub const DEFAULT: &str = "stage";

/// Embeds files of a folder of `bench-config/`, each by its name.
macro_rules! embedded {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$(EmbeddedFile {
            name: $name,
            text: include_str!(concat!("../../bench-config/", $folder, $name, ".toml")),
        }),*]
    };
}

/// All embedded profiles. To add one, add its file and its name here.
pub const PROFILES: &[EmbeddedFile] = embedded!("": "stage", "chapter2", "xy", "three-mass", "four-mass", "lab", "stage-step", "stage-tracking");

/// All embedded controllers. To add one, add its file and its name here.
pub const CONTROLLERS: &[EmbeddedFile] = embedded!("controllers/": "fast", "slow", "lab", "xy", "three-mass", "four-mass", "stage-disturbance", "lab-disturbance");

/// The entry called `name`.
pub fn find(list: &[EmbeddedFile], name: &str) -> Option<EmbeddedFile> {
    list.iter().copied().find(|entry| entry.name == name)
}

/// The names of a list, for messages.
pub fn names(list: &[EmbeddedFile]) -> String {
    let names: Vec<&str> = list.iter().map(|entry| entry.name).collect();
    names.join(", ")
}

/// Folders of own profiles: `bench-config` where the program runs, and `bench` in the user's configuration folder. Own
/// controllers are in the folder `controllers` of each.
pub fn own_folders() -> Vec<PathBuf> {
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let home = variable("HOME").map(|home| PathBuf::from(home).join(".config"));
    let user = variable("XDG_CONFIG_HOME").map(PathBuf::from).or(home);
    let user = user.map(|folder| folder.join("bench"));
    [Some(PathBuf::from("bench-config")), user]
        .into_iter()
        .flatten()
        .collect()
}

/// The file of the own profile called `name`; `kind` is the folder below, empty for profiles.
pub fn own(name: &str, kind: &str) -> Option<PathBuf> {
    // A path is not a name.
    let is_name = Path::new(name).file_name().is_some_and(|file| file == name);
    let folders = own_folders().into_iter().filter(|_| is_name);
    let mut files = folders.map(|folder| folder.join(kind).join(format!("{name}.toml")));
    files.find(|file| file.is_file())
}

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

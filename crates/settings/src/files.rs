//! TOML files by their name: embedded in the program, or the user's own.

use std::path::{Path, PathBuf};

use bench_base::input_file::{self, MAX_SETTINGS_BYTES};

use crate::ConfigError;

/// A TOML file of `bench-config/`, embedded.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedFile {
    /// Name of the file without its ending, as the user types it.
    pub name: &'static str,
    /// The text of the file.
    pub text: &'static str,
}

/// Embeds files of the crate's folder `bench-config/`, each by its name.
#[macro_export]
macro_rules! embedded_files {
    ($folder:literal: $($name:literal),* $(,)?) => {
        &[$($crate::EmbeddedFile {
            name: $name,
            text: include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/bench-config/", $folder, $name, ".toml")),
        }),*]
    };
}

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

fn read(name: &str, known: &[EmbeddedFile], what: &'static str) -> Result<String, ConfigError> {
    let folder = match what {
        "controller" => "controllers",
        _ => "",
    };
    let own = own(name, folder);
    let path = own.as_deref().unwrap_or(Path::new(name));
    if !path.exists() {
        return Err(ConfigError::NotFound {
            what,
            name: name.into(),
            known: names(known),
        });
    }
    input_file::read_text(path, MAX_SETTINGS_BYTES).map_err(|e| ConfigError::Unreadable {
        path: path.into(),
        why: e.to_string(),
    })
}

/// The text of an embedded file by its name, or of any file by its path.
pub fn text_of(
    name: &str,
    known: &[EmbeddedFile],
    what: &'static str,
) -> Result<String, ConfigError> {
    match find(known, name) {
        Some(embedded) => Ok(embedded.text.to_string()),
        None => read(name, known, what),
    }
}

/// The text of a file by its path.
pub fn text_of_file(name: &str, what: &'static str) -> Result<String, ConfigError> {
    read(name, &[], what)
}

//! The profiles and controllers that travel inside the program, so that it works in an empty directory.

/// A TOML file of `bench-config/`, embedded.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedFile {
    /// The name a person types.
    pub name: &'static str,
    /// The text of the file.
    pub text: &'static str,
}

/// The profile below all others.
pub const DEFAULT: &str = "stage";

/// All profiles. A new one is one file and one line.
pub const PROFILES: &[EmbeddedFile] = &[
    EmbeddedFile {
        name: "stage",
        text: include_str!("../../bench-config/stage.toml"),
    },
    EmbeddedFile {
        name: "chapter2",
        text: include_str!("../../bench-config/chapter2.toml"),
    },
    EmbeddedFile {
        name: "xy",
        text: include_str!("../../bench-config/xy.toml"),
    },
    EmbeddedFile {
        name: "three-mass",
        text: include_str!("../../bench-config/three-mass.toml"),
    },
    EmbeddedFile {
        name: "four-mass",
        text: include_str!("../../bench-config/four-mass.toml"),
    },
    EmbeddedFile {
        name: "lab",
        text: include_str!("../../bench-config/lab.toml"),
    },
];

/// All controllers. A new one is one file and one line.
pub const CONTROLLERS: &[EmbeddedFile] = &[
    EmbeddedFile {
        name: "fast",
        text: include_str!("../../bench-config/controllers/fast.toml"),
    },
    EmbeddedFile {
        name: "slow",
        text: include_str!("../../bench-config/controllers/slow.toml"),
    },
    EmbeddedFile {
        name: "lab",
        text: include_str!("../../bench-config/controllers/lab.toml"),
    },
    EmbeddedFile {
        name: "xy",
        text: include_str!("../../bench-config/controllers/xy.toml"),
    },
    EmbeddedFile {
        name: "three-mass",
        text: include_str!("../../bench-config/controllers/three-mass.toml"),
    },
    EmbeddedFile {
        name: "four-mass",
        text: include_str!("../../bench-config/controllers/four-mass.toml"),
    },
];

/// The entry called `name`.
pub fn find(list: &[EmbeddedFile], name: &str) -> Option<EmbeddedFile> {
    list.iter().copied().find(|entry| entry.name == name)
}

/// The names of a list, for messages.
pub fn names(list: &[EmbeddedFile]) -> String {
    list.iter()
        .map(|entry| entry.name)
        .collect::<Vec<_>>()
        .join(", ")
}

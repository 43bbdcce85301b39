//! The profiles and controllers that travel inside the program, so that it works in an empty directory.

/// A TOML file of `bench-config/`, embedded.
#[derive(Clone, Copy, Debug)]
pub struct Embedded {
    /// The name a person types.
    pub name: &'static str,
    /// The text of the file.
    pub text: &'static str,
}

/// The profile below all others.
pub const DEFAULT: &str = "stage";

/// All profiles. A new one is one file and one line.
pub const PROFILES: &[Embedded] = &[
    Embedded {
        name: "stage",
        text: include_str!("../../bench-config/stage.toml"),
    },
    Embedded {
        name: "chapter2",
        text: include_str!("../../bench-config/chapter2.toml"),
    },
    Embedded {
        name: "xy",
        text: include_str!("../../bench-config/xy.toml"),
    },
    Embedded {
        name: "three-mass",
        text: include_str!("../../bench-config/three-mass.toml"),
    },
    Embedded {
        name: "four-mass",
        text: include_str!("../../bench-config/four-mass.toml"),
    },
    Embedded {
        name: "lab",
        text: include_str!("../../bench-config/lab.toml"),
    },
];

/// All controllers. A new one is one file and one line.
pub const CONTROLLERS: &[Embedded] = &[
    Embedded {
        name: "fast",
        text: include_str!("../../bench-config/controllers/fast.toml"),
    },
    Embedded {
        name: "slow",
        text: include_str!("../../bench-config/controllers/slow.toml"),
    },
    Embedded {
        name: "lab",
        text: include_str!("../../bench-config/controllers/lab.toml"),
    },
    Embedded {
        name: "xy",
        text: include_str!("../../bench-config/controllers/xy.toml"),
    },
    Embedded {
        name: "three-mass",
        text: include_str!("../../bench-config/controllers/three-mass.toml"),
    },
    Embedded {
        name: "four-mass",
        text: include_str!("../../bench-config/controllers/four-mass.toml"),
    },
];

/// The entry called `name`.
pub fn find(list: &[Embedded], name: &str) -> Option<Embedded> {
    list.iter().copied().find(|entry| entry.name == name)
}

/// The names of a list, for messages.
pub fn names(list: &[Embedded]) -> String {
    list.iter()
        .map(|entry| entry.name)
        .collect::<Vec<_>>()
        .join(", ")
}

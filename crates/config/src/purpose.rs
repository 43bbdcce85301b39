//! The use of a configuration.

/// The use of a configuration: relations between settings that the command does not use are not checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Purpose {
    /// Models, margins.
    #[default]
    Model,
    /// An excitation.
    Chirp,
    /// A closed loop.
    Control,
    /// All commands.
    All,
    /// Reading, replay and identification of a recorded run, also of one that would be refused as a new run.
    Recorded,
}

impl Purpose {
    pub(super) fn includes(self, other: Purpose) -> bool {
        self == other || self == Purpose::All
    }
}

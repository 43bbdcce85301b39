//! The use of a configuration.

/// The use of a configuration: relations between settings that the command does not use are not checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Purpose {
    /// Models, margins, replay.
    #[default]
    Model,
    /// An excitation.
    Chirp,
    /// A closed loop.
    Control,
    /// All commands.
    All,
}

impl Purpose {
    pub(super) fn includes(self, other: Purpose) -> bool {
        self == other || self == Purpose::All
    }
}

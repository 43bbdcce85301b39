//! What the operator should know of an open port.

/// A setting that an open port did not accept. The port can be read nevertheless.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What differs from the configuration.
    pub what: String,
    /// The consequence, or what to do.
    pub remedy: &'static str,
}

//! Notes about an open port for the operator.

use std::fmt;

/// A setting that an open port did not accept. The port can be read nevertheless.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What differs from the configuration.
    pub what: String,
    /// The consequence, or what to do.
    pub remedy: &'static str,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy)
    }
}

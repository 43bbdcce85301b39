//! An error in a setting, with its place.

/// An error at the path of a setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Dotted path of the key.
    pub path: String,
    /// The error, with value, limit and remedy.
    pub what: String,
    /// Whether the key is missing: the error is in the table around it.
    pub missing: bool,
}

impl Finding {
    /// An error in the value of a key that is there.
    pub fn new(path: &str, what: impl Into<String>) -> Finding {
        Finding {
            path: path.into(),
            what: what.into(),
            missing: false,
        }
    }

    /// The path of the error: the key, or the table that lacks it.
    pub fn at(&self) -> &str {
        match self.path.rsplit_once('.') {
            Some((table, _)) if self.missing => table,
            _ => &self.path,
        }
    }
}

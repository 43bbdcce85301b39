//! A configuration that is refused.

use std::path::PathBuf;

/// A configuration that is refused, before any motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// Neither a profile nor a file.
    #[error("no {what} and no file has the name `{name}`; \
        {}give a file with its path", if known.is_empty() { String::new() } else { format!("there are {known}; ") })]
    NotFound {
        /// Profile or controller.
        what: &'static str,
        /// What was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The file is there but cannot be read.
    #[error("cannot read {path}: {why}")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's words.
        why: String,
    },
    /// The text is not TOML.
    #[error("{place} is not TOML: {why}")]
    Syntax {
        /// File or flag.
        place: String,
        /// The parser's error message, with line and column.
        why: String,
    },
    /// Keys, types, ranges or their combination are wrong.
    #[error("refused:\n{}", .0.join("\n"))]
    Refused(
        /// One line for each error, with its location in the configuration.
        Vec<String>,
    ),
}

impl ConfigError {
    /// The file, line or option that is wrong; of several the first.
    pub fn place(&self) -> Option<String> {
        match self {
            ConfigError::NotFound { name, .. } => Some(name.clone()),
            ConfigError::Unreadable { path, .. } => Some(path.display().to_string()),
            ConfigError::Syntax { place, .. } => Some(place.clone()),
            ConfigError::Refused(findings) => {
                let (place, _) = findings.first()?.split_once(": `")?;
                Some(place.trim().to_string())
            }
        }
    }
}

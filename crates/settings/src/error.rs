//! A configuration that is refused.

use std::path::PathBuf;

/// Largest number of errors in a message. The place of each is searched in all layers.
pub const MAX_ERRORS: usize = 50;

/// A configuration that is refused, before any motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The name is neither that of a profile or controller nor that of a file.
    #[error("no {what} and no file has the name `{name}`; \
        {}give the path of a file", if known.is_empty() { String::new() } else { format!("choose one of {known}, or ") })]
    NotFound {
        /// Profile or controller.
        what: &'static str,
        /// The given name.
        name: String,
        /// The known names.
        known: String,
    },
    /// The file exists but cannot be read.
    #[error("cannot read {path}: {why}; check that it is a file and that you may read it")]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        why: String,
    },
    /// The text is not TOML.
    #[error("{place} is not TOML; correct the line shown: {why}")]
    Syntax {
        /// File or flag.
        place: String,
        /// The parser's error message, with line and column.
        why: String,
    },
    /// A text that is not `KEY=VALUE`.
    #[error("--set {text}: {why}; write KEY=VALUE, as in plant.mass_asymmetry=0.05")]
    Assignment {
        /// The text.
        text: String,
        /// What is wrong.
        why: &'static str,
    },
    /// Keys, types, ranges or their combination are wrong.
    #[error("{}", refused(.0))]
    Refused(
        /// One line for each error, with its location in the configuration.
        Vec<String>,
    ),
}

fn refused(lines: &[String]) -> String {
    let text = lines.join("\n");
    match lines.len() {
        1 => format!("the configuration is refused:\n{text}"),
        errors if errors >= MAX_ERRORS => {
            format!("the configuration has {errors} errors or more; correct each of them:\n{text}")
        }
        errors => format!("the configuration has {errors} errors; correct each of them:\n{text}"),
    }
}

impl ConfigError {
    /// Refuses with one line for each error, if there are any.
    pub fn unless_empty(lines: Vec<String>) -> Result<(), ConfigError> {
        if lines.is_empty() {
            Ok(())
        } else {
            Err(ConfigError::Refused(lines))
        }
    }

    /// The file, line or option of the first error.
    pub fn place(&self) -> Option<String> {
        match self {
            ConfigError::NotFound { name, .. } => Some(name.clone()),
            ConfigError::Unreadable { path, .. } => Some(path.display().to_string()),
            ConfigError::Syntax { place, .. } => Some(place.clone()),
            ConfigError::Assignment { text, .. } => Some(format!("--set {text}")),
            ConfigError::Refused(findings) => {
                let (place, _) = findings.first()?.split_once(": `")?;
                Some(place.trim().to_string())
            }
        }
    }
}

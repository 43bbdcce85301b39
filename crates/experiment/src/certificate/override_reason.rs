//! The reason of an operator for closing a loop without a valid certificate.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Fewest characters of a reason.
const MIN_CHARACTERS: usize = 10;
/// Most characters of a reason.
const MAX_CHARACTERS: usize = 1000;

/// A typed reason, recorded with the run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct OverrideReason(String);

/// A text that is not a reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReasonError {
    /// Too short, or too long.
    #[error(
        "the reason has {0} characters, and {MIN_CHARACTERS} to {MAX_CHARACTERS} are required; state why the loop may close without a valid certificate"
    )]
    Length(usize),
    /// A line break or another control character.
    #[error("the reason contains a control character; write it in one line of text")]
    Control,
}

impl FromStr for OverrideReason {
    type Err = ReasonError;

    fn from_str(text: &str) -> Result<OverrideReason, ReasonError> {
        let text = text.trim();
        let characters = text.chars().count();
        if !(MIN_CHARACTERS..=MAX_CHARACTERS).contains(&characters) {
            return Err(ReasonError::Length(characters));
        }
        if text.chars().any(char::is_control) {
            Err(ReasonError::Control)
        } else {
            Ok(OverrideReason(text.into()))
        }
    }
}

impl TryFrom<String> for OverrideReason {
    type Error = ReasonError;

    fn try_from(text: String) -> Result<OverrideReason, ReasonError> {
        text.parse()
    }
}

impl From<OverrideReason> for String {
    fn from(reason: OverrideReason) -> String {
        reason.0
    }
}

impl fmt::Display for OverrideReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_a_reason_below_10_characters_or_of_several_lines() {
        assert_eq!(
            "   short    ".parse::<OverrideReason>(),
            Err(ReasonError::Length(5))
        );
        assert_eq!(
            "123456789".parse::<OverrideReason>(),
            Err(ReasonError::Length(9))
        );
        assert!("1234567890".parse::<OverrideReason>().is_ok());
        let long = "x".repeat(MAX_CHARACTERS + 1);
        assert_eq!(
            long.parse::<OverrideReason>(),
            Err(ReasonError::Length(1001))
        );
        assert_eq!(
            "line one\nline two".parse::<OverrideReason>(),
            Err(ReasonError::Control)
        );
        assert!(serde_json::from_str::<OverrideReason>("\"short\"").is_err());
    }
}

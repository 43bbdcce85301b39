//! Name, note and operator of a run, as the operator gives them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use bench_recording::Recording;

/// Most characters of a name.
const MAX_NAME: usize = 200;
/// Most characters of a note.
const MAX_NOTE: usize = 2000;
/// Most characters of the name of an operator.
const MAX_OPERATOR: usize = 100;

/// Metadata key of the name.
const NAME: &str = "name";
/// Metadata key of the note.
const NOTE: &str = "note";
/// Metadata key of the operator.
const OPERATOR: &str = "operator";
/// Metadata key of the command line.
const COMMAND_LINE: &str = "command_line";
/// Metadata key of the profile.
const PROFILE: &str = "profile";

/// Name, note and operator of a run. Its recording contains them as metadata.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Description {
    /// Name of the run, in one line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Note, possibly of several lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Who makes the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operator: Option<String>,
    /// The command that made the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub invocation: Option<Invocation>,
}

/// The command that made a run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Invocation {
    /// The command line as a shell reads it.
    pub command_line: String,
    /// Name of the profile, or its file.
    pub profile: String,
}

impl Invocation {
    /// The command line of the words of a process, without the path of its program.
    pub fn new(words: impl IntoIterator<Item = String>, profile: &str) -> Invocation {
        let words = words.into_iter().map(|word| quoted(&word));
        let words: Vec<String> = std::iter::once("bench".into()).chain(words).collect();
        Invocation {
            command_line: words.join(" "),
            profile: profile.into(),
        }
    }
}

/// A word in single quotes, unless a shell reads it unchanged without them.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "_-./:=,%+@".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// A text that is not a name, a note or an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DescriptionError {
    /// Nothing, or only spaces.
    #[error("it is empty; give a text of 1 to {0} characters")]
    Empty(usize),
    /// Too many characters.
    #[error("it has {characters} characters, and at most {limit} are allowed; shorten it")]
    Long {
        /// Characters of the text.
        characters: usize,
        /// Allowed characters.
        limit: usize,
    },
    /// A control character.
    #[error("it contains a control character; write it as plain text in one line")]
    Control,
    /// A control character in a text that may have several lines.
    #[error("it contains a control character other than a line break; write it as plain text")]
    ControlInLines,
}

/// The name of a run: 1 to 200 characters in one line. Spaces around it are removed.
///
/// # Errors
/// When the text is empty, too long, or contains a control character.
pub fn run_name(text: &str) -> Result<String, DescriptionError> {
    one_line(text, MAX_NAME)
}

/// The name of an operator: 1 to 100 characters in one line. Spaces around it are removed.
///
/// # Errors
/// When the text is empty, too long, or contains a control character.
pub fn operator_name(text: &str) -> Result<String, DescriptionError> {
    one_line(text, MAX_OPERATOR)
}

/// The note of a run: 1 to 2000 characters, with line breaks if necessary. Spaces around it are removed.
///
/// # Errors
/// When the text is empty, too long, or contains another control character.
pub fn run_note(text: &str) -> Result<String, DescriptionError> {
    let text = of_length(text, MAX_NOTE)?;
    if text.chars().any(|c| c.is_control() && c != '\n') {
        Err(DescriptionError::ControlInLines)
    } else {
        Ok(text.into())
    }
}

fn one_line(text: &str, limit: usize) -> Result<String, DescriptionError> {
    let text = of_length(text, limit)?;
    if text.chars().any(char::is_control) {
        Err(DescriptionError::Control)
    } else {
        Ok(text.into())
    }
}

fn of_length(text: &str, limit: usize) -> Result<&str, DescriptionError> {
    let text = text.trim();
    match text.chars().count() {
        0 => Err(DescriptionError::Empty(limit)),
        characters if characters > limit => Err(DescriptionError::Long { characters, limit }),
        _ => Ok(text),
    }
}

impl Description {
    /// The description that a recording contains. Texts that are not allowed are left out.
    pub fn of(recording: &Recording) -> Description {
        let metadata = recording.metadata();
        let text = |key: &str| metadata.get(key).map(String::as_str);
        Description {
            name: text(NAME).and_then(|text| run_name(text).ok()),
            note: text(NOTE).and_then(|text| run_note(text).ok()),
            operator: text(OPERATOR).and_then(|text| operator_name(text).ok()),
            invocation: text(COMMAND_LINE).map(|command_line| Invocation {
                command_line: command_line.into(),
                profile: text(PROFILE).unwrap_or_default().into(),
            }),
        }
    }

    /// This description, completed by what `other` has in addition.
    #[must_use]
    pub fn or(self, other: Description) -> Description {
        Description {
            name: self.name.or(other.name),
            note: self.note.or(other.note),
            operator: self.operator.or(other.operator),
            invocation: self.invocation.or(other.invocation),
        }
    }

    /// The entries that exist, for the metadata of a recording.
    pub(crate) fn metadata(&self) -> BTreeMap<String, String> {
        let invocation = self.invocation.as_ref();
        let pairs = [
            (NAME, self.name.as_ref()),
            (NOTE, self.note.as_ref()),
            (OPERATOR, self.operator.as_ref()),
            (COMMAND_LINE, invocation.map(|made| &made.command_line)),
            (PROFILE, invocation.map(|made| &made.profile)),
        ];
        let pairs = pairs.into_iter();
        let pairs = pairs.filter_map(|(key, text)| Some((key.to_string(), text?.clone())));
        pairs.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_words_that_a_shell_would_change() {
        let words = [
            "chirp",
            "--note",
            "it's 5 % <b>",
            "--set=a.b=1",
            "",
            "--stop",
            "100Hz",
        ];
        let made = Invocation::new(words.map(String::from), "stage");
        let expected = "bench chirp --note 'it'\\''s 5 % <b>' --set=a.b=1 '' --stop 100Hz";
        assert_eq!(made.command_line, expected);
    }

    #[test]
    fn rejects_texts_that_are_empty_too_long_or_contain_control_characters() {
        let long = "ü".repeat(MAX_NAME + 1);
        assert_eq!(run_name(" new flexure "), Ok("new flexure".into()));
        assert!(run_name(&long[2..]).is_ok(), "200 characters, 400 bytes");
        let too_long = run_name(&long).unwrap_err();
        assert_eq!(
            too_long.to_string(),
            "it has 201 characters, and at most 200 are allowed; shorten it"
        );
        assert_eq!(run_name(" "), Err(DescriptionError::Empty(200)));
        for text in ["a\nb", "\u{1b}[31mred", "tab\there", "zero\0"] {
            assert_eq!(run_name(text), Err(DescriptionError::Control), "{text:?}");
            assert_eq!(operator_name(text), Err(DescriptionError::Control));
        }
        assert_eq!(run_note("two\nlines\n"), Ok("two\nlines".into()));
        assert_eq!(run_note("bell\u{7}"), Err(DescriptionError::ControlInLines));
        assert!(run_note(&"x".repeat(MAX_NOTE)).is_ok());
        assert!(run_note(&"x".repeat(MAX_NOTE + 1)).is_err());
        assert!(operator_name(&"x".repeat(MAX_OPERATOR)).is_ok());
        assert!(operator_name(&"x".repeat(MAX_OPERATOR + 1)).is_err());
    }
}

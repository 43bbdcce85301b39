//! What the doctor says.

use std::fmt::Display;

use serde::Serialize;

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// As it should be.
    Ok,
    /// Good to know.
    Note,
    /// The run starts, but something will be worse than it could.
    Warning,
    /// The run would not start, or would trip at once.
    Failure,
}

impl Severity {
    /// As people read it.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Ok => "ok",
            Severity::Note => "note",
            Severity::Warning => "WARNING",
            Severity::Failure => "FAILURE",
        }
    }
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// What was looked at.
    pub subject: &'static str,
    /// What was found, with its figures.
    pub what: String,
    /// How grave it is.
    pub verdict: Severity,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl Finding {
    fn new(
        subject: &'static str,
        verdict: Severity,
        what: impl Into<String>,
        remedy: Option<String>,
    ) -> Finding {
        Finding {
            subject,
            what: what.into(),
            verdict,
            remedy,
        }
    }

    /// As it should be.
    pub fn ok(subject: &'static str, what: impl Into<String>) -> Finding {
        Finding::new(subject, Severity::Ok, what, None)
    }

    /// Good to know.
    pub fn note(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Severity::Note, what, Some(remedy.into()))
    }

    /// The run starts nevertheless.
    pub fn warning(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Severity::Warning, what, Some(remedy.into()))
    }

    /// The run does not start, or trips at once.
    pub fn failure(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Severity::Failure, what, Some(remedy.into()))
    }

    /// The run does not start because of an error, whose text is `what; remedy`.
    pub fn refused(subject: &'static str, error: &impl Display) -> Finding {
        let (what, remedy) = parted(&error.to_string());
        Finding::new(subject, Severity::Failure, what, remedy)
    }

    /// No graver than `worst`.
    pub fn at_most(self, worst: Severity) -> Finding {
        Finding {
            verdict: self.verdict.min(worst),
            ..self
        }
    }
}

/// A text `what; remedy` in its parts.
pub(super) fn parted(text: &str) -> (String, Option<String>) {
    match text.split_once("; ") {
        Some((what, remedy)) => (what.to_string(), Some(remedy.to_string())),
        None => (text.to_string(), None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_errors_text_is_parted_into_what_and_remedy() {
        let finding = Finding::refused("port", &"/dev/x: gone; plug it in; then start again");
        assert_eq!(finding.what, "/dev/x: gone");
        assert_eq!(
            finding.remedy.as_deref(),
            Some("plug it in; then start again")
        );
        assert_eq!(Finding::refused("port", &"no idea").remedy, None);
    }

    #[test]
    fn verdicts_are_softened_never_sharpened() {
        let warning = Finding::warning("x", "y", "z");
        assert_eq!(
            warning.clone().at_most(Severity::Note).verdict,
            Severity::Note
        );
        assert_eq!(
            warning.at_most(Severity::Failure).verdict,
            Severity::Warning
        );
    }
}

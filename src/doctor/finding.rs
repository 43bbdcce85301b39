//! What the doctor says.

use std::fmt::Display;

use serde::Serialize;

/// How grave a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// As it should be.
    Ok,
    /// Good to know.
    Note,
    /// The run starts, but something will be worse than it could.
    Warning,
    /// The run would not start, or would trip at once.
    Failure,
}

impl Verdict {
    /// As people read it.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::Ok => "ok",
            Verdict::Note => "note",
            Verdict::Warning => "WARNING",
            Verdict::Failure => "FAILURE",
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
    pub verdict: Verdict,
    /// What to do about it.
    pub remedy: Option<String>,
}

impl Finding {
    fn new(
        subject: &'static str,
        verdict: Verdict,
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
        Finding::new(subject, Verdict::Ok, what, None)
    }

    /// Good to know.
    pub fn note(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Verdict::Note, what, Some(remedy.into()))
    }

    /// The run starts nevertheless.
    pub fn warning(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Verdict::Warning, what, Some(remedy.into()))
    }

    /// The run does not start, or trips at once.
    pub fn failure(
        subject: &'static str,
        what: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Finding {
        Finding::new(subject, Verdict::Failure, what, Some(remedy.into()))
    }

    /// The run does not start because of an error, whose text is `what; remedy`.
    pub fn refused(subject: &'static str, error: &impl Display) -> Finding {
        let (what, remedy) = parted(&error.to_string());
        Finding::new(subject, Verdict::Failure, what, remedy)
    }

    /// No graver than `worst`.
    pub fn at_most(self, worst: Verdict) -> Finding {
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
            warning.clone().at_most(Verdict::Note).verdict,
            Verdict::Note
        );
        assert_eq!(warning.at_most(Verdict::Failure).verdict, Verdict::Warning);
    }
}

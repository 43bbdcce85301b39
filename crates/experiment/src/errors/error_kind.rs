//! Kinds of error, and errors of another process.

use serde::{Deserialize, Serialize};

use bench_base::remedy;

/// The kinds of error that a script can distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorKind {
    /// Wrong options or arguments.
    Usage,
    /// A setting is refused, or a configuration cannot be read.
    Configuration,
    /// The controller is refused.
    Controller,
    /// The excitation or the run is refused.
    Plan,
    /// The model cannot be analysed.
    Model,
    /// The devices cannot be opened, or differ from their settings.
    Devices,
    /// The calibration cannot be used.
    Calibration,
    /// The stability margin of the loop is too small.
    Margin,
    /// The certificate cannot be used, or does not allow to close the loop.
    Certificate,
    /// A recording cannot be written or read.
    Recording,
    /// The data do not allow the analysis.
    Data,
    /// A study is refused, or its file cannot be used.
    Study,
    /// A campaign is refused, or its files cannot be used.
    Campaign,
    /// Any other failure at run time.
    Failed,
}

/// An error as an object: in the JSON of a command, and in the answers of the daemon.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorObject {
    /// What is wrong and what to do.
    pub message: String,
    /// Kind of the error.
    pub kind: ErrorKind,
    /// The option, file or line that is wrong, if the error has one.
    #[serde(rename = "where")]
    pub place: Option<String>,
    /// What to do, as part of the message.
    pub remedy: Option<String>,
    /// All defects of a certificate, each as `what is wrong; what to do`.
    #[serde(default, skip_serializing_if = "<[String]>::is_empty")]
    pub defects: Box<[String]>,
}

impl ErrorObject {
    /// An error with its remedy, which is the part of the message after the last semicolon.
    pub fn new(message: String, kind: ErrorKind, place: Option<String>) -> ErrorObject {
        let remedy = remedy::split(&message).1.map(String::from);
        ErrorObject {
            message,
            kind,
            place,
            remedy,
            defects: Box::default(),
        }
    }
}

/// An error of the daemon.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{}", error.message)]
pub struct RemoteError {
    /// The error.
    pub error: ErrorObject,
    /// Whether it is a failure at run time; otherwise settings or options were refused.
    pub is_failure: bool,
}

impl RemoteError {
    /// A failure at run time.
    pub fn failed(message: String) -> RemoteError {
        RemoteError {
            error: ErrorObject::new(message, ErrorKind::Failed, None),
            is_failure: true,
        }
    }
}

/// The first option that a message names.
pub fn option_in(message: &str) -> Option<String> {
    let words = message.split([' ', ':', ',', '`', '\'']);
    let option = words
        .into_iter()
        .find(|word| word.len() > 2 && word.starts_with("--"));
    option.map(str::to_string)
}

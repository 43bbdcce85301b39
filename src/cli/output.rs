//! Results go to standard output, everything else to standard error.

use std::io::Write;

use serde::Serialize;

use super::error::CliError;

/// The result has no form in JSON.
pub(super) fn no_json(why: &serde_json::Error) -> CliError {
    CliError::Failed(format!(
        "the result cannot be written as JSON: {why}; leave out --json to see it as text"
    ))
}

/// Prints the one JSON object of a command.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), CliError> {
    let text = serde_json::to_string_pretty(value).map_err(|e| no_json(&e))?;
    print_text(&format!("{text}\n"))
}

/// Prints warnings to standard error.
pub(super) fn warn(warnings: &[String]) {
    for warning in warnings {
        tracing::warn!("{warning}");
    }
}

/// Prints the result of a command as its JSON object or as text.
pub(super) fn print_result<T: Serialize>(
    json: bool,
    result: &T,
    text: impl FnOnce(&T) -> String,
) -> Result<(), CliError> {
    if json {
        print_json(result)
    } else {
        print_text(&text(result))
    }
}

/// Prints to standard output and flushes it. A reader that has closed it (`| head -1`) is not an error.
pub(super) fn print_text(text: &str) -> Result<(), CliError> {
    let mut output = std::io::stdout().lock();
    let written = output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush());
    match written {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(CliError::Failed(format!(
            "cannot write to standard output: {e}; check where the output is redirected to"
        ))),
        _ => Ok(()),
    }
}

/// Prints a message to standard error.
pub(super) fn print_note(text: &str) {
    print_message(&format!("bench: {text}\n"));
}

/// Prints text to standard error and flushes it. If standard error is closed, the text is lost and the command continues.
pub(super) fn print_message(text: &str) {
    let mut output = std::io::stderr().lock();
    let _ = output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush());
}

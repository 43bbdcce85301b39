//! Standard output carries results, standard error everything else.

use std::io::Write;

use serde::Serialize;

use super::error::CliError;

/// Prints the one JSON object of a command.
pub(super) fn print_json(value: &impl Serialize) -> Result<(), CliError> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| CliError::Failed(format!("cannot write JSON: {e}")))?;
    print_text(&format!("{text}\n"))
}

/// Prints to standard output and flushes it. A reader that has closed it (`| head -1`) is not an error.
pub(super) fn print_text(text: &str) -> Result<(), CliError> {
    let mut output = std::io::stdout().lock();
    let written = output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush());
    match written {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(CliError::Failed(format!(
            "cannot write to standard output: {e}"
        ))),
        _ => Ok(()),
    }
}

/// Prints a message to standard error. Where that cannot be written to, the message is lost and the command goes on.
pub(super) fn print_note(text: &str) {
    let _ = writeln!(std::io::stderr(), "bench: {text}");
}

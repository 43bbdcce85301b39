//! Name and note of a run or of a recording, as clients give them.

use super::error::ApiError;
use bench_experiment::{DescriptionError, run_name, run_note};

/// Refuses a name or a note that a recording cannot contain. An empty one is not given.
pub fn check_texts(name: &str, note: &str) -> Result<(), ApiError> {
    check("name", name, run_name)?;
    check("note", note, run_note)
}

fn check(
    field: &str,
    text: &str,
    parsed: fn(&str) -> Result<String, DescriptionError>,
) -> Result<(), ApiError> {
    match parsed(text) {
        Ok(_) | Err(DescriptionError::Empty(_)) => Ok(()),
        Err(error) => {
            let refused = ApiError::bad_request(format!("{field}: {error}"));
            Err(refused.at(Some(field.into())))
        }
    }
}

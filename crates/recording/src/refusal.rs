//! Why a file is refused as a recording.

use std::path::Path;

use super::RecordingError;
use super::boundary::next_recording;
use super::contents::Contents;
use super::error::Emptiness;
use super::file_range::FileRange;
use super::losses::Cut;
use super::recording_contents::RecordingContents;
use super::summary::Summary;
use super::walk::Stop;

/// Refuses a file whose summary names channels, but not that with the ticks.
pub(super) fn refuse_other_program(file: &FileRange, path: &Path) -> Result<(), RecordingError> {
    match Summary::read(file) {
        Some(Summary { definitions, .. })
            if !definitions.channels.is_empty() && !definitions.has_loop() =>
        {
            Err(RecordingError::OtherProgram {
                path: path.into(),
                channels: channels(&definitions),
            })
        }
        _ => Ok(()),
    }
}

/// The cut at which a walk ended early, or why the file cannot be used.
pub(super) fn judge(
    path: &Path,
    file: &FileRange,
    stop: Stop,
    at_byte: u64,
    found: &RecordingContents,
) -> Result<Cut, RecordingError> {
    if matches!(stop, Stop::Cut | Stop::Damaged(_))
        && let Ok(Some(next_at_byte)) = next_recording(file)
    {
        return Err(RecordingError::Several {
            path: path.into(),
            next_at_byte,
        });
    }
    let why = match stop {
        Stop::Cut => "the file ends there".into(),
        Stop::Damaged(what) => {
            return Err(RecordingError::Damaged {
                path: path.into(),
                at_byte,
                ticks: found.account().ticks(),
                what,
            });
        }
        Stop::NotMcap => return Err(RecordingError::NotMcap { path: path.into() }),
        Stop::Read(source) => {
            return Err(RecordingError::Read {
                path: path.into(),
                source,
            });
        }
    };
    Ok(Cut {
        at_byte,
        of_bytes: file.bytes,
        why,
    })
}

/// Refuses a file of another program, and a recording without ticks.
pub(super) fn require_ticks(
    path: &Path,
    contents: &Contents,
    found: &RecordingContents,
    emptiness: Emptiness,
) -> Result<(), RecordingError> {
    if found.account().ticks() > 0 {
        return Ok(());
    }
    let path = path.to_path_buf();
    let may_be_own = contents.channels.is_empty() && emptiness != Emptiness::Complete;
    if contents.has_loop() || may_be_own {
        return Err(RecordingError::Empty { path, emptiness });
    }
    let channels = channels(contents);
    Err(RecordingError::OtherProgram { path, channels })
}

/// The channels as text.
fn channels(contents: &Contents) -> String {
    let channels = contents.channels.values();
    let names: Vec<_> = channels
        .map(|(topic, schema)| format!("{topic} of {schema}"))
        .collect();
    if names.is_empty() {
        "it has no channels".into()
    } else {
        format!("it has {}", names.join(", "))
    }
}

/// The first error that says more than that a part of the file is no recording.
pub(super) fn most_specific(errors: Vec<RecordingError>, path: &Path) -> RecordingError {
    let is_specific = |error: &RecordingError| !matches!(error, RecordingError::NotMcap { .. });
    let specific = errors.into_iter().find(is_specific);
    specific.unwrap_or(RecordingError::NotMcap { path: path.into() })
}

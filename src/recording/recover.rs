//! Copies the readable part of a cut-off or damaged recording to a complete one.

use std::path::Path;

use super::reader::{Cut, Recording};
use super::{CONFIG_ATTACHMENT, Header, Recorder, RecordingError, Totals};

/// The result of a recovery.
#[derive(Debug)]
pub struct Recovered {
    /// Counts of the new recording.
    pub totals: Totals,
    /// The end of the readable part of the old recording; `None` if it was complete.
    pub cut: Option<Cut>,
}

/// Copies everything in `from` before its cut or its first damage to the new file `to`: the messages, byte for byte, the
/// configuration, the metadata (with an additional entry `recovered` that describes the cut) and the attachments. `from` is
/// not changed.
pub fn recover(from: &Path, to: &Path) -> Result<Recovered, RecordingError> {
    let old = Recording::salvage(from)?;
    let mut new = Recorder::create(to, &header(&old))?;
    for published in old.published()? {
        new.record(&published?)?;
    }
    let others = old
        .attachments()
        .iter()
        .filter(|a| a.name != CONFIG_ATTACHMENT);
    let results: Vec<_> = others
        .map(|a| (a.name.as_str(), a.media_type.as_str(), a.data.as_slice()))
        .collect();
    Ok(Recovered {
        totals: new.finish(&results)?,
        cut: old.cut().cloned(),
    })
}

fn header(old: &Recording) -> Header {
    let mut metadata = old.metadata().clone();
    if let Some(Cut {
        at_byte,
        of_bytes,
        why,
    }) = old.cut()
    {
        metadata.insert(
            "recovered".into(),
            format!("readable up to byte {at_byte} of {of_bytes}: {why}"),
        );
    }
    Header {
        config_toml: old.config_toml().unwrap_or_default().into(),
        period_ns: old.period_ns().unwrap_or_default(),
        metadata,
    }
}

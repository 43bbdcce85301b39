//! Makes a complete recording of what can be trusted in a cut or damaged one.

use std::path::Path;

use super::reader::{Cut, Recording};
use super::{CONFIG_ATTACHMENT, Header, Recorder, RecordingError, Totals};

/// What was saved, and what not.
#[derive(Debug)]
pub struct Recovered {
    /// What the new recording holds.
    pub totals: Totals,
    /// Where the old one could no longer be read; `None` if it was complete.
    pub cut: Option<Cut>,
}

/// Writes everything of `from` that stands before its cut or its first damage into the new file `to`: the same
/// messages, byte for byte, the configuration, the metadata (with an entry `recovered` that tells of the cut) and the
/// attachments. `from` is not touched.
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

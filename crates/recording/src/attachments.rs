//! The files inside a recording.

use std::collections::BTreeMap;

use super::CONFIG_ATTACHMENT;

/// A file inside the recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredAttachment {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Its content.
    pub data: Vec<u8>,
}

/// The contents of a recording before a tick.
#[derive(Clone, Copy, Debug)]
pub struct Preceding<'a> {
    /// As [`Recording::metadata`](super::Recording::metadata).
    pub metadata: &'a BTreeMap<String, String>,
    /// As [`Recording::attachments`](super::Recording::attachments).
    pub attachments: &'a [StoredAttachment],
}

impl<'a> Preceding<'a> {
    /// As [`Recording::config_toml`](super::Recording::config_toml).
    pub fn config_toml(&self) -> Option<&'a str> {
        config_toml(self.attachments)
    }
}

/// The first attachment of that name.
pub(super) fn attachment<'a>(
    attachments: &'a [StoredAttachment],
    name: &str,
) -> Option<&'a StoredAttachment> {
    attachments.iter().find(|a| a.name == name)
}

/// The configuration; `None` also if it is empty.
pub(super) fn config_toml(attachments: &[StoredAttachment]) -> Option<&str> {
    let attachment = attachment(attachments, CONFIG_ATTACHMENT)?;
    let text = std::str::from_utf8(&attachment.data).ok();
    text.filter(|text| !text.is_empty())
}

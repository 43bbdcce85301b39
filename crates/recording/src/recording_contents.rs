//! Collects the contents of a recording while it is read.

use std::collections::BTreeMap;

use super::attachments::{Preceding, StoredAttachment};
use super::contents::Part;
use super::continuity::{Continuity, Gap};
use super::digest::Digest;
use super::losses::MissingTicks;
use super::messages::Timing;
use super::stream::{Decoded, Decoder};
use super::{METADATA_RECORD, Topic};
use bench_rt::record::{Event, TickRecord};

/// The contents of the file, without the ticks.
#[derive(Debug, Default)]
pub(super) struct RecordingContents {
    pub(super) metadata: BTreeMap<String, String>,
    pub(super) attachments: Vec<StoredAttachment>,
    pub(super) events: Vec<Event>,
    pub(super) timings: Vec<Timing>,
    pub(super) gaps: Vec<Gap>,
    pub(super) missing_ticks: Vec<MissingTicks>,
    /// Messages on `/loop` that are missing since the last tick.
    missing_since_tick: u64,
    pub(super) last_tick: Option<TickRecord>,
    pub(super) period_by_ticks_ns: Option<u64>,
    decoder: Decoder,
    pub(super) digest: Digest,
}

/// Receives a tick of a recording, and what precedes it.
pub type TickReceiver<'a> = dyn FnMut(&Preceding<'_>, &TickRecord) + 'a;

impl RecordingContents {
    pub(super) fn account(&self) -> &Continuity {
        &self.decoder.account
    }

    pub(super) fn take(
        &mut self,
        part: Part<'_>,
        on_tick: &mut TickReceiver<'_>,
    ) -> Result<(), String> {
        match self.decoder.decode(&part)? {
            Some(Decoded::Tick(tick, gap)) => {
                self.tick(&tick, gap);
                on_tick(&self.preceding(), &tick);
            }
            Some(Decoded::Event(event)) => self.events.push(event),
            Some(Decoded::Timing(timing)) => self.timings.push(timing),
            None => {}
        }
        self.take_undecoded(part);
        Ok(())
    }

    fn preceding(&self) -> Preceding<'_> {
        Preceding {
            metadata: &self.metadata,
            attachments: &self.attachments,
        }
    }

    fn take_undecoded(&mut self, part: Part<'_>) {
        match part {
            Part::Message {
                topic: topic @ (Topic::Loop | Topic::Event),
                data,
            } => self.digest.add(topic as u8, data),
            Part::Missing {
                topic: Topic::Loop,
                messages,
            } => self.missing_since_tick += messages,
            Part::Message { .. } | Part::Missing { .. } => {}
            Part::Attachment {
                name,
                media_type,
                data,
            } => self.attachments.push(StoredAttachment {
                name,
                media_type,
                data: data.into(),
            }),
            Part::Metadata(m) if m.name == METADATA_RECORD => self.metadata.extend(m.metadata),
            Part::Metadata(_) => {}
        }
    }

    fn tick(&mut self, tick: &TickRecord, gap: Option<Gap>) {
        self.gaps.extend(gap);
        if self.missing_since_tick > 0 {
            let first = match gap {
                Some(gap) => gap.after_tick + 1,
                None => tick.tick.saturating_sub(self.missing_since_tick),
            };
            self.add_missing(first, tick.tick.saturating_sub(1));
        }
        if let Some(last) = &self.last_tick
            && last.tick + 1 == tick.tick
            && self.period_by_ticks_ns.is_none()
        {
            self.period_by_ticks_ns = tick.scheduled_ns.checked_sub(last.scheduled_ns);
        }
        self.last_tick = Some(*tick);
    }

    fn add_missing(&mut self, first_tick: u64, last_tick: u64) {
        self.missing_ticks.push(MissingTicks {
            first_tick,
            last_tick,
            ticks: std::mem::take(&mut self.missing_since_tick),
        });
    }

    /// The messages that are missing after the last tick.
    pub(super) fn end(&mut self) {
        if self.missing_since_tick > 0 {
            let first = self.last_tick.map_or(0, |tick| tick.tick.saturating_add(1));
            let last = first.saturating_add(self.missing_since_tick - 1);
            self.add_missing(first, last);
        }
    }
}

//! What is missing in a cut-off or damaged recording.

use std::fmt;

use serde::Serialize;

/// The end of the readable part of a recording that is not complete.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cut {
    /// The recording is readable up to this byte of the file.
    pub at_byte: u64,
    /// Where it ends: the size of the file, or the start of the next recording in it.
    pub of_bytes: u64,
    /// What is wrong there.
    pub why: String,
}

/// A part of a file that could not be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct DamagedRange {
    /// Its first byte.
    pub from_byte: u64,
    /// The first byte after it; equal to `from_byte` where bytes are missing.
    pub to_byte: u64,
    /// What is wrong.
    pub why: String,
}

impl fmt::Display for DamagedRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (from, to, why) = (self.from_byte, self.to_byte, &self.why);
        if from == to {
            return write!(f, "at byte {from}: {why}");
        }
        write!(f, "bytes {from} to {to} are damaged: {why}")
    }
}

/// Ticks that are missing because the file is damaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MissingTicks {
    /// The first missing tick.
    pub first_tick: u64,
    /// The last missing tick.
    pub last_tick: u64,
    /// How many; fewer than the range holds if the loop missed some of them.
    pub ticks: u64,
}

impl fmt::Display for MissingTicks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last, ticks) = (self.first_tick, self.last_tick, self.ticks);
        write!(f, "ticks {first} to {last} are missing ({ticks})")
    }
}

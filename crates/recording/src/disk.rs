//! Free space on the disk of a recording, and the growth of the file: a recording must not fill the disk.
//!
//! ```text
//!  before the run    free space < predicted size + MIN_FREE_BYTES                      refused
//!  during the run    free space < MIN_FREE_BYTES, or file > 10 times predicted size    the run is ended, and recorded to its end
//!                    50 MB later it still goes on                                      nothing more is written
//!
//! With DiskWatch::closing_at_shortage the run need not end: the recording ends at once and is complete up to there.
//! ```

use std::fs::File;
use std::path::{Path, PathBuf};

use nix::sys::statvfs::{Statvfs, fstatvfs, statvfs};

use super::RecordingError;

/// Upper limit of the size of a tick in a recording, in bytes (`tests/doctor` measures it).
pub const BYTES_PER_TICK: u64 = 120;
/// Free space that a recording leaves on its disk, in bytes.
pub const MIN_FREE_BYTES: u64 = 100_000_000;
/// Largest size of a recording, as a multiple of its predicted size.
const MAX_GROWTH: u64 = 10;
/// Size that any recording may have, in bytes: a short run may wait long for its devices.
const MIN_LIMIT_BYTES: u64 = 100_000_000;
/// Size that may be added after the run was ordered to end, in bytes: more than a minute at 5 kHz.
const MAX_ENDING_BYTES: u64 = 50_000_000;

/// Upper limit of the size of a recording with `ticks`, in bytes.
pub fn predicted_bytes(ticks: u64) -> u64 {
    ticks.saturating_mul(BYTES_PER_TICK)
}

/// The folder itself, or its nearest ancestor that exists.
pub fn nearest_existing(folder: &Path) -> PathBuf {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let existing = absolute.ancestors().find(|path| path.exists());
    existing.unwrap_or(Path::new("/")).to_path_buf()
}

/// Space for files in `folder`, which need not exist yet, in bytes; `None` if unknown. It is 0 also for a file system that does not
/// tell it, for example `/proc`.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    let system = statvfs(&nearest_existing(folder));
    system.ok().map(|system| available_bytes(&system))
}

fn available_bytes(system: &Statvfs) -> u64 {
    let blocks = system.blocks_available();
    blocks.saturating_mul(system.fragment_size())
}

/// Whether less than `needed_bytes` are free. A file system without any free space either does not tell it, or fails at the next
/// write.
pub fn lacks_space(free_bytes: Option<u64>, needed_bytes: u64) -> bool {
    free_bytes.is_some_and(|free| 0 < free && free < needed_bytes)
}

/// Why a recording cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortage {
    /// The disk has less free space than [`MIN_FREE_BYTES`].
    DiskNearlyFull,
    /// The file is much larger than the plan of the run predicts.
    TooLarge,
}

/// Sizes at one moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiskState {
    /// Free space of the disk in bytes, if known.
    pub free_bytes: Option<u64>,
    /// Size of the recording in bytes.
    pub size_bytes: u64,
}

impl DiskState {
    fn of(file: &File) -> DiskState {
        DiskState {
            free_bytes: fstatvfs(file).ok().as_ref().map(available_bytes),
            size_bytes: file.metadata().map_or(0, |metadata| metadata.len()),
        }
    }
}

/// Watches the disk of a recording.
pub struct DiskWatch {
    state: Box<dyn Fn() -> DiskState + Send>,
    max_bytes: u64,
    /// The first shortage, and the size at which nothing more is written.
    short: Option<(Shortage, u64)>,
    closes_at_shortage: bool,
}

/// The result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    /// The recording can go on.
    Enough,
    /// The run must end.
    Short(Shortage),
    /// The recording must end, and the run may go on.
    Closed(Shortage),
    /// The run should have ended: nothing more may be written.
    Exhausted,
}

impl DiskWatch {
    /// Watches the recording `path` of a run that needs `predicted_bytes`. The file is watched also after it was moved or removed.
    pub fn of(path: &Path, predicted_bytes: u64) -> Result<DiskWatch, RecordingError> {
        let file = File::open(path).map_err(|source| RecordingError::Read {
            path: path.into(),
            source,
        })?;
        let state = move || DiskState::of(&file);
        Ok(DiskWatch::over(Box::new(state), predicted_bytes))
    }

    /// Watches any source of sizes.
    pub fn over(state: Box<dyn Fn() -> DiskState + Send>, predicted_bytes: u64) -> DiskWatch {
        DiskWatch {
            state,
            max_bytes: predicted_bytes
                .saturating_mul(MAX_GROWTH)
                .max(MIN_LIMIT_BYTES),
            short: None,
            closes_at_shortage: false,
        }
    }

    /// Ends the recording at a shortage, for a run that goes on without it.
    pub fn closing_at_shortage(self) -> DiskWatch {
        DiskWatch {
            closes_at_shortage: true,
            ..self
        }
    }

    pub(super) fn check(&mut self) -> Space {
        let state = (self.state)();
        if self.short.is_none() {
            let end_bytes = state.size_bytes.saturating_add(MAX_ENDING_BYTES);
            self.short = self.shortage(state).map(|shortage| (shortage, end_bytes));
        }
        match self.short {
            None => Space::Enough,
            Some((shortage, _)) if self.closes_at_shortage => Space::Closed(shortage),
            Some((_, end_bytes)) if state.size_bytes >= end_bytes => Space::Exhausted,
            Some((shortage, _)) => Space::Short(shortage),
        }
    }

    fn shortage(&self, state: DiskState) -> Option<Shortage> {
        if lacks_space(state.free_bytes, MIN_FREE_BYTES) {
            Some(Shortage::DiskNearlyFull)
        } else if state.size_bytes > self.max_bytes {
            Some(Shortage::TooLarge)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(free_bytes: Option<u64>, size_bytes: u64, predicted_bytes: u64) -> Space {
        let state = DiskState {
            free_bytes,
            size_bytes,
        };
        DiskWatch::over(Box::new(move || state), predicted_bytes).check()
    }

    #[test]
    fn run_ends_below_100_megabytes_of_free_space() {
        let nearly_full = Space::Short(Shortage::DiskNearlyFull);
        assert_eq!(check(Some(100_000_000), 0, 0), Space::Enough);
        assert_eq!(check(Some(99_999_999), 0, 0), nearly_full);
        assert_eq!(check(None, 0, 0), Space::Enough, "unknown free space");
        assert_eq!(check(Some(0), 0, 0), Space::Enough, "a network file system");
    }

    #[test]
    fn run_ends_at_ten_times_its_predicted_size_and_not_below_100_megabytes() {
        let too_large = Space::Short(Shortage::TooLarge);
        assert_eq!(check(None, 720_000_000, 72_000_000), Space::Enough);
        assert_eq!(check(None, 720_000_001, 72_000_000), too_large);
        assert_eq!(check(None, 100_000_000, 1000), Space::Enough);
        assert_eq!(check(None, 100_000_001, 1000), too_large);
        assert_eq!(check(None, u64::MAX, u64::MAX), Space::Enough);
    }

    #[test]
    fn known_free_space_is_that_of_the_nearest_existing_folder() {
        let folder = tempfile::tempdir().unwrap();
        let below = folder.path().join("a/b");
        assert_eq!(nearest_existing(&below), folder.path());
        assert!(free_bytes(&below).is_some_and(|free| free > 0));
        assert_eq!(free_bytes(Path::new("/proc")), Some(0));
    }

    #[test]
    fn watched_size_is_that_of_the_file_also_after_its_removal() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, [0; 1234]).unwrap();
        let file = File::open(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let state = DiskState::of(&file);
        assert_eq!(state.size_bytes, 1234);
        assert!(state.free_bytes.is_some_and(|free| free > 0));
    }
}

//! The record of the daemon in the folder of its recordings, which is also the lock of the folder, and the recovery of what a crash has
//! cut off.

use std::io;
use std::path::{Path, PathBuf};

use bench_base::atomic_file::numbered_names;
use bench_base::lock_file::{Holder, LockError, LockFile};
use bench_recording::{Recording, RecordingError, Recovery, recover};

/// The file of the record, in the folder of the recordings.
const FILE: &str = ".bench-daemon.lock";
/// What follows the name of a recording in the name of its recovered copy.
const RECOVERED: &str = "-recovered.mcap";
/// What follows the name of a recovered copy until it is complete.
const PARTIAL: &str = ".partial";

/// How the last daemon on this folder ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LastEnd {
    /// By a shutdown, or there was none.
    Clean,
    /// Without a shutdown: a crash, a kill, or a loss of power.
    Crashed,
}

/// The record of the running daemon. One process at a time has it. Dropping it means a clean shutdown; before the crash of an earlier
/// daemon has been reported, the record of that crash remains.
#[derive(Debug)]
pub struct RunRecord {
    lock: LockFile,
    last: LastEnd,
}

impl RunRecord {
    /// Begins the record.
    ///
    /// # Errors
    /// When another daemon uses the folder, and those of the file system.
    pub fn begin(folder: &Path, holder: &Holder) -> Result<RunRecord, LockError> {
        let mut lock = LockFile::take(&folder.join(FILE), holder)?;
        let last = if lock.was_left() {
            LastEnd::Crashed
        } else {
            LastEnd::Clean
        };
        lock.keep(last == LastEnd::Crashed);
        Ok(RunRecord { lock, last })
    }

    /// How the last daemon ended.
    pub fn last(&self) -> LastEnd {
        self.last
    }

    /// The daemon runs and reports how the last one ended.
    pub fn started(&mut self) {
        self.lock.keep(false);
    }
}

/// Recovers the recordings that were cut off; returns the names of the copies. The originals stay. Files that another process writes are
/// left alone.
pub fn recover_cut_recordings(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let cut = paths.filter(|path| is_cut(path));
    cut.flat_map(|path| recovered(&path)).collect()
}

/// Whether a recording has no end and no recovered copy.
fn is_cut(path: &Path) -> bool {
    path.extension()
        .is_some_and(|extension| extension == "mcap")
        && !copy_of(path).exists()
        && !has_end(path)
}

/// Whether the file ends with the magic bytes of MCAP [MCAP specification, "Magic"].
fn has_end(path: &Path) -> bool {
    use std::io::{Read, Seek, SeekFrom};
    const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
    let read = || {
        let mut file = std::fs::File::open(path)?;
        file.seek(SeekFrom::End(-(MAGIC.len() as i64)))?;
        let mut end = [0; MAGIC.len()];
        file.read_exact(&mut end)?;
        Ok::<_, std::io::Error>(end)
    };
    // A file too short for both magics is cut as well.
    read().is_ok_and(|end| end == MAGIC) && std::fs::metadata(path).is_ok_and(|m| m.len() > 16)
}

fn copy_of(path: &Path) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}{RECOVERED}"))
}

/// The names of the copies, one for each recording in the file.
fn recovered(path: &Path) -> Vec<String> {
    let shown = path.display();
    match recover_to(path, &copy_of(path)) {
        Ok(copies) => copies
            .iter()
            .filter_map(|copy| reported(path, copy))
            .collect(),
        Err(RecordingError::InUse { .. }) => {
            tracing::info!("{shown} is written by another process and was left alone");
            Vec::new()
        }
        Err(error) => {
            tracing::warn!("{shown} was cut off and cannot be recovered: {error}");
            Vec::new()
        }
    }
}

fn reported(path: &Path, copy: &Path) -> Option<String> {
    let ticks = Recording::open(copy).map_or(0, |recording| recording.tick_count());
    let name = copy.file_name()?.to_string_lossy().into_owned();
    tracing::warn!(
        "{} was cut off; {ticks} ticks of it are in {name}",
        path.display()
    );
    Some(name)
}

/// Recovers under another name, so that a copy that is cut off itself does not pass for a complete one.
fn recover_to(path: &Path, copy: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let partial = PathBuf::from(format!("{}{PARTIAL}", copy.display()));
    let _ = std::fs::remove_file(&partial); // left by a recovery that was cut off
    let recovered = recover(path, &partial).and_then(|recovery| rename_all(&recovery, copy));
    if recovered.is_err() {
        let _ = std::fs::remove_file(&partial); // the error of the recovery is the one to report
    }
    recovered
}

/// Gives the recovered files their names: `copy`, then free names beside it.
fn rename_all(recovery: &Recovery, copy: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let is_free = |name: &PathBuf| name == copy || !name.exists();
    let names = numbered_names(copy).filter(is_free);
    let renamed = recovery.recordings().zip(names).map(|(recovered, name)| {
        rename(&recovered.totals.path, &name)?;
        Ok(name)
    });
    renamed.collect()
}

fn rename(from: &Path, to: &Path) -> Result<(), RecordingError> {
    let renamed = std::fs::rename(from, to);
    renamed.map_err(|source: io::Error| RecordingError::Create {
        path: to.into(),
        source,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_recording::{Header, Recorder};
    use bench_rt::record::{LoopMessage, TickRecord};

    fn begin(folder: &Path) -> RunRecord {
        RunRecord::begin(folder, &Holder::this_process("a daemon")).expect("a record")
    }

    /// A recorder with 300 ticks at 1 kHz.
    fn recorder(path: &Path) -> Recorder {
        let header = Header {
            period_s: 1e-3,
            ..Header::default()
        };
        let mut recorder = Recorder::create(path, &header).expect("a file");
        for tick in 0..300 {
            let record = TickRecord {
                tick,
                scheduled_ns: tick * 1_000_000,
                ..TickRecord::default()
            };
            recorder.record(&LoopMessage::Tick(record)).expect("space");
        }
        recorder
    }

    /// Completes a recording and cuts its end off.
    fn cut_off(recorder: Recorder, path: &Path) -> Vec<u8> {
        recorder.finish(&[]).expect("space");
        let bytes = std::fs::read(path).expect("a file");
        std::fs::write(path, &bytes[..bytes.len() - 20]).expect("a cut file");
        bytes
    }

    #[test]
    fn crash_is_reported_until_a_daemon_has_started() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join(FILE), "{").expect("a record that a crash left");
        let failed = begin(folder.path());
        assert_eq!(failed.last(), LastEnd::Crashed);
        drop(failed);
        let mut started = begin(folder.path());
        assert_eq!(
            started.last(),
            LastEnd::Crashed,
            "the start before it failed"
        );
        started.started();
        drop(started);
        assert_eq!(begin(folder.path()).last(), LastEnd::Clean);
    }

    #[test]
    fn leaves_a_recording_alone_while_it_is_written_and_recovers_it_afterwards() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        let recorder = recorder(&path);
        assert!(is_cut(&path));
        assert!(recover_cut_recordings(folder.path()).is_empty());
        cut_off(recorder, &path);
        assert_eq!(recover_cut_recordings(folder.path()), ["a-recovered.mcap"]);
    }

    #[test]
    fn copy_that_was_cut_off_is_made_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        let bytes = cut_off(recorder(&path), &path);
        let partial = folder.path().join("a-recovered.mcap.partial");
        std::fs::write(&partial, &bytes[..50]).expect("a recovery that was cut off");
        assert_eq!(recover_cut_recordings(folder.path()), ["a-recovered.mcap"]);
        assert!(!partial.exists());
    }

    #[test]
    fn each_recording_of_a_joined_file_has_a_copy() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        let whole = cut_off(recorder(&path), &path);
        let cut = std::fs::read(&path).expect("a file");
        std::fs::write(&path, [whole, cut].concat()).expect("space");
        let copies = recover_cut_recordings(folder.path());
        assert_eq!(copies, ["a-recovered.mcap", "a-recovered-2.mcap"]);
        for copy in copies {
            let copy = Recording::open(&folder.path().join(copy)).expect("complete");
            assert_eq!(copy.tick_count(), 300);
        }
        let files = std::fs::read_dir(folder.path()).expect("a folder");
        assert_eq!(files.count(), 3, "no partial file is left");
    }
}

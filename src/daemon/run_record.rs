//! What a crash leaves behind: the record that the daemon runs, and recordings that were cut off.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::recording::{Recording, recover};
use crate::util::atomic_file::write_durable;

/// The file of the record, in the folder of the recordings.
const FILE: &str = ".bench-daemon.json";
/// What follows the name of a recording in the name of its recovered copy.
const RECOVERED: &str = "-recovered.mcap";

/// A daemon that runs. A clean shutdown removes the file.
#[derive(Debug, Serialize, Deserialize)]
struct Record {
    pid: u32,
}

/// How the last daemon on this folder ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LastEnd {
    /// By a shutdown, or there was none.
    Clean,
    /// Without a shutdown: a crash, a kill, or a loss of power.
    Crashed,
}

/// The record of the running daemon. Dropping it means a clean shutdown.
#[derive(Debug)]
pub struct RunRecord {
    path: PathBuf,
}

impl RunRecord {
    /// Begins the record; returns how the last daemon ended.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn begin(folder: &Path) -> std::io::Result<(RunRecord, LastEnd)> {
        let path = folder.join(FILE);
        let last = match path.exists() {
            true => LastEnd::Crashed,
            false => LastEnd::Clean,
        };
        let record = Record {
            pid: std::process::id(),
        };
        let text = serde_json::to_string(&record).map_err(std::io::Error::other)?;
        write_durable(&path, &text).map_err(std::io::Error::other)?;
        Ok((RunRecord { path }, last))
    }
}

impl Drop for RunRecord {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path); // without it the next daemon reports a crash
    }
}

/// Recovers the recordings that were cut off; returns the names of the copies. The originals stay.
pub fn recover_cut_recordings(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let cut = paths.filter(|path| is_cut(path));
    cut.filter_map(|path| recovered(&path)).collect()
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

fn recovered(path: &Path) -> Option<String> {
    let copy = copy_of(path);
    match recover(path, &copy) {
        Ok(_) => {
            let ticks = Recording::open(&copy).map_or(0, |recording| recording.tick_count());
            let copy = copy.file_name()?.to_string_lossy().into_owned();
            tracing::warn!(
                "{} was cut off; its {ticks} ticks are in {copy}",
                path.display()
            );
            Some(copy)
        }
        Err(error) => {
            tracing::warn!(
                "{} was cut off and cannot be recovered: {error}",
                path.display()
            );
            None
        }
    }
}

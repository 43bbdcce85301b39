//! Files with results of an analysis: their names, and what happens to existing ones.

use std::path::{Path, PathBuf};

use crate::plan::PlanError;
use bench_base::atomic_file::{write_atomic, write_new};
use bench_identify::Frf;
use bench_identify::frf_csv;

/// Why the files of an analysis cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The certificate cannot be made.
    #[error(transparent)]
    Certificate(#[from] PlanError),
    /// A file cannot be written.
    #[error("cannot write {0}: {1}; free some space, or choose another folder with --out")]
    File(PathBuf, std::io::Error),
}

/// What happens to an existing file with the name of a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExistingFile {
    /// It is replaced: it is the same result of an earlier analysis of the same recording.
    Replace,
    /// It is kept, because it may be the result of another analysis: the new file is `STEM_what-2.ext`, `STEM_what-3.ext`, ...
    Keep,
}

/// The files of the results of one analysis: `STEM_what.ext` beside a file, with its stem.
#[derive(Clone, Copy, Debug)]
pub struct ResultFiles<'a> {
    /// The analysed file, or its name in the folder of the results.
    pub beside: &'a Path,
    /// What happens to existing files.
    pub existing: ExistingFile,
}

impl ResultFiles<'_> {
    /// Writes an FRF; `magnitude` names its magnitude column. Returns the path of the file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_frf(&self, what: &str, frf: &Frf, magnitude: &str) -> Result<String, OutputError> {
        self.write(what, "csv", &frf_csv::to_string(frf, magnitude))
    }

    /// Writes a file and returns its path.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, what: &str, extension: &str, text: &str) -> Result<String, OutputError> {
        let stem = self.beside.file_stem().unwrap_or_default();
        let name = format!("{}_{what}.{extension}", stem.to_string_lossy());
        let path = self.beside.with_file_name(name);
        let written = match self.existing {
            ExistingFile::Replace => write_atomic(&path, text).map(|()| path.clone()),
            ExistingFile::Keep => write_new(&path, text),
        };
        let written = written.map_err(|error| OutputError::File(path, error))?;
        Ok(written.display().to_string())
    }
}

//! Options of pictures.

use std::path::{Path, PathBuf};

use super::columns::cannot_write;
use super::error::CliError;
use bench_base::atomic_file::write_atomic;
use bench_order::ResponseFigureOptions;
use bench_report::{MagnitudeAxis, Picture, ReportError};

/// The axis of the magnitudes of responses.
pub(super) fn magnitude_axis(options: ResponseFigureOptions) -> MagnitudeAxis {
    if options.db {
        MagnitudeAxis::Decibels
    } else {
        MagnitudeAxis::Logarithmic
    }
}

/// Where a command writes its picture.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct PictureOptions {
    /// Draw the result to this file as SVG
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Draw the result to this file as an HTML page with cursor readout and zoom
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

impl PictureOptions {
    /// Writes the requested files and replaces existing ones. Without a file, nothing is drawn.
    pub fn write(
        &self,
        picture: impl FnOnce() -> Result<Picture, ReportError>,
    ) -> Result<(), CliError> {
        if self.files().next().is_none() {
            return Ok(());
        }
        self.check()?;
        let picture = picture().map_err(|error| CliError::Failed(error.to_string()))?;
        if let Some(path) = &self.svg {
            write(path, &picture.svg)?;
        }
        match &self.html {
            Some(path) => write(path, &picture.html()),
            None => Ok(()),
        }
    }

    /// Two pictures cannot have one file.
    fn check(&self) -> Result<(), CliError> {
        let (Some(svg), Some(html)) = (&self.svg, &self.html) else {
            return Ok(());
        };
        let is_same = std::path::absolute(svg).ok() == std::path::absolute(html).ok();
        if is_same {
            Err(CliError::Usage(format!(
                "--svg and --html are both {}; give two different files",
                svg.display()
            )))
        } else {
            Ok(())
        }
    }

    /// The files, as a line; empty without a file.
    pub fn files_text(&self) -> String {
        let files: Vec<String> = self
            .files()
            .map(|path| path.display().to_string())
            .collect();
        if files.is_empty() {
            String::new()
        } else {
            format!("picture in {}\n", files.join(" and "))
        }
    }

    fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.svg.iter().chain(&self.html)
    }
}

fn write(path: &Path, text: &str) -> Result<(), CliError> {
    write_atomic(path, text).map_err(|error| cannot_write(path, &error))
}

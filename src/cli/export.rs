//! `bench export`: the signals or the frequency response of a recording, as a file of another program.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::identify::warn_of_unchecked;
use super::outcome::Outcome;
use super::output::print_result;
use crate::export::frf::{self, FrfFormat};
use crate::export::{ExportError, SignalFormat, write_signals};
use crate::identify::frf_csv;
use crate::recording::Recording;

/// What is exported, and where it goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP)
    recording: PathBuf,
    /// Format of the file
    #[arg(long, value_enum)]
    format: Format,
    /// Export the frequency response that the analysis wrote beside the recording, not the time signals
    #[arg(long)]
    frf: bool,
    /// The file; an existing one is replaced [default: the recording with the ending of the format, with `_frf` for --frf]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
enum Format {
    /// Text, a line for each tick, with the unit in the name of each column
    Csv,
    /// Columns of doubles and integers, if built with `--features parquet`
    Parquet,
    /// MATLAB, level 5; with --frf a struct with the fields of an idfrd object
    Mat,
    /// Universal file format, dataset 58, in ASCII with 13 significant digits
    Uff58,
}

impl Format {
    fn ending(self) -> &'static str {
        match self {
            Format::Csv => ".csv",
            Format::Parquet => ".parquet",
            Format::Mat => ".mat",
            Format::Uff58 => ".uff",
        }
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recording: String,
    format: Format,
    /// Number of ticks or of frequencies.
    rows: u64,
    file: String,
}

impl From<ExportError> for CliError {
    fn from(error: ExportError) -> CliError {
        match error {
            ExportError::Recording(error) => error.into(),
            ExportError::WithoutParquet | ExportError::Uneven { .. } => {
                CliError::Usage(error.to_string())
            }
            ExportError::Write { .. } | ExportError::TooLarge { .. } => {
                CliError::Failed(error.to_string())
            }
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let path = file(args);
    keep_recording(&args.recording, &path)?;
    let rows = match args.frf {
        true => export_response(args, &path)?,
        false => export_signals(args, &path)?,
    };
    let report = Report {
        recording: args.recording.display().to_string(),
        format: args.format,
        rows,
        file: path.display().to_string(),
    };
    print_result(args.json, &report, |report| {
        format!("file       {}\n", report.file)
    })?;
    Ok(Outcome::Done)
}

/// The file to write.
fn file(args: &Args) -> PathBuf {
    let suffix = if args.frf { "_frf" } else { "" };
    let ending = args.format.ending();
    let beside = beside(&args.recording, &format!("{suffix}{ending}"));
    args.out.clone().unwrap_or(beside)
}

/// The file beside a recording whose name continues that of the recording.
fn beside(recording: &Path, ending: &str) -> PathBuf {
    let stem = recording.file_stem().unwrap_or_default().to_string_lossy();
    recording.with_file_name(format!("{stem}{ending}"))
}

/// Refuses to replace the recording.
fn keep_recording(recording: &Path, path: &Path) -> Result<(), CliError> {
    let same = path.canonicalize().ok();
    match same.is_some() && same == recording.canonicalize().ok() {
        true => Err(CliError::Usage(format!(
            "--out {} is the recording itself; choose another file",
            path.display()
        ))),
        false => Ok(()),
    }
}

fn export_signals(args: &Args, path: &Path) -> Result<u64, CliError> {
    let format = match args.format {
        Format::Csv => SignalFormat::Csv,
        Format::Parquet => SignalFormat::Parquet,
        Format::Mat => SignalFormat::Mat,
        Format::Uff58 => SignalFormat::Uff58,
    };
    let recording = Recording::open(&args.recording)?;
    warn_of_unchecked(&recording);
    write_signals(&recording, format, path)?;
    Ok(recording.tick_count())
}

fn export_response(args: &Args, path: &Path) -> Result<u64, CliError> {
    let csv = beside(&args.recording, "_frf.csv");
    let format = match args.format {
        Format::Mat => FrfFormat::Mat,
        Format::Uff58 => FrfFormat::Uff58,
        Format::Csv | Format::Parquet => {
            return Err(CliError::Usage(format!(
                "--frf has the formats mat and uff58; {} of `bench identify` is the response as CSV",
                csv.display()
            )));
        }
    };
    if !csv.exists() {
        return Err(CliError::Failed(format!(
            "there is no frequency response {}; write it with `bench identify {}`",
            csv.display(),
            args.recording.display()
        )));
    }
    let response = frf_csv::read(&csv).map_err(|error| CliError::Failed(error.to_string()))?;
    let source = csv.file_name().unwrap_or_default().to_string_lossy();
    frf::write(&response, &source, format, path)?;
    Ok(response.len() as u64)
}

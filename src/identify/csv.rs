//! The FRF as a CSV file.
//!
//! One row a frequency under [`HEADER`]. Phases are wrapped to (-180, 180] degrees, so that a row means the same
//! wherever the file is cut; a lag is negative. Numbers are written with as many digits as it takes to read the same
//! number back.

use core::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use nalgebra::Complex;
use thiserror::Error;

use super::{Frf, Unit};

/// Columns of the file, in this order.
pub const HEADER: &str = "frequency_hz,magnitude_m_per_a,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz";

/// Columns of a ratio, as of a sensitivity: the same, but for the unit.
pub const BARE_HEADER: &str =
    "frequency_hz,magnitude,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz";

const COLUMNS: usize = 7;

/// Why an FRF could not be written or read.
#[derive(Debug, Error)]
pub enum CsvError {
    /// A result is never overwritten.
    #[error("{path} exists already and is not overwritten: move it away or give another name")]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The file system said no.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: io::Error,
    },
    /// Not the header of an FRF.
    #[error("the first line is {found:?}, that of an FRF is {HEADER:?}")]
    Header {
        /// The first line.
        found: String,
    },
    /// A row that does not hold seven finite numbers with rising frequencies.
    #[error(
        "line {line}: {text:?} is not {COLUMNS} finite numbers with a frequency above the one before"
    )]
    Row {
        /// Number of the line, counted from 1.
        line: usize,
        /// Its text.
        text: String,
    },
}

/// The FRF as text.
pub fn to_string(frf: &Frf, unit: Unit) -> String {
    let header = match unit {
        Unit::MetresPerAmpere => HEADER,
        Unit::Bare => BARE_HEADER,
    };
    let mut text = format!("{header}\n");
    for k in 0..frf.len() {
        row(&mut text, frf, k);
    }
    text
}

fn row(text: &mut String, frf: &Frf, k: usize) {
    let frequency = frf.frequency_hz[k];
    let (magnitude, phase) = (frf.response[k].norm(), frf.phase_rad(k).to_degrees());
    let (magnitude_sigma, phase_sigma) =
        (frf.magnitude_sigma[k], frf.phase_sigma_rad[k].to_degrees());
    let (coherence, resolution) = (frf.coherence[k], frf.resolution_hz[k]);
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{frequency},{magnitude:e},{phase},{coherence},{magnitude_sigma:e},{phase_sigma},{resolution}"
    );
}

/// Writes the FRF into a new file.
///
/// # Errors
/// When the file exists already, or cannot be written.
pub fn write_new(path: &Path, frf: &Frf, unit: Unit) -> Result<(), CsvError> {
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => CsvError::Exists {
            path: path.to_owned(),
        },
        _ => CsvError::Io {
            path: path.to_owned(),
            source,
        },
    };
    let mut file = OpenOptions::new()
        .write(true)
        .create_new(true)
        .open(path)
        .map_err(failed)?;
    file.write_all(to_string(frf, unit).as_bytes())
        .and_then(|()| file.sync_all())
        .map_err(failed)
}

/// Reads an FRF from a file.
///
/// # Errors
/// When the file cannot be read, or is not an FRF.
pub fn read(path: &Path) -> Result<Frf, CsvError> {
    let text = std::fs::read_to_string(path).map_err(|source| CsvError::Io {
        path: path.to_owned(),
        source,
    })?;
    from_str(&text)
}

/// Reads an FRF from text.
///
/// # Errors
/// When the header is another one, or a row is not one of an FRF.
pub fn from_str(text: &str) -> Result<Frf, CsvError> {
    let mut lines = text.lines().enumerate();
    let found = lines.next().map_or("", |(_, line)| line.trim());
    if found != HEADER {
        return Err(CsvError::Header {
            found: found.to_owned(),
        });
    }
    let mut frf = Frf::default();
    for (index, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        parsed(line, &mut frf).ok_or_else(|| CsvError::Row {
            line: index + 1,
            text: line.to_owned(),
        })?;
    }
    Ok(frf)
}

fn parsed(line: &str, frf: &mut Frf) -> Option<()> {
    let numbers: Vec<f64> = line
        .split(',')
        .map(|field| field.trim().parse().ok())
        .collect::<Option<_>>()?;
    let [
        frequency,
        magnitude,
        phase_deg,
        coherence,
        magnitude_sigma,
        phase_sigma_deg,
        resolution,
    ]: [f64; COLUMNS] = numbers.try_into().ok()?;
    let rising = frf.frequency_hz.last().is_none_or(|last| frequency > *last);
    let response = Complex::from_polar(magnitude, phase_deg.to_radians());
    let finite = [
        frequency,
        magnitude,
        phase_deg,
        coherence,
        magnitude_sigma,
        phase_sigma_deg,
        resolution,
    ];
    if !rising || finite.iter().any(|number| !number.is_finite()) {
        return None;
    }
    frf.frequency_hz.push(frequency);
    frf.response.push(response);
    frf.coherence.push(coherence);
    frf.magnitude_sigma.push(magnitude_sigma);
    frf.phase_sigma_rad.push(phase_sigma_deg.to_radians());
    frf.resolution_hz.push(resolution);
    Some(())
}

//! Frequency responses of other programs, from current (A) to displacement (m).
//!
//! ```text
//! table or arrays -> columns (role and unit by name, or by the numbers) -> points -> sigma, as in the file or by the scatter -> Frf
//! ```
//!
//! | column | names |
//! |---|---|
//! | frequency | `frequency_hz`, `f`, `Freq (kHz)`, `omega`, `w (rad/s)` |
//! | magnitude | `magnitude`, `mag_db`, `|G| [dB]`, `gain` |
//! | phase | `phase_deg`, `arg (rad)`, `angle` |
//! | in place of both | `real` and `imag` |
//! | not required | `coherence`, `magnitude_sigma`, `resolution_hz` |

mod arrays;
mod columns;
mod entry;
mod error;
mod numbers;
mod points;
mod table;

pub use columns::PhaseUnit;
pub use error::FrfTableError;

use std::path::Path;

use bench_identify::Frf;
use bench_identify::scatter::SigmaSource;

use columns::Columns;
use numbers::Numbers;
use table::FrfTable;

/// A response of another program.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedFrf {
    /// The response.
    pub frf: Frf,
    /// Where its standard deviations come from.
    pub sigma: SigmaSource,
    /// What the file does not state and was assumed.
    pub assumptions: Vec<String>,
}

/// Reads a response; `phase` is the unit of its phases, whatever the file states.
///
/// # Errors
/// When the file has no response, or does not determine what its columns are: see [`FrfTableError`].
pub fn read(path: &Path, phase: Option<PhaseUnit>) -> Result<ImportedFrf, FrfTableError> {
    let table = FrfTable::open(path)?;
    let columns = Columns::of(&table)?;
    let numbers = Numbers::read(&table, &columns)?;
    points::response(&numbers, columns, phase)
}

#[cfg(test)]
mod tests;

//! Frequency responses of other programs, from current (A) to displacement (m), or from any input to any displacement.
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
mod unit;

pub use columns::PhaseUnit;
pub use error::FrfTableError;
pub use unit::ResponseUnit;

use std::path::Path;

use bench_identify::Frf;
use bench_identify::scatter::SigmaSource;

use columns::Columns;
use numbers::Numbers;
use table::FrfTable;
use unit::UnitRule;

/// A response of another program.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportedFrf {
    /// The response.
    pub frf: Frf,
    /// Where its standard deviations come from.
    pub sigma: SigmaSource,
    /// What the file does not state and was assumed.
    pub assumptions: Vec<String>,
    /// The unit of the response, if the file states it.
    pub unit: Option<ResponseUnit>,
    /// Whether the file has a coherence; otherwise it is that of one average with these standard deviations.
    pub has_coherence: bool,
}

/// Reads a response in m/A; `phase` is the unit of its phases, whatever the file states.
///
/// # Errors
/// When the file has no response, or does not determine what its columns are: see [`FrfTableError`].
pub fn read(path: &Path, phase: Option<PhaseUnit>) -> Result<ImportedFrf, FrfTableError> {
    read_by(path, phase, UnitRule::MetresPerAmpere)
}

/// Whether the user states the kind of the output: displacement, velocity or acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputStated {
    /// It is taken as a displacement.
    No,
    /// As any of them.
    Yes,
}

/// Reads a response in any unit.
///
/// # Errors
/// Those of [`read`], and when the output is a velocity or an acceleration by its name, but its kind is not stated.
pub fn read_any_unit(
    path: &Path,
    phase: Option<PhaseUnit>,
    output: OutputStated,
) -> Result<ImportedFrf, FrfTableError> {
    let rule = match output {
        OutputStated::No => UnitRule::Any,
        OutputStated::Yes => UnitRule::AnyOutput,
    };
    read_by(path, phase, rule)
}

fn read_by(
    path: &Path,
    phase: Option<PhaseUnit>,
    rule: UnitRule,
) -> Result<ImportedFrf, FrfTableError> {
    let table = FrfTable::open(path)?;
    let columns = Columns::of(&table, rule)?;
    let numbers = Numbers::read(&table, &columns)?;
    points::response(&numbers, columns, phase, rule)
}

#[cfg(test)]
mod tests;

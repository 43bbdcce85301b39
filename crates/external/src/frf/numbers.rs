//! The numbers of a response, checked line by line.

use std::path::{Path, PathBuf};

use bench_identify::frf_value::{ValueDefect, coherence_defect, sigma_defect};

use super::columns::{Columns, Pair, Scale};
use super::entry::Entry;
use super::error::FrfTableError;
use super::table::FrfTable;
use crate::error::{DataError, Place};

/// The numbers of the lines of a table, the line at 0 Hz left out.
pub(super) struct Numbers {
    pub path: PathBuf,
    pub rows: Vec<Row>,
    /// Whether a line at 0 Hz was left out.
    pub without_zero: bool,
}

/// The numbers of a line.
pub(super) struct Row {
    /// In the unit of the file.
    pub frequency: f64,
    pub pair: [f64; 2],
    pub coherence: Option<f64>,
    /// `None` where the file has no value.
    pub magnitude_sigma: Option<f64>,
    pub resolution: Option<f64>,
}

impl Numbers {
    pub fn read(table: &FrfTable<'_>, columns: &Columns) -> Result<Numbers, FrfTableError> {
        let pair = match &columns.pair {
            Pair::Polar {
                magnitude, phase, ..
            } => [magnitude, phase],
            Pair::Cartesian { real, imaginary } => [real, imaginary],
            Pair::Unknown([first, second]) => [first, second],
        };
        let others = [
            &columns.coherence,
            &columns.magnitude_sigma,
            &columns.resolution,
        ];
        let mut names = vec![&columns.frequency, pair[0], pair[1]];
        names.extend(others.into_iter().flatten());
        let mut numbers = Numbers {
            path: table.path().to_owned(),
            rows: Vec::new(),
            without_zero: false,
        };
        let mut defect = None;
        table.each_row(&names, |entries| {
            if numbers.leaves_out_zero(entries[0].finite(table.path())?) {
                return Ok(());
            }
            let row = row(table.path(), columns, entries)?;
            let found = numbers.push(row, entries[0].place, columns);
            defect = defect.take().or(found.err());
            Ok(())
        })?;
        defect.map_or(Ok(numbers), Err)
    }

    /// Leaves out a first line at 0 Hz, whose other cells may be no numbers: the logarithm of 0, or a coherence of 0/0.
    fn leaves_out_zero(&mut self, frequency: f64) -> bool {
        let is_left_out = frequency == 0.0 && self.rows.is_empty() && !self.without_zero;
        self.without_zero |= is_left_out;
        is_left_out
    }

    fn push(&mut self, row: Row, place: Place, columns: &Columns) -> Result<(), FrfTableError> {
        let previous = self.rows.last().map_or(0.0, |last| last.frequency);
        if row.frequency <= previous {
            return Err(FrfTableError::NotRising {
                path: self.path.clone(),
                place,
                column: columns.frequency.clone(),
                value: row.frequency,
                previous,
            });
        }
        check(&self.path, place, &row, columns)?;
        self.rows.push(row);
        Ok(())
    }
}

fn row(path: &Path, columns: &Columns, entries: &[Entry<'_>]) -> Result<Row, DataError> {
    let at = |name: &Option<String>| {
        let name = name.as_deref()?;
        entries.iter().find(|entry| entry.column == name)
    };
    let stated = |name: &Option<String>| at(name).map(|entry| entry.finite(path)).transpose();
    // No value: not known.
    let sigma = at(&columns.magnitude_sigma).filter(|entry| !entry.text.is_empty());
    Ok(Row {
        frequency: entries[0].finite(path)?,
        pair: [entries[1].finite(path)?, entries[2].finite(path)?],
        coherence: stated(&columns.coherence)?,
        magnitude_sigma: sigma.map(|entry| entry.finite(path)).transpose()?,
        resolution: stated(&columns.resolution)?,
    })
}

/// Refuses numbers that no measurement has.
fn check(path: &Path, place: Place, row: &Row, columns: &Columns) -> Result<(), FrfTableError> {
    let linear = match &columns.pair {
        Pair::Polar {
            magnitude,
            scale: Scale::Linear,
            ..
        } => Some(magnitude),
        _ => None,
    };
    let magnitude = linear.filter(|_| row.pair[0] < 0.0);
    let sigma = row.magnitude_sigma.and_then(sigma_defect);
    let coherence = row.coherence.and_then(coherence_defect);
    let found: [(Option<&String>, f64, Option<ValueDefect>); 3] = [
        (
            magnitude,
            row.pair[0],
            magnitude.map(|_| ValueDefect::NegativeMagnitude),
        ),
        (
            columns.magnitude_sigma.as_ref(),
            row.magnitude_sigma.unwrap_or_default(),
            sigma,
        ),
        (
            columns.coherence.as_ref(),
            row.coherence.unwrap_or_default(),
            coherence,
        ),
    ];
    for (column, value, defect) in found {
        if let (Some(column), Some(defect)) = (column, defect) {
            return Err(FrfTableError::Value {
                path: path.to_owned(),
                place,
                column: column.clone(),
                value,
                defect,
            });
        }
    }
    Ok(())
}

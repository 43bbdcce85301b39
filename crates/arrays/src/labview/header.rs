//! The keys of a file and of a measurement.

use crate::bytes::Bytes;
use crate::error::ArraysError;

/// The line behind the keys.
const END: &str = "***End_of_Header***";
/// The lines around a block of another kind between keys.
const SPECIAL: (&str, &str) = ("***Start_Special***", "***End_Special***");

/// Which columns have abscissas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AbscissaColumns {
    /// None: the first cell is empty.
    No,
    /// The first one.
    One,
    /// One before each channel.
    Multi,
}

/// How the file is written.
pub(super) struct FileHeader {
    pub separator: char,
    pub has_decimal_comma: bool,
    pub abscissas: AbscissaColumns,
}

/// Keys with their values.
struct Keys(Vec<(String, Vec<String>)>);

impl Keys {
    /// The keys up to the end of the header; `None` at the end of the file.
    fn read(file: &mut Bytes<'_>, separator: Option<char>) -> Result<Option<Keys>, ArraysError> {
        let mut keys = Vec::new();
        while let Some(line) = file.line() {
            let line = text(line);
            if line.starts_with(END) {
                return Ok(Some(Keys(keys)));
            }
            if line.starts_with(SPECIAL.0) {
                skip_special(file);
                continue;
            }
            let mut cells = match separator {
                Some(separator) => cells(&line, separator),
                None => line.split(['\t', ',', ';']).map(str::to_string).collect(),
            };
            let values = cells.split_off(1);
            if !cells[0].is_empty() {
                keys.push((cells.remove(0), values));
            }
        }
        if keys.is_empty() {
            Ok(None)
        } else {
            Err(file.damaged("***End_of_Header***"))
        }
    }

    /// The values of a key.
    fn values(&self, key: &str) -> &[String] {
        let found = self.0.iter().find(|(name, _)| name == key);
        found.map_or(&[], |(_, values)| values)
    }

    fn first(&self, key: &str) -> &str {
        self.values(key).first().map_or("", String::as_str)
    }
}

fn skip_special(file: &mut Bytes<'_>) {
    while let Some(line) = file.line() {
        if text(line).starts_with(SPECIAL.1) {
            return;
        }
    }
}

/// A line of UTF-8 or else Latin-1. Control characters other than tabs, which could change the terminal, are replaced.
pub(super) fn text(line: &[u8]) -> String {
    let text = match std::str::from_utf8(line) {
        Ok(text) => text.to_string(),
        Err(_) => line.iter().map(|byte| char::from(*byte)).collect(),
    };
    let is_printable = |c: char| c == '\t' || !c.is_control();
    let characters = text.chars();
    let printable = characters.map(|c| if is_printable(c) { c } else { '\u{fffd}' });
    printable.collect()
}

/// The cells of a line.
pub(super) fn cells(line: &str, separator: char) -> Vec<String> {
    let cells = line.split(separator);
    cells.map(|cell| cell.trim().to_string()).collect()
}

impl FileHeader {
    pub fn read(file: &mut Bytes<'_>) -> Result<FileHeader, ArraysError> {
        let place = *file;
        let keys = Keys::read(file, None)?.ok_or_else(|| place.damaged(END))?;
        let decimal = keys.values("Decimal_Separator");
        Ok(FileHeader {
            separator: match keys.first("Separator") {
                "Comma" => ',',
                "Semicolon" => ';',
                _ => '\t',
            },
            // The comma has separated the cells of its own line, which are empty.
            has_decimal_comma: !decimal.is_empty() && decimal.iter().all(String::is_empty),
            abscissas: match keys.first("X_Columns") {
                "No" => AbscissaColumns::No,
                "Multi" => AbscissaColumns::Multi,
                _ => AbscissaColumns::One,
            },
        })
    }
}

/// The header of a measurement.
pub(super) struct Header {
    /// Number of channels.
    pub channels: usize,
    /// Number of samples of each channel, if it is stated.
    samples: Vec<Option<usize>>,
    units: Vec<String>,
    dimension: String,
    /// First abscissa and step of each channel.
    first: Vec<f64>,
    step: Vec<f64>,
}

impl Header {
    /// The next header; `None` at the end of the file.
    pub fn read(file: &mut Bytes<'_>, of_file: &FileHeader) -> Result<Option<Header>, ArraysError> {
        let place = *file;
        let Some(keys) = Keys::read(file, Some(of_file.separator))? else {
            return Ok(None);
        };
        let channels = keys.first("Channels").parse::<usize>();
        let channels = channels.map_err(|_| place.damaged("the number of channels"))?;
        let numbers = |key: &str, missing: f64| -> Vec<f64> {
            let values = keys.values(key).iter();
            values
                .map(|text| of_file.number(text).unwrap_or(missing))
                .collect()
        };
        let samples = keys.values("Samples").iter();
        Ok(Some(Header {
            channels,
            samples: samples.map(|text| text.parse().ok()).collect(),
            units: keys.values("Y_Unit_Label").to_vec(),
            dimension: keys.first("X_Dimension").to_string(),
            first: numbers("X0", 0.0),
            step: numbers("Delta_X", f64::NAN),
        }))
    }

    /// Number of samples that a channel is stated to have.
    pub fn samples(&self, channel: usize) -> Option<usize> {
        self.samples.get(channel).copied().flatten()
    }

    /// The unit of a channel.
    pub fn unit(&self, channel: usize) -> Option<String> {
        let unit = self.units.get(channel)?;
        (!unit.is_empty()).then(|| unit.clone())
    }

    /// Name and unit of the abscissas.
    pub fn abscissa(&self) -> (String, Option<String>) {
        match self.dimension.as_str() {
            "" | "Time" => ("time".into(), Some("s".into())),
            other => (other.to_lowercase(), None),
        }
    }

    /// The first abscissa of a channel and the step to the next one.
    pub fn first_and_step(&self, channel: usize) -> (f64, f64) {
        let first = self.first.get(channel).copied().unwrap_or(0.0);
        let step = self.step.get(channel).copied().unwrap_or(f64::NAN);
        (first, step)
    }
}

impl FileHeader {
    /// A number as the file writes it.
    pub fn number(&self, text: &str) -> Option<f64> {
        if self.has_decimal_comma {
            text.replace(',', ".").parse().ok()
        } else {
            text.parse().ok()
        }
    }
}

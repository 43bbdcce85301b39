//! The samples of a measurement.

use super::header::{AbscissaColumns, FileHeader, Header, cells, text};
use crate::budget::Budget;
use crate::bytes::Bytes;
use crate::error::ArraysError;

/// Samples of all channels for which memory is taken at a time.
const BLOCK: usize = 4096;

/// A channel.
pub(super) struct Channel {
    pub name: String,
    pub numbers: Vec<f64>,
}

/// The channels, and the abscissas if they are written: of the first column, or one for each channel.
pub(super) struct Samples {
    pub channels: Vec<Channel>,
    pub abscissas: Vec<Vec<f64>>,
}

impl Samples {
    /// The samples up to the next header or the end of the file.
    pub fn read(
        file: &mut Bytes<'_>,
        of_file: &FileHeader,
        header: &Header,
        budget: &mut Budget,
    ) -> Result<Samples, ArraysError> {
        let place = *file;
        let names = file.line().map(text);
        let names = names.map(|names| cells(&names, of_file.separator));
        let places = Places::new(of_file.abscissas, header.channels);
        let names = names.filter(|names| names.len() >= places.cells());
        let names = names.ok_or_else(|| place.damaged("a name for each channel"))?;
        let channels = (0..header.channels).map(|k| Channel {
            name: names[places.channel(k)].clone(),
            numbers: Vec::new(),
        });
        let mut samples = Samples {
            channels: channels.collect(),
            abscissas: vec![Vec::new(); places.abscissas()],
        };
        let mut lines = 0_usize;
        loop {
            let place = *file;
            let Some(line) = file.line() else {
                break;
            };
            let row = cells(&text(line), of_file.separator);
            if row.iter().all(String::is_empty) {
                continue;
            }
            if row[0] == "Channels" || row[0].starts_with("***") {
                *file = place;
                break;
            }
            if lines.is_multiple_of(BLOCK) {
                budget.take(BLOCK, 8 * places.cells() as u64)?;
            }
            lines += 1;
            let read = samples.push(&row, of_file, &places);
            read.ok_or_else(|| place.damaged("a line of numbers"))?;
        }
        for (k, channel) in samples.channels.iter().enumerate() {
            let is_short = |stated: usize| channel.numbers.len() < stated;
            if header.samples(k).is_some_and(is_short) {
                let error = file.damaged("as many samples as the header states");
                return Err(error.in_variable(&channel.name));
            }
        }
        Ok(samples)
    }

    /// The written abscissas of a channel: its own, or those of all channels.
    pub fn abscissas_of(&self, channel: usize) -> Option<&[f64]> {
        let own = self.abscissas.get(channel).or(self.abscissas.first());
        own.map(Vec::as_slice)
    }

    /// Adds a line; `None` if it has something else than numbers. A channel with fewer samples has empty cells below them.
    fn push(&mut self, row: &[String], of_file: &FileHeader, places: &Places) -> Option<()> {
        for (k, channel) in self.channels.iter_mut().enumerate() {
            let Some(text) = row.get(places.channel(k)).filter(|text| !text.is_empty()) else {
                continue;
            };
            channel.numbers.push(of_file.number(text)?);
        }
        for (k, abscissas) in self.abscissas.iter_mut().enumerate() {
            let Some(text) = row.get(places.abscissa(k)).filter(|text| !text.is_empty()) else {
                continue;
            };
            abscissas.push(of_file.number(text)?);
        }
        Some(())
    }
}

/// Where the numbers stand in a line.
struct Places {
    columns: AbscissaColumns,
    channels: usize,
}

impl Places {
    fn new(columns: AbscissaColumns, channels: usize) -> Places {
        Places { columns, channels }
    }

    /// Fewest cells of a line.
    fn cells(&self) -> usize {
        match self.columns {
            AbscissaColumns::Multi => 2_usize.saturating_mul(self.channels),
            AbscissaColumns::No | AbscissaColumns::One => self.channels.saturating_add(1),
        }
    }

    /// Number of columns of abscissas.
    fn abscissas(&self) -> usize {
        match self.columns {
            AbscissaColumns::No => 0,
            AbscissaColumns::One => 1,
            AbscissaColumns::Multi => self.channels,
        }
    }

    fn channel(&self, k: usize) -> usize {
        match self.columns {
            AbscissaColumns::Multi => 2 * k + 1,
            AbscissaColumns::No | AbscissaColumns::One => k + 1,
        }
    }

    fn abscissa(&self, k: usize) -> usize {
        match self.columns {
            AbscissaColumns::Multi => 2 * k,
            AbscissaColumns::No | AbscissaColumns::One => 0,
        }
    }
}

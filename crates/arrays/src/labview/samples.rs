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
    abscissas: Vec<Vec<f64>>,
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
        // Of all channels: a number after an empty line would move up in time.
        let mut has_ended = false;
        loop {
            let place = *file;
            let Some(line) = file.line() else {
                break;
            };
            let row = cells(&text(line), of_file.separator);
            if row.iter().all(String::is_empty) {
                has_ended = lines > 0;
                continue;
            }
            if row[0] == "Channels" || row[0].starts_with("***") {
                *file = place;
                break;
            }
            if lines.is_multiple_of(BLOCK) {
                budget.take(BLOCK, 8 * places.cells() as u64)?;
            }
            let read = (!has_ended).then(|| samples.push(&row, lines, of_file, &places));
            read.flatten()
                .ok_or_else(|| place.damaged("a line with a number for each channel"))?;
            lines += 1;
        }
        for (k, channel) in samples.channels.iter().enumerate() {
            let is_short = |stated: usize| channel.numbers.len() < stated;
            if header.samples(k).is_some_and(is_short) {
                let error = file.damaged("as many samples as the header states");
                return Err(error.in_variable(&channel.name));
            }
            let is_without = |written: &[f64]| written.len() < channel.numbers.len();
            if samples.written_abscissas(k).is_some_and(is_without) {
                let error = file.damaged("an abscissa for each sample");
                return Err(error.in_variable(&channel.name));
            }
        }
        Ok(samples)
    }

    /// The abscissas of a channel: those written for it or for all channels, or else those by the header.
    pub fn abscissas_of(
        &self,
        header: &Header,
        channel: usize,
    ) -> impl Iterator<Item = f64> + use<'_> {
        let written = self.written_abscissas(channel);
        let (first, step) = header.first_and_step(channel);
        let count = self.channels[channel].numbers.len();
        (0..count).map(move |k| match written {
            // There is one for each sample, or `read` fails.
            Some(written) => written[k],
            None => first + k as f64 * step,
        })
    }

    /// The abscissas that are written for a channel, or for all of them.
    fn written_abscissas(&self, channel: usize) -> Option<&[f64]> {
        let own = self.abscissas.get(channel).or(self.abscissas.first());
        own.map(Vec::as_slice)
    }

    /// Whether all channels have the abscissas of the first one.
    pub fn have_common_abscissas(&self, header: &Header) -> bool {
        (1..self.channels.len()).all(|k| {
            self.abscissas_of(header, k)
                .eq(self.abscissas_of(header, 0))
        })
    }

    /// Adds a line after `lines`; `None` if it has something else than numbers, or a number below an empty cell.
    fn push(
        &mut self,
        row: &[String],
        lines: usize,
        of_file: &FileHeader,
        places: &Places,
    ) -> Option<()> {
        for (k, channel) in self.channels.iter_mut().enumerate() {
            let cell = row.get(places.channel(k));
            push_cell(&mut channel.numbers, cell, lines, of_file)?;
        }
        for (k, abscissas) in self.abscissas.iter_mut().enumerate() {
            push_cell(abscissas, row.get(places.abscissa(k)), lines, of_file)?;
        }
        Some(())
    }
}

/// Adds the cell of a column in a line after `lines`. A channel with fewer samples than others has empty cells below its last one, and
/// only there: a number after an empty cell would move up in time.
fn push_cell(
    column: &mut Vec<f64>,
    cell: Option<&String>,
    lines: usize,
    of_file: &FileHeader,
) -> Option<()> {
    let Some(text) = cell.filter(|text| !text.is_empty()) else {
        return Some(());
    };
    if column.len() < lines {
        return None;
    }
    column.push(of_file.number(text)?);
    Some(())
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

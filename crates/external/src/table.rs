//! The columns of a table of text.

use std::path::Path;

use super::cells::{Format, Separator};
use super::error::{ColumnsError, DataError, ExternalCsvError, Place};
use super::layout::{Layout, NoLayout, is_skipped};
use super::stamp::Stamp;
use super::times::{OtherUnit, TimeUnit, Times};

/// A text with its layout.
pub(crate) struct Table<'a> {
    path: &'a Path,
    text: String,
    layout: Layout,
}

/// A cell with its place.
pub(crate) struct Cell<'a> {
    pub text: &'a str,
    pub line: u64,
    pub column: &'a str,
}

impl<'a> Table<'a> {
    /// A table of text that was read from a file.
    pub fn of(path: &'a Path, text: String) -> Result<Table<'a>, ExternalCsvError> {
        let layout = Layout::of(&lines(&text)).map_err(|why| no_layout(path, &why))?;
        Ok(Table { path, text, layout })
    }

    pub fn names(&self) -> &[String] {
        &self.layout.names
    }

    /// Whether the file names its columns.
    pub fn has_names(&self) -> bool {
        self.layout.has_names
    }

    /// The unit of a column by the line of units; empty without one.
    pub fn unit(&self, index: usize) -> &str {
        self.layout.units.get(index).map_or("", String::as_str)
    }

    pub fn path(&self) -> &'a Path {
        self.path
    }

    /// The numbers of some columns.
    pub fn numbers<const N: usize>(
        &self,
        names: [&String; N],
    ) -> Result<[Vec<f64>; N], ExternalCsvError> {
        let mut numbers = [const { Vec::new() }; N];
        self.each_row(&names, |cells| {
            for (values, cell) in numbers.iter_mut().zip(cells) {
                values.push(self.number(cell)?);
            }
            Ok(())
        })?;
        Ok(numbers)
    }

    /// The numbers of some columns, and the times of another one.
    pub fn numbers_and_times<const N: usize>(
        &self,
        names: [&String; N],
        time: &String,
        unit: Option<TimeUnit>,
    ) -> Result<([Vec<f64>; N], Times), ExternalCsvError> {
        let mut numbers = [const { Vec::new() }; N];
        let (mut stamps, mut places) = (Vec::new(), Vec::new());
        let all: Vec<&String> = names.iter().copied().chain([time]).collect();
        self.each_row(&all, |cells| {
            let (last, values) = cells.split_last().unwrap_or_else(|| unreachable!());
            for (column, cell) in numbers.iter_mut().zip(values) {
                column.push(self.number(cell)?);
            }
            stamps.push(self.stamp(last)?);
            places.push(Place::Line(last.line));
            Ok(())
        })?;
        let are_dates = stamps.first().is_some_and(Stamp::is_date);
        let unit = match unit {
            Some(given) => Some(given),
            None if are_dates => None,
            None => {
                let stated = self.unit_of(time);
                stated.map_err(|other| other.in_file(self.path, time))?
            }
        };
        let times = Times::new(&stamps, unit);
        let times = times.map_err(|defect| defect.in_file(self.path, time, &places));
        Ok((numbers, times?))
    }

    /// The unit of a column of times, by the line of units or by its name.
    fn unit_of(&self, time: &str) -> Result<Option<TimeUnit>, OtherUnit> {
        let index = self.layout.names.iter().position(|name| name == time);
        let text = index.map_or("", |index| self.unit(index));
        let by_name = TimeUnit::stated_in(time).filter(|_| self.layout.has_names);
        Ok(TimeUnit::beside(text)?.or(by_name))
    }

    /// Calls a function with the cells of some columns of each line of samples.
    pub fn each_row(
        &self,
        names: &[&String],
        mut take: impl FnMut(&[Cell<'_>]) -> Result<(), DataError>,
    ) -> Result<(), ExternalCsvError> {
        let indices = self.column_indices(names)?;
        let columns = self.layout.names.len();
        let lines = lines(&self.text).into_iter().enumerate();
        let samples = lines.take(self.layout.end).skip(self.layout.first);
        for (index, line) in samples.filter(|(_, line)| !is_skipped(line)) {
            let cells = self.layout.format.row(line, columns);
            let line = index as u64 + 1;
            if cells.len() != columns {
                let found = cells.len();
                return Err(self.other_count(line, found, columns).into());
            }
            let selected = indices.iter().zip(names).map(|(index, name)| Cell {
                text: &cells[*index],
                line,
                column: name,
            });
            take(&selected.collect::<Vec<_>>())?;
        }
        Ok(())
    }

    fn other_count(&self, line: u64, found: usize, columns: usize) -> DataError {
        let path = self.path.to_owned();
        if has_decimal_commas(&self.layout.format, found, columns) {
            return DataError::DecimalCommas { path, line };
        }
        DataError::Table {
            path,
            line: Some(line),
            reason: format!("has {found} in place of {columns} columns"),
        }
    }

    fn column_indices(&self, names: &[&String]) -> Result<Vec<usize>, ColumnsError> {
        let duplicate = (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
        if let Some(name) = duplicate.map(|k| names[k].clone()) {
            return Err(ColumnsError::SelectedTwice { name });
        }
        names.iter().map(|name| self.column_index(name)).collect()
    }

    fn column_index(&self, name: &str) -> Result<usize, ColumnsError> {
        let names = &self.layout.names;
        let mut matches = (0..names.len()).filter(|index| names[*index] == name);
        match (matches.next(), matches.next()) {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => Err(ColumnsError::Ambiguous {
                path: self.path.to_owned(),
                name: name.into(),
            }),
            (None, _) if self.layout.has_names => Err(ColumnsError::Missing {
                path: self.path.to_owned(),
                name: name.into(),
                available: names.clone(),
            }),
            (None, _) => Err(ColumnsError::NoNames {
                path: self.path.to_owned(),
                name: name.into(),
                columns: names.len(),
            }),
        }
    }

    pub fn number(&self, cell: &Cell<'_>) -> Result<f64, DataError> {
        let number = self.layout.format.number(cell.text);
        let number = number.filter(|number| number.is_finite());
        number.ok_or_else(|| self.cell_error(cell))
    }

    fn stamp(&self, cell: &Cell<'_>) -> Result<Stamp, DataError> {
        let stamp = Stamp::parse(cell.text, self.layout.format.decimal_comma);
        stamp.ok_or_else(|| self.cell_error(cell))
    }

    fn cell_error(&self, cell: &Cell<'_>) -> DataError {
        DataError::Cell {
            path: self.path.to_owned(),
            place: Place::Line(cell.line),
            column: cell.column.into(),
            text: cell.text.into(),
        }
    }
}

/// The lines of a text, each ended by LF, CR LF, or CR alone.
fn lines(text: &str) -> Vec<&str> {
    if text.contains('\n') {
        text.lines().collect()
    } else {
        text.split_terminator('\r').collect()
    }
}

/// Whether commas in the numbers make two columns of one.
fn has_decimal_commas(format: &Format, found: usize, columns: usize) -> bool {
    format.separator == Separator::Comma && found == 2 * columns
}

fn no_layout(path: &Path, why: &NoLayout) -> DataError {
    let path = path.to_owned();
    match why {
        NoLayout::NoColumns => DataError::NoColumns { path },
        NoLayout::OtherHeader {
            header,
            columns,
            first,
            format,
        } => {
            let line = *first as u64 + 1;
            if has_decimal_commas(format, *columns, *header) {
                return DataError::DecimalCommas { path, line };
            }
            DataError::Table {
                path,
                line: Some(line),
                reason: format!("has {columns} columns, the line of names before it {header}"),
            }
        }
    }
}

//! The series of a file of arrays as columns.

use std::path::Path;

use bench_arrays::{Contents, Format, Numbers, Series};
use bench_base::input_file::MAX_RECORD_BYTES;

use super::error::{ColumnsError, DataError, ExternalCsvError, Place};
use super::stamp::Stamp;
use super::times::{OtherUnit, TimeUnit, Times};

/// Arrays with their file.
pub(crate) struct ArrayTable<'a> {
    path: &'a Path,
    contents: Contents,
}

impl<'a> ArrayTable<'a> {
    /// The arrays of the bytes of a file.
    pub fn of(
        path: &'a Path,
        format: Format,
        bytes: &[u8],
    ) -> Result<ArrayTable<'a>, ExternalCsvError> {
        let contents = bench_arrays::contents(format, bytes, MAX_RECORD_BYTES);
        let contents = contents.map_err(|why| DataError::Arrays {
            path: path.to_owned(),
            why,
        })?;
        let table = ArrayTable { path, contents };
        if table.names().is_empty() {
            return Err(table.no_arrays().into());
        }
        Ok(table)
    }

    fn no_arrays(&self) -> DataError {
        let others = self.contents.others.iter();
        let others = others.map(|(name, what)| format!("`{name}` is {what}"));
        let complex = self.contents.series.iter();
        let complex = complex.map(|series| format!("`{}` is complex", series.name));
        DataError::NoArrays {
            path: self.path.to_owned(),
            found: complex.chain(others).collect(),
        }
    }

    /// Names of the columns: the series of real numbers.
    pub fn names(&self) -> Vec<String> {
        let series = self.contents.series.iter();
        let real = series.filter(|series| !matches!(series.numbers, Numbers::Complex(_)));
        real.map(|series| series.name.clone()).collect()
    }

    /// Single numbers with their names.
    pub fn scalars(&self) -> &[(String, f64)] {
        &self.contents.scalars
    }

    /// The numbers of some columns.
    pub fn numbers<const N: usize>(
        &self,
        names: [&String; N],
    ) -> Result<[Vec<f64>; N], ExternalCsvError> {
        let series = self.selected(&names)?;
        let mut numbers = [const { Vec::new() }; N];
        for (numbers, series) in numbers.iter_mut().zip(series) {
            *numbers = self.finite(series)?;
        }
        Ok(numbers)
    }

    /// The numbers of some columns, and the times of another one.
    pub fn numbers_and_times<const N: usize>(
        &self,
        names: [&String; N],
        time: &String,
        unit: Option<TimeUnit>,
    ) -> Result<([Vec<f64>; N], Times), ExternalCsvError> {
        let all: Vec<&String> = names.iter().copied().chain([time]).collect();
        self.selected(&all)?;
        let numbers = self.numbers(names)?;
        let times = self.series(time)?;
        let unit = match unit {
            Some(given) => Some(given),
            None => unit_of(times).map_err(|other| other.in_file(self.path, time))?,
        };
        let stamps = self.stamps(times)?;
        let places: Vec<Place> = (1..=stamps.len() as u64).map(Place::Sample).collect();
        let times = Times::new(&stamps, unit);
        let times = times.map_err(|defect| defect.in_file(self.path, time, &places))?;
        Ok((numbers, times))
    }

    /// The series of these names, which have the same length.
    fn selected(&self, names: &[&String]) -> Result<Vec<&Series>, ColumnsError> {
        let duplicate = (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
        if let Some(name) = duplicate.map(|k| names[k].clone()) {
            return Err(ColumnsError::SelectedTwice { name });
        }
        let series = names.iter().map(|name| self.series(name));
        let series: Vec<&Series> = series.collect::<Result<_, ColumnsError>>()?;
        let other = series
            .iter()
            .find(|other| other.numbers.len() != series[0].numbers.len());
        match other {
            Some(other) => Err(self.other_length(series[0], other)),
            None => Ok(series),
        }
    }

    fn other_length(&self, first: &Series, second: &Series) -> ColumnsError {
        ColumnsError::OtherLength {
            path: self.path.to_owned(),
            first: first.name.clone(),
            first_length: first.numbers.len(),
            second: second.name.clone(),
            second_length: second.numbers.len(),
        }
    }

    fn series(&self, name: &str) -> Result<&Series, ColumnsError> {
        let mut named = self
            .contents
            .series
            .iter()
            .filter(|series| series.name == name);
        match (named.next(), named.next()) {
            (Some(series), None) if !matches!(series.numbers, Numbers::Complex(_)) => Ok(series),
            (Some(_), None) => Err(self.no_column(name, "an array of complex numbers".into())),
            (Some(_), Some(_)) => Err(ColumnsError::Ambiguous {
                path: self.path.to_owned(),
                name: name.into(),
            }),
            (None, _) => Err(self.missing(name)),
        }
    }

    /// Why there is no series of this name.
    fn missing(&self, name: &str) -> ColumnsError {
        let contents = &self.contents;
        let number = contents.scalars.iter().find(|(scalar, _)| scalar == name);
        let number = number.map(|(_, number)| {
            format!(
                "the single number {number} (give --rate {number} if it is the sampling rate in Hz)"
            )
        });
        let other = contents.others.iter().find(|(other, _)| other == name);
        let other = other.map(|(_, what)| what.clone());
        let text = contents.texts.iter().find(|(text, _)| text == name);
        let what = number.or(other).or(text.map(|_| "a text".into()));
        if let Some(what) = what {
            return self.no_column(name, what);
        }
        let numbered = format!("{name}:1");
        if contents.series.iter().any(|series| series.name == numbered) {
            return self.no_column(name, "a matrix".into());
        }
        ColumnsError::Missing {
            path: self.path.to_owned(),
            name: name.into(),
            available: self.names(),
        }
    }

    fn no_column(&self, name: &str, what: String) -> ColumnsError {
        ColumnsError::NoColumn {
            path: self.path.to_owned(),
            name: name.into(),
            what,
            available: self.names(),
        }
    }

    /// The numbers of a series, all finite.
    fn finite(&self, series: &Series) -> Result<Vec<f64>, DataError> {
        let numbers = series.numbers.to_real().unwrap_or_default();
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(at) => Err(self.cell_error(series, at, numbers[at])),
            None => Ok(numbers),
        }
    }

    fn stamps(&self, series: &Series) -> Result<Vec<Stamp>, DataError> {
        match &series.numbers {
            Numbers::Integer(numbers) => Ok(numbers.iter().map(|n| Stamp::integer(*n)).collect()),
            Numbers::Real(numbers, precision) => {
                let stamp = |(at, number): (usize, &f64)| {
                    let stamp = Stamp::real(*number, *precision);
                    stamp.ok_or_else(|| self.cell_error(series, at, *number))
                };
                numbers.iter().enumerate().map(stamp).collect()
            }
            // A complex series is no column.
            Numbers::Complex(_) => Ok(Vec::new()),
        }
    }

    fn cell_error(&self, series: &Series, at: usize, number: f64) -> DataError {
        DataError::Cell {
            path: self.path.to_owned(),
            place: Place::Sample(at as u64 + 1),
            column: series.name.clone(),
            text: number.to_string(),
        }
    }
}

/// The unit of times, by the file or by the name. In `d.t` and `d:1` the `d` is a structure and a matrix, not a time in days.
fn unit_of(series: &Series) -> Result<Option<TimeUnit>, OtherUnit> {
    let stated = TimeUnit::beside(series.unit.as_deref().unwrap_or_default())?;
    Ok(stated.or_else(|| unit_of_name(&series.name)))
}

fn unit_of_name(name: &str) -> Option<TimeUnit> {
    let field = name.rsplit('.').next()?;
    match field.split_once(':') {
        None => TimeUnit::stated_in(field),
        Some((matrix, _)) if TimeUnit::is_one(matrix) => None,
        Some((matrix, _)) => TimeUnit::stated_in(matrix),
    }
}

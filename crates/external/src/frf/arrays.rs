//! Arrays as the columns of a response. A complex array `H` is the two columns `H real` and `H imag`.
//!
//! | file | frequency | response |
//! |---|---|---|
//! | MAT-file, NPZ, NPY | an array by its name, as the column of a table (`frequency_hz`, `omega`) | a complex array, or columns as in a table |
//! | MAT-file with a structure of the fields of an `idfrd` object | `Frequency`, in its `FrequencyUnit` | `ResponseData`, in `OutputUnit`/`InputUnit` |
//! | universal file | abscissa, in the unit of its axis | one dataset of function type 4 |

use std::path::{Path, PathBuf};

use bench_arrays::{Contents, Dataset, Format, Function, Numbers, Series, Value, Variables};
use bench_base::input_file::MAX_RECORD_BYTES;

use super::entry::Entry;
use super::error::FrfTableError;
use super::unit::{UNSTATED_INPUT, UNSTATED_OUTPUT};
use crate::error::{ColumnsError, DataError, ExternalCsvError, Place};

/// Columns of real numbers.
pub(super) struct ArrayColumns<'a> {
    pub path: &'a Path,
    pub names: Vec<String>,
    units: Vec<String>,
    values: Vec<Vec<f64>>,
}

impl<'a> ArrayColumns<'a> {
    /// The columns of the bytes of a file.
    pub fn of(
        path: &'a Path,
        format: Format,
        bytes: &[u8],
    ) -> Result<ArrayColumns<'a>, FrfTableError> {
        let damaged = |why| DataError::Arrays {
            path: path.to_owned(),
            why,
        };
        let mut columns = ArrayColumns {
            path,
            names: Vec::new(),
            units: Vec::new(),
            values: Vec::new(),
        };
        if format == Format::Universal {
            let datasets = bench_arrays::datasets(bytes, MAX_RECORD_BYTES);
            let datasets = datasets.map_err(damaged).map_err(ExternalCsvError::from)?;
            columns.push_dataset(&one_response(path, datasets)?)?;
        } else {
            let variables = bench_arrays::variables(format, bytes, MAX_RECORD_BYTES);
            let variables = variables.map_err(damaged).map_err(ExternalCsvError::from)?;
            columns.push_variables(variables)?;
        }
        Ok(columns)
    }

    /// The unit of a column; empty if the file does not state it.
    pub fn unit(&self, index: usize) -> &str {
        self.units.get(index).map_or("", String::as_str)
    }

    fn push(&mut self, name: impl Into<String>, unit: &str, values: Vec<f64>) {
        self.names.push(name.into());
        self.units.push(unit.into());
        self.values.push(values);
    }

    /// An array; a complex one as its two parts.
    fn push_numbers(&mut self, name: &str, unit: &str, numbers: &Numbers) {
        if let Some(values) = numbers.to_real() {
            return self.push(name, unit, values);
        }
        let values = numbers.to_complex();
        let (real, imaginary) = (values.iter().map(|h| h.re), values.iter().map(|h| h.im));
        self.push(format!("{name} real"), unit, real.collect());
        self.push(format!("{name} imag"), unit, imaginary.collect());
    }

    fn push_dataset(&mut self, dataset: &Dataset) -> Result<(), FrfTableError> {
        // A universal file has frequencies in hertz, unless the label of the axis has another unit.
        let unit = dataset.abscissa_unit.as_deref().unwrap_or("Hz");
        let unit = self.frequency_unit(unit, "the axis of its frequencies")?;
        self.push_numbers("frequency", unit, &dataset.abscissas);
        let unit = ratio(dataset.unit.as_deref(), dataset.denominator_unit.as_deref());
        self.push_numbers("response", &unit, &dataset.ordinates);
        Ok(())
    }

    /// The unit of frequencies, by a text that states it.
    fn frequency_unit(&self, text: &str, place: &str) -> Result<&'static str, FrfTableError> {
        match text.to_lowercase().as_str() {
            "hz" | "hertz" => Ok("Hz"),
            "khz" => Ok("kHz"),
            "rad/s" | "rad/sec" | "rad/second" => Ok("rad/s"),
            _ => Err(FrfTableError::FrequencyUnit {
                path: self.path.to_owned(),
                place: place.into(),
                unit: text.into(),
            }),
        }
    }

    fn push_variables(&mut self, variables: Variables) -> Result<(), FrfTableError> {
        let mut models = variables
            .iter()
            .filter_map(|(name, value)| Model::of(name, value));
        match (models.next(), models.next()) {
            (Some(model), None) => self.push_model(&model),
            (Some(first), Some(second)) => Err(FrfTableError::Twice {
                path: self.path.to_owned(),
                first: first.name.into(),
                second: second.name.into(),
            }),
            (None, _) => {
                for Series {
                    name,
                    unit,
                    numbers,
                } in Contents::of(variables).series
                {
                    let name = name.rsplit('.').next().unwrap_or_default();
                    self.push_numbers(name, unit.as_deref().unwrap_or_default(), &numbers);
                }
                Ok(())
            }
        }
    }

    fn push_model(&mut self, model: &Model<'_>) -> Result<(), FrfTableError> {
        let unit = model.text("FrequencyUnit").unwrap_or_default();
        let unit = self.frequency_unit(unit, &format!("`{}.FrequencyUnit`", model.name))?;
        let response_unit = ratio(model.text("OutputUnit"), model.text("InputUnit"));
        let points = model.numbers("Frequency").map_or(0, Numbers::len);
        if let Some(frequency) = model.numbers("Frequency") {
            self.push_numbers("Frequency", unit, frequency);
        }
        if let Some(response) = model.numbers("ResponseData") {
            self.push_numbers("ResponseData", &response_unit, response);
        }
        if let Some(coherence) = model.numbers("Coherence") {
            self.push_numbers("Coherence", "", coherence);
        }
        if let Some(resolution) = model.numbers("ResolutionHz") {
            self.push_numbers("ResolutionHz resolution", "", resolution);
        }
        if let Some(sigma) = model.sigma(points) {
            self.push("CovarianceData sigma", "", sigma);
        }
        Ok(())
    }

    /// Calls a function with the numbers of some columns at each frequency.
    pub fn each_row(
        &self,
        names: &[&String],
        mut take: impl FnMut(&[Entry<'_>]) -> Result<(), DataError>,
    ) -> Result<(), ExternalCsvError> {
        let columns: Vec<(&String, &Vec<f64>)> = names
            .iter()
            .filter_map(|name| {
                let index = self.names.iter().position(|other| other == *name)?;
                Some((*name, &self.values[index]))
            })
            .collect();
        self.check_lengths(&columns)?;
        let points = columns.first().map_or(0, |(_, values)| values.len());
        for k in 0..points {
            let entries = columns.iter().map(|(name, values)| Entry {
                column: name,
                place: Place::Sample(k as u64 + 1),
                text: values[k].to_string(),
                number: Some(values[k]).filter(|number| number.is_finite()),
            });
            take(&entries.collect::<Vec<_>>())?;
        }
        Ok(())
    }

    fn check_lengths(&self, columns: &[(&String, &Vec<f64>)]) -> Result<(), ColumnsError> {
        let Some((first, values)) = columns.first() else {
            return Ok(());
        };
        let other = columns
            .iter()
            .find(|(_, other)| other.len() != values.len());
        other.map_or(Ok(()), |(name, other)| {
            Err(ColumnsError::OtherLength {
                path: self.path.to_owned(),
                first: (*first).clone(),
                first_length: values.len(),
                second: (*name).clone(),
                second_length: other.len(),
            })
        })
    }
}

/// The unit of a response; empty if none is stated. The label of an ordinate may have both units.
fn ratio(numerator: Option<&str>, denominator: Option<&str>) -> String {
    match (numerator, denominator) {
        (None, None) => String::new(),
        (Some(both), None) if both.contains('/') => both.into(),
        (numerator, denominator) => {
            let (output, input) = (
                numerator.unwrap_or(UNSTATED_OUTPUT),
                denominator.unwrap_or(UNSTATED_INPUT),
            );
            format!("{output}/{input}")
        }
    }
}

/// The only frequency response of a universal file.
fn one_response(path: &Path, datasets: Vec<Dataset>) -> Result<Dataset, FrfTableError> {
    let is_response = |dataset: &Dataset| dataset.function == Function::FrequencyResponse;
    let mut responses: Vec<Dataset> = datasets.into_iter().filter(is_response).collect();
    if responses.len() > 1 {
        return Err(several(path.to_owned(), &responses));
    }
    responses.pop().ok_or_else(|| FrfTableError::NoResponse {
        path: path.to_owned(),
    })
}

fn several(path: PathBuf, responses: &[Dataset]) -> FrfTableError {
    let names = responses
        .iter()
        .map(|dataset| format!("{} {}", dataset.id, dataset.place));
    FrfTableError::Several {
        path,
        names: names.map(|name| name.trim().to_string()).collect(),
    }
}

/// A structure with the fields of an `idfrd` object.
struct Model<'a> {
    name: &'a str,
    fields: &'a [(String, Value)],
}

impl<'a> Model<'a> {
    fn of(name: &'a str, value: &'a Value) -> Option<Model<'a>> {
        let Value::Fields(fields) = value else {
            return None;
        };
        let model = Model { name, fields };
        let has_both =
            model.numbers("ResponseData").is_some() && model.numbers("Frequency").is_some();
        has_both.then_some(model)
    }

    fn field(&self, name: &str) -> Option<&'a Value> {
        let mut fields = self.fields.iter();
        fields
            .find(|(field, _)| field == name)
            .map(|(_, value)| value)
    }

    fn numbers(&self, name: &str) -> Option<&'a Numbers> {
        match self.field(name)? {
            Value::Numbers(array) if !array.numbers.is_empty() => Some(&array.numbers),
            _ => None,
        }
    }

    fn text(&self, name: &str) -> Option<&'a str> {
        match self.field(name)? {
            Value::Text(text) if !text.trim().is_empty() => Some(text.trim()),
            _ => None,
        }
    }

    /// Standard deviations of the magnitude from `CovarianceData` (1 x 1 x N x 2 x 2): the square root of the mean variance of real and
    /// imaginary part.
    fn sigma(&self, points: usize) -> Option<Vec<f64>> {
        let covariance = self.numbers("CovarianceData")?.to_real()?;
        if points == 0 || Some(covariance.len()) != points.checked_mul(4) {
            return None;
        }
        let (real, imaginary) = (&covariance[..points], &covariance[3 * points..]);
        let variances = real.iter().zip(imaginary);
        Some(variances.map(|(re, im)| ((re + im) / 2.0).sqrt()).collect())
    }
}

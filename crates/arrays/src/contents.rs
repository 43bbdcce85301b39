//! Variables as series and single numbers.

use crate::number::Numbers;
use crate::value::{NumericArray, Value, Variables};

/// Most series of a matrix: a record has no more channels.
const MAX_SERIES: usize = 256;

/// Numbers in a row, such as the samples of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Name: that of the variable, with the fields of structures as `s.u`. The series of a matrix are `data:1`, `data:2`; those of an
    /// array without a name, as in an NPY file, `1`, `2`.
    pub name: String,
    /// Unit, if the file states it.
    pub unit: Option<String>,
    /// The numbers.
    pub numbers: Numbers,
}

/// What a file contains.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Vectors, and the columns of matrices, which run along the longer dimension.
    pub series: Vec<Series>,
    /// Single real numbers.
    pub scalars: Vec<(String, f64)>,
    /// Texts.
    pub texts: Vec<(String, String)>,
    /// All else, with what it is.
    pub others: Vec<(String, String)>,
}

impl Contents {
    /// The contents of variables.
    pub fn of(variables: Variables) -> Contents {
        let mut contents = Contents::default();
        for (name, value) in variables {
            contents.push(name, value);
        }
        contents
    }

    fn push(&mut self, name: String, value: Value) {
        match value {
            Value::Numbers(array) => self.push_array(name, array),
            Value::Text(text) => self.texts.push((name, text)),
            Value::Other(what) => self.others.push((name, what)),
            Value::Fields(fields) => {
                for (field, value) in fields {
                    self.push(joined(&name, &field), value);
                }
            }
        }
    }

    fn push_array(&mut self, name: String, array: NumericArray) {
        let NumericArray {
            shape,
            numbers,
            unit,
        } = array;
        let long: Vec<usize> = shape.iter().copied().filter(|size| *size != 1).collect();
        match long.as_slice() {
            [] => self.push_scalar(name, &numbers),
            [_] => {
                let name = if name.is_empty() { "1".into() } else { name };
                self.series.push(Series {
                    name,
                    unit,
                    numbers,
                });
            }
            [rows, columns] if (*rows).min(*columns) <= MAX_SERIES => {
                self.push_matrix(&name, [*rows, *columns], &numbers, unit.as_ref());
            }
            _ => {
                let sizes: Vec<String> = shape.iter().map(usize::to_string).collect();
                self.others
                    .push((name, format!("an array of {}", sizes.join(" x "))));
            }
        }
    }

    fn push_scalar(&mut self, name: String, numbers: &Numbers) {
        match numbers.to_real().as_deref() {
            Some([number]) => self.scalars.push((name, *number)),
            _ => self.others.push((name, "a complex number".into())),
        }
    }

    /// The series of a matrix, along its longer dimension.
    fn push_matrix(
        &mut self,
        name: &str,
        [rows, columns]: [usize; 2],
        numbers: &Numbers,
        unit: Option<&String>,
    ) {
        let is_upright = rows >= columns;
        for k in 0..rows.min(columns) {
            let numbers = if is_upright {
                numbers.at(k * rows..(k + 1) * rows)
            } else {
                numbers.at((0..columns).map(|column| k + column * rows))
            };
            let number = k + 1;
            self.series.push(Series {
                name: if name.is_empty() {
                    number.to_string()
                } else {
                    format!("{name}:{number}")
                },
                unit: unit.cloned(),
                numbers,
            });
        }
    }
}

/// The name of a field of a structure, or of an element `(1).u` of an array of structures; an array without a name has the fields alone.
fn joined(name: &str, field: &str) -> String {
    if name.is_empty() || field.starts_with('(') {
        format!("{name}{field}")
    } else {
        format!("{name}.{field}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Precision;

    fn array(shape: &[usize]) -> Value {
        let count = shape.iter().product::<usize>();
        Value::Numbers(NumericArray {
            shape: shape.into(),
            numbers: Numbers::Real((0..count).map(|k| k as f64).collect(), Precision::Double),
            unit: None,
        })
    }

    fn series(name: &str, shape: &[usize]) -> Vec<(String, Vec<f64>)> {
        let contents = Contents::of(vec![(name.into(), array(shape))]);
        let series = contents.series.into_iter();
        series
            .map(|series| (series.name, series.numbers.to_real().unwrap_or_default()))
            .collect()
    }

    #[test]
    fn vectors_have_the_name_of_their_variable() {
        for shape in [&[3][..], &[3, 1], &[1, 3], &[1, 1, 3]] {
            assert_eq!(series("u", shape), [("u".into(), vec![0.0, 1.0, 2.0])]);
        }
        assert_eq!(series("", &[3])[0].0, "1");
    }

    #[test]
    fn series_of_a_matrix_run_along_the_longer_dimension_and_are_numbered_from_1() {
        let upright = [
            ("data:1".to_string(), vec![0.0, 1.0, 2.0]),
            ("data:2".to_string(), vec![3.0, 4.0, 5.0]),
        ];
        assert_eq!(series("data", &[3, 2]), upright);
        let lying = [
            ("1".to_string(), vec![0.0, 2.0, 4.0]),
            ("2".to_string(), vec![1.0, 3.0, 5.0]),
        ];
        assert_eq!(series("", &[2, 3]), lying);
    }

    #[test]
    fn single_numbers_fields_and_other_arrays_are_told_apart() {
        let fields = vec![
            ("fs".into(), array(&[1, 1])),
            ("u".into(), array(&[4])),
            ("unit".into(), Value::Text("N".into())),
            ("cube".into(), array(&[2, 2, 2])),
            ("none".into(), array(&[0, 0])),
        ];
        let contents = Contents::of(vec![("s".into(), Value::Fields(fields))]);
        assert_eq!(contents.scalars, [("s.fs".into(), 0.0)]);
        assert_eq!(contents.series.len(), 1);
        assert_eq!(contents.series[0].name, "s.u");
        assert_eq!(contents.texts, [("s.unit".into(), "N".into())]);
        assert_eq!(
            contents.others,
            [("s.cube".into(), "an array of 2 x 2 x 2".into())]
        );
    }
}

//! Variables as they are stored in a file of another program.

use nalgebra::Complex;

/// A numeric array.
#[derive(Clone, Debug, PartialEq)]
pub struct NumericArray {
    /// Number of entries along each dimension; empty for a scalar.
    pub shape: Vec<usize>,
    /// The entries, the first index running fastest (as in MATLAB and Fortran).
    pub entries: Vec<Complex<f64>>,
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Numbers.
    Numbers(NumericArray),
    /// A text.
    Text(String),
    /// True or false.
    Flag(bool),
    /// A structure: its fields by name.
    Fields(Vec<(String, Value)>),
    /// Nothing: `null`, or a cell array without elements.
    Empty,
    /// Anything else, with what it is.
    Other(String),
}

impl Value {
    /// Whether it has no content.
    pub fn is_empty(&self) -> bool {
        match self {
            Value::Numbers(array) => array.entries.is_empty(),
            Value::Text(text) => text.trim().is_empty(),
            Value::Fields(fields) => fields.iter().all(|(_, value)| value.is_empty()),
            Value::Empty => true,
            Value::Flag(_) | Value::Other(_) => false,
        }
    }

    /// Whether it has no content other than zeros.
    pub fn is_zero(&self) -> bool {
        match self {
            Value::Numbers(array) => array.entries.iter().all(|x| x.norm() == 0.0),
            Value::Fields(fields) => fields.iter().all(|(_, value)| value.is_zero()),
            other => other.is_empty(),
        }
    }

    /// The content in a few words, as in `InputDelay is 0.03`.
    pub fn summary(&self) -> String {
        match self {
            Value::Numbers(array) => match array.entries.as_slice() {
                [one] if one.im == 0.0 => one.re.to_string(),
                _ => format!("an array of the size {}", array.size()),
            },
            Value::Text(text) => format!("\"{}\"", text.trim()),
            Value::Flag(flag) => flag.to_string(),
            Value::Fields(fields) => {
                let names: Vec<&str> = fields.iter().map(|(name, _)| name.as_str()).collect();
                format!("a structure of {}", names.join(", "))
            }
            Value::Empty => "empty".into(),
            Value::Other(what) => what.clone(),
        }
    }
}

/// The variables of a file, by name.
pub type Variables = Vec<(String, Value)>;

/// Largest number of entries of an array: a matrix of order 64.
pub(super) const MAX_ENTRIES: usize = 4096;

impl NumericArray {
    /// A scalar.
    pub fn scalar(x: f64) -> NumericArray {
        NumericArray {
            shape: Vec::new(),
            entries: vec![Complex::new(x, 0.0)],
        }
    }

    /// An array whose last index runs fastest (as in C) in the order of this type.
    pub(super) fn from_rows(shape: Vec<usize>, entries: &[Complex<f64>]) -> NumericArray {
        let [rows, columns] = match shape.as_slice() {
            [rows, columns] => [*rows, *columns],
            _ => [1, entries.len()],
        };
        let by_column = (0..columns).flat_map(|j| (0..rows).map(move |i| i * columns + j));
        let entries = by_column.filter_map(|index| entries.get(index).copied());
        NumericArray {
            entries: entries.collect(),
            shape,
        }
    }

    /// The numbers of an array with at most one dimension other than 1.
    pub fn vector(&self) -> Option<&[Complex<f64>]> {
        let long = self.shape.iter().filter(|size| **size != 1).count();
        (long <= 1 || self.entries.is_empty()).then_some(&self.entries)
    }

    /// The rows of a matrix; a scalar is a matrix of one row and one column. A matrix without entries has no rows.
    pub fn rows(&self) -> Option<Vec<Vec<Complex<f64>>>> {
        let [rows, columns] = match self.shape.as_slice() {
            _ if self.entries.is_empty() => [0, 0],
            [] | [1] => [1, 1],
            [rows, columns] => [*rows, *columns],
            _ => return None,
        };
        let row = |i: usize| {
            let entries = (0..columns).filter_map(|j| self.entries.get(i + j * rows).copied());
            entries.collect()
        };
        Some((0..rows).map(row).collect())
    }

    /// The shape as text: `3x3`.
    pub fn size(&self) -> String {
        let sizes: Vec<String> = self.shape.iter().map(usize::to_string).collect();
        match sizes.as_slice() {
            [] => "scalar".into(),
            sizes => sizes.join("x"),
        }
    }
}

/// The number of entries of a shape, if it is at most [`MAX_ENTRIES`].
pub(super) fn entry_count(shape: &[usize]) -> Option<usize> {
    let count = shape
        .iter()
        .try_fold(1usize, |n, size| n.checked_mul(*size))?;
    (count <= MAX_ENTRIES).then_some(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn real(list: &[f64]) -> Vec<Complex<f64>> {
        list.iter().map(|x| Complex::new(*x, 0.0)).collect()
    }

    #[test]
    fn rows_of_a_matrix_are_those_of_the_order_in_which_it_was_written() {
        let matrix = NumericArray::from_rows(vec![2, 3], &real(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        assert_eq!(matrix.entries, real(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]));
        let rows = [real(&[1.0, 2.0, 3.0]), real(&[4.0, 5.0, 6.0])];
        assert_eq!(matrix.rows(), Some(rows.to_vec()));
        assert_eq!(matrix.vector(), None);
        assert_eq!(NumericArray::scalar(2.0).rows(), Some(vec![real(&[2.0])]));
    }

    #[test]
    fn entry_count_has_a_limit_and_does_not_overflow() {
        assert_eq!(entry_count(&[64, 64]), Some(4096));
        assert_eq!(entry_count(&[64, 65]), None);
        assert_eq!(entry_count(&[usize::MAX, 2]), None);
        assert_eq!(entry_count(&[0, 7]), Some(0));
    }
}

//! Variables as they are stored in a file.

use crate::number::Numbers;

/// A numeric array.
#[derive(Clone, Debug, PartialEq)]
pub struct NumericArray {
    /// Number of entries along each dimension; empty for a scalar.
    pub shape: Vec<usize>,
    /// The entries, the first index running fastest (as in MATLAB and Fortran).
    pub numbers: Numbers,
    /// Unit of the numbers, if the file states it.
    pub unit: Option<String>,
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Numbers.
    Numbers(NumericArray),
    /// A text.
    Text(String),
    /// A structure: its fields by name.
    Fields(Vec<(String, Value)>),
    /// Anything else, with what it is, as in `a cell array`.
    Other(String),
}

/// The variables of a file, by name.
pub type Variables = Vec<(String, Value)>;

/// The number of entries of a shape; `None` if it is too large for a file.
pub(crate) fn entry_count(shape: &[usize]) -> Option<usize> {
    // Zero first: the other sizes of an empty array may be large.
    if shape.contains(&0) {
        return Some(0);
    }
    let mut sizes = shape.iter();
    sizes.try_fold(1usize, |count, size| count.checked_mul(*size))
}

/// Longest name of a variable or a field, all levels included, in bytes: a name is repeated for each of its fields.
pub(crate) const MAX_NAME_BYTES: usize = 1024;

/// A name that can be printed: control characters could change the terminal.
pub(crate) fn printable(name: &[u8]) -> String {
    let name = String::from_utf8_lossy(name);
    let characters = name.chars();
    let printable = characters.map(|c| if c.is_control() { '\u{fffd}' } else { c });
    printable.collect()
}

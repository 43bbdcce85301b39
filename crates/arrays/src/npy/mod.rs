//! NPY files (`numpy.save`, `numpy.lib.format`, versions 1 to 3).
//!
//! The crate `npyz` needs the type of the entries, and of their fields, when it is compiled, and parses headers recursively without a
//! limit.

mod dtype;
mod literal;

use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::places::Places;
use crate::value::{NumericArray, Value, entry_count, printable};

use dtype::{Entry, Field, Scalar};
use literal::Literal;

/// Largest header: that of version 1.
const MAX_HEADER_BYTES: u64 = 1 << 16;

/// The array of a file; one with fields is a structure of arrays.
pub(crate) fn array(bytes: &[u8], budget: &mut Budget) -> Result<Value, ArraysError> {
    let mut file = Bytes::new(bytes, ByteOrder::Little);
    file.take(6, "the beginning of an NPY file")?;
    let major = file.unsigned(1, "the version of the format")?;
    file.take(1, "the version of the format")?;
    let length = match major {
        1 => file.unsigned(2, "the length of the header")?,
        2 | 3 => file.unsigned(4, "the length of the header")?,
        _ => return Err(file.damaged("version 1, 2 or 3 of the format")),
    };
    if length > MAX_HEADER_BYTES {
        return Err(file.damaged("a header of at most 64 KiB"));
    }
    let mut header = file.part(length as usize, "the header")?;
    let text = header.take(length as usize, "the header")?;
    let header =
        Header::of(text).ok_or_else(|| header.damaged("descr, fortran_order and shape"))?;
    header.read(&mut file, budget)
}

/// The text of a header: UTF-8, or Latin-1 in versions 1 and 2 of the format.
fn decoded(text: &[u8]) -> String {
    match std::str::from_utf8(text) {
        Ok(text) => text.into(),
        Err(_) => text.iter().map(|byte| char::from(*byte)).collect(),
    }
}

struct Header {
    entry: Entry,
    is_fortran: bool,
    shape: Vec<usize>,
}

impl Header {
    fn of(text: &[u8]) -> Option<Header> {
        let literal = Literal::parse(&decoded(text))?;
        let sizes = literal.get("shape")?.items()?;
        let shape = sizes.iter().map(Literal::number);
        Some(Header {
            entry: Entry::of(literal.get("descr")?)?,
            is_fortran: literal.get("fortran_order")?.flag()?,
            shape: shape.collect::<Option<Vec<usize>>>()?,
        })
    }

    fn read(self, file: &mut Bytes<'_>, budget: &mut Budget) -> Result<Value, ArraysError> {
        let size = self.entry.size();
        let count = entry_count(&self.shape);
        let total = count.and_then(|count| count.checked_mul(size));
        let (Some(count), Some(total)) = (count, total) else {
            return Err(file.damaged("the shape of the array"));
        };
        let order = Order {
            places: Places::new(&self.shape, self.is_fortran, count),
            shape: &self.shape,
        };
        match &self.entry {
            Entry::Scalar(Scalar::Other { what, .. }) => Ok(Value::Other(what.clone())),
            Entry::Scalar(scalar) => {
                let data = file.take(total, "the numbers of the array")?;
                order.numbers(scalar, data, 0, size, budget)
            }
            Entry::Fields(fields) => {
                let data = file.take(total, "the numbers of the array")?;
                order.fields(fields, data, size, budget)
            }
        }
    }
}

/// In which order the entries are taken from the data.
struct Order<'a> {
    places: Places,
    shape: &'a [usize],
}

impl Order<'_> {
    fn fields(
        &self,
        fields: &[Field],
        data: &[u8],
        size: usize,
        budget: &mut Budget,
    ) -> Result<Value, ArraysError> {
        let mut values = Vec::new();
        for field in fields {
            let name = printable(field.name.as_bytes());
            let value = self.numbers(&field.scalar, data, field.start, size, budget);
            values.push((
                name.clone(),
                value.map_err(|error| error.in_variable(&name))?,
            ));
        }
        Ok(Value::Fields(values))
    }

    /// The numbers of a field that begins at a byte of each entry of this size.
    fn numbers(
        &self,
        scalar: &Scalar,
        data: &[u8],
        start: usize,
        size: usize,
        budget: &mut Budget,
    ) -> Result<Value, ArraysError> {
        let (stored, order, unit) = match scalar {
            Scalar::Number {
                stored,
                order,
                unit,
            } => (*stored, *order, unit),
            Scalar::Other { what, .. } => return Ok(Value::Other(what.clone())),
        };
        budget.take(self.places.count(), stored.memory_bytes())?;
        let items = self.places.items(data, size, start..start + stored.size);
        Ok(Value::Numbers(NumericArray {
            shape: self.shape.to_vec(),
            numbers: stored.numbers(order, items),
            unit: unit.clone(),
        }))
    }
}

#[cfg(test)]
mod tests;

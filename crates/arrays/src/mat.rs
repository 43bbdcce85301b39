//! MAT-files of level 5: what `save` of MATLAB 5 to 7 and of Octave, and `scipy.io.savemat` write (MathWorks, *MAT-File Format*,
//! chapter 1).
//!
//! A data element is a tag (type and number of bytes, 32 bits each) and data, padded to 8 bytes. An array is an element whose data are
//! the elements flags, dimensions, name and contents. The crate `matfile` has no structures, and `matio-rs` needs a C library.

use flate2::read::ZlibDecoder;
use num_complex::Complex;

use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::number::{Class, Numbers, Precision, Stored};
use crate::value::{MAX_NAME_BYTES, NumericArray, Value, Variables, entry_count, printable};

const HEADER_BYTES: usize = 128;
/// Deepest structure in a structure.
const MAX_DEPTH: usize = 16;
/// Most elements of an array of structures whose fields are read.
const MAX_STRUCTURES: usize = 64;

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Bit of the flags of an array with imaginary parts.
const COMPLEX_FLAG: u64 = 0x800;

/// The variables of a MAT-file.
pub(crate) fn variables(bytes: &[u8], budget: &mut Budget) -> Result<Variables, ArraysError> {
    let mut file = Bytes::new(bytes, ByteOrder::Little);
    let header = file.take(HEADER_BYTES, "the header of 128 bytes")?;
    file.order = match &header[HEADER_BYTES - 2..] {
        b"IM" => ByteOrder::Little,
        b"MI" => ByteOrder::Big,
        _ => return Err(file.damaged("IM or MI at the end of the header")),
    };
    let mut variables = Variables::new();
    while !file.is_empty() {
        let element = Element::read(&mut file)?;
        let variable = match element.kind {
            COMPRESSED => compressed(&element.data, budget)?,
            MATRIX => variable(element.data, budget)?,
            _ => None,
        };
        variables.extend(variable);
    }
    Ok(variables)
}

fn compressed(
    packed: &Bytes<'_>,
    budget: &mut Budget,
) -> Result<Option<(String, Value)>, ArraysError> {
    let decoder = ZlibDecoder::new(packed.rest());
    let bytes = budget.unpack(decoder, packed, "a compressed variable")?;
    let element = Element::read(&mut packed.unpacked(&bytes))?;
    if element.kind == MATRIX {
        variable(element.data, budget)
    } else {
        Err(packed.damaged("an array in a compressed variable"))
    }
}

/// A data element: its type and its bytes.
struct Element<'a> {
    kind: u32,
    data: Bytes<'a>,
}

impl<'a> Element<'a> {
    fn read(bytes: &mut Bytes<'a>) -> Result<Element<'a>, ArraysError> {
        let kind = bytes.unsigned(4, "the tag of an element")? as u32;
        // The short form has the size in the upper half, and up to four bytes of data in the tag.
        if kind >> 16 != 0 {
            let mut part = bytes.part(4, "the data of an element")?;
            let data = part.part((kind >> 16) as usize, "the size of a short element")?;
            let kind = kind & 0xffff;
            return Ok(Element { kind, data });
        }
        let size = bytes.unsigned(4, "the tag of an element")? as usize;
        let data = bytes.part(size, "the data of an element")?;
        if kind != COMPRESSED {
            bytes.align();
        }
        Ok(Element { kind, data })
    }

    fn text(bytes: &mut Bytes<'a>) -> Result<String, ArraysError> {
        Ok(text(Element::read(bytes)?.data.rest()))
    }
}

/// Text up to the first zero.
fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    printable(&bytes[..end.unwrap_or(bytes.len())])
}

/// A variable; `None` for data of MATLAB itself, which have no name.
fn variable(
    mut data: Bytes<'_>,
    budget: &mut Budget,
) -> Result<Option<(String, Value)>, ArraysError> {
    let (name, value) = array(&mut data, MAX_DEPTH, budget)?;
    Ok((!name.is_empty()).then_some((name, value)))
}

/// The name and the content of an array.
fn array(
    bytes: &mut Bytes<'_>,
    depth: usize,
    budget: &mut Budget,
) -> Result<(String, Value), ArraysError> {
    budget.take(0, 0)?;
    // A field without a value.
    if bytes.is_empty() {
        return Ok((String::new(), Value::Other("empty".into())));
    }
    let mut flags = Element::read(bytes)?.data;
    let flags = flags.unsigned(4, "the flags of an array")?;
    let class = flags & 0xff;
    if class == 17 {
        let name = Element::text(bytes)?;
        return Ok((name, Value::Other("a MATLAB object".into())));
    }
    let shape = shape(bytes)?;
    let name = Element::text(bytes)?;
    if name.len() > MAX_NAME_BYTES {
        return Err(bytes.damaged("a name of at most 1024 bytes"));
    }
    let value = match class {
        1 => Ok(Value::Other("a cell array".into())),
        2 => structures(bytes, &shape, depth, budget),
        3 => Ok(Value::Other("a MATLAB object".into())),
        4 => characters(bytes, &shape, budget),
        5 => Ok(Value::Other("a sparse matrix".into())),
        6..=15 => numbers(bytes, shape, flags, budget),
        16 => Ok(Value::Other("a function".into())),
        _ => Ok(Value::Other("data of an unknown class".into())),
    };
    match value {
        Ok(value) => Ok((name, value)),
        // A field has no name of its own: the error gets that of the structure.
        Err(error) if name.is_empty() => Err(error),
        Err(error) => Err(error.in_variable(&name)),
    }
}

fn shape(bytes: &mut Bytes<'_>) -> Result<Vec<usize>, ArraysError> {
    let Element { data, .. } = Element::read(bytes)?;
    let sizes = data.rest().chunks_exact(4);
    Ok(sizes.map(|size| data.order.bits(size) as usize).collect())
}

/// A text of one row.
fn characters(
    bytes: &mut Bytes<'_>,
    shape: &[usize],
    budget: &mut Budget,
) -> Result<Value, ArraysError> {
    let Element { kind, data } = Element::read(bytes)?;
    budget.take(data.rest().len(), 4)?;
    let has_several_rows = shape.first().is_some_and(|rows| *rows > 1);
    Ok(match kind {
        _ if has_several_rows => Value::Other("a text of several lines".into()),
        1 | 2 | 16 => Value::Text(text(data.rest())),
        4 | 17 => {
            let units = data.rest().chunks_exact(2);
            let units: Vec<u16> = units.map(|unit| data.order.bits(unit) as u16).collect();
            Value::Text(text(String::from_utf16_lossy(&units).as_bytes()))
        }
        _ => Value::Other("a text".into()),
    })
}

fn numbers(
    bytes: &mut Bytes<'_>,
    shape: Vec<usize>,
    flags: u64,
    budget: &mut Budget,
) -> Result<Value, ArraysError> {
    let count = entry_count(&shape);
    let count = count.ok_or_else(|| bytes.damaged("the size of an array"))?;
    let class = flags & 0xff;
    let real = part(bytes, count, class, budget)?;
    let numbers = if flags & COMPLEX_FLAG == 0 {
        real
    } else {
        let imaginary = part(bytes, count, class, budget)?;
        budget.take(count, 16)?;
        complex(&real, &imaginary)
    };
    Ok(Value::Numbers(NumericArray {
        shape,
        numbers,
        unit: None,
    }))
}

fn complex(real: &Numbers, imaginary: &Numbers) -> Numbers {
    let [re, im] = [real, imaginary].map(|part| part.to_real().unwrap_or_default());
    let pairs = re.into_iter().zip(im);
    Numbers::Complex(pairs.map(|(re, im)| Complex::new(re, im)).collect())
}

/// The real or the imaginary parts of an array of a class.
fn part(
    bytes: &mut Bytes<'_>,
    count: usize,
    class: u64,
    budget: &mut Budget,
) -> Result<Numbers, ArraysError> {
    let Element { kind, data } = Element::read(bytes)?;
    let stored = stored(kind).ok_or_else(|| data.damaged("the type of the numbers"))?;
    if count.checked_mul(stored.size) != Some(data.rest().len()) {
        return Err(data.damaged("as many numbers as the size of the array states"));
    }
    budget.take(count, stored.memory_bytes())?;
    let items = data.rest().chunks_exact(stored.size);
    Ok(match class {
        6 => stored.reals(data.order, items, Precision::Double),
        7 => stored.reals(data.order, items, Precision::Single),
        _ => stored.numbers(data.order, items),
    })
}

/// How numbers of a type are stored. MATLAB stores doubles with integer values in fewer bytes.
fn stored(kind: u32) -> Option<Stored> {
    let (class, size) = match kind {
        1 => (Class::Signed, 1),
        2 => (Class::Unsigned, 1),
        3 => (Class::Signed, 2),
        4 => (Class::Unsigned, 2),
        5 => (Class::Signed, 4),
        6 => (Class::Unsigned, 4),
        7 => (Class::Float, 4),
        9 => (Class::Float, 8),
        12 => (Class::Signed, 8),
        13 => (Class::Unsigned, 8),
        _ => return None,
    };
    Some(Stored::new(class, size))
}

/// A structure; the elements of an array of structures are `(1)`, `(2)`, as in MATLAB.
fn structures(
    bytes: &mut Bytes<'_>,
    shape: &[usize],
    depth: usize,
    budget: &mut Budget,
) -> Result<Value, ArraysError> {
    let count = match entry_count(shape) {
        Some(count) if count <= MAX_STRUCTURES && depth > 0 => count,
        Some(_) if depth == 0 => {
            return Ok(Value::Other("a structure that is nested deeply".into()));
        }
        _ => return Ok(Value::Other("a large array of structures".into())),
    };
    let mut length = Element::read(bytes)?.data;
    let length_bytes = length.rest().len().min(4);
    let length = length.unsigned(length_bytes, "the length of names")? as usize;
    let names = Element::read(bytes)?.data;
    if !(1..=MAX_NAME_BYTES).contains(&length) {
        return Err(names.damaged("the length of the names of fields"));
    }
    let names = names.rest().chunks_exact(length);
    let mut all = Vec::new();
    for number in 1..=count {
        for name in names.clone() {
            let mut element = Element::read(bytes)?.data;
            let (_, value) = array(&mut element, depth - 1, budget)?;
            let name = text(name);
            all.push(match count {
                1 => (name, value),
                _ => (format!("({number}).{name}"), value),
            });
        }
    }
    Ok(Value::Fields(all))
}

#[cfg(test)]
mod tests;

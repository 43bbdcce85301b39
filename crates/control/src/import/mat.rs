//! MAT-files of level 5: what `save` of MATLAB 5 to 7 and `scipy.io.savemat` write (MathWorks, *MAT-File Format*).
//!
//! Numeric arrays, structures of one element, and cells of one element are read; everything else is named, not read. Sizes in the
//! file never determine how much memory is taken: a part ends where its bytes end.

use std::io::Read;

use flate2::read::ZlibDecoder;
use nalgebra::Complex;

use super::bytes::{Bytes, float, signed, unsigned};
use super::value::{NumericArray, Value, Variables, entry_count};
use crate::import_error::FormatError;

const HEADER_BYTES: usize = 128;
/// Largest decompressed size of all variables together in bytes.
const MAX_DECOMPRESSED_BYTES: usize = 4 << 20;
/// Deepest structure in a structure.
const MAX_DEPTH: usize = 4;
/// Largest number of fields of a structure.
const MAX_FIELDS: usize = 64;

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Bit of the flags of an array with imaginary parts.
const COMPLEX_FLAG: u32 = 0x800;

/// Bit of the flags of an array of true and false.
const LOGICAL_FLAG: u32 = 0x200;

/// The variables of a MAT-file.
pub(super) fn variables(bytes: &[u8]) -> Result<Variables, FormatError> {
    let mut file = Bytes::new(bytes, is_big_endian(bytes)?);
    file.take(HEADER_BYTES, "the header")?;
    let mut variables = Variables::new();
    let mut budget = MAX_DECOMPRESSED_BYTES;
    while !file.is_empty() {
        let element = Element::read(&mut file)?;
        match element.kind {
            COMPRESSED => {
                let inflated = inflate(element.data, &mut budget)?;
                let mut inner = Bytes::new(&inflated, file.is_big_endian());
                let matrix = Element::read(&mut inner)?;
                variables.extend(variable(matrix.data, file.is_big_endian())?);
            }
            MATRIX => variables.extend(variable(element.data, file.is_big_endian())?),
            _ => {}
        }
    }
    Ok(variables)
}

/// The byte order, from the last two bytes of the header.
fn is_big_endian(bytes: &[u8]) -> Result<bool, FormatError> {
    if bytes.starts_with(b"MATLAB 7.3") || bytes.starts_with(b"\x89HDF") {
        return Err(FormatError::Kind {
            what: "a MAT-file of version 7.3 (HDF5)",
            remedy: "save it with save('FILE.mat', ..., '-v7')",
        });
    }
    match bytes.get(HEADER_BYTES - 2..HEADER_BYTES) {
        Some(b"IM") => Ok(false),
        Some(b"MI") => Ok(true),
        _ => Err(FormatError::Kind {
            what: "not a MAT-file of level 5",
            remedy: "save it with save('FILE.mat', ..., '-v7') or scipy.io.savemat",
        }),
    }
}

fn inflate(data: &[u8], budget: &mut usize) -> Result<Vec<u8>, FormatError> {
    let mut inflated = Vec::new();
    let mut limited = ZlibDecoder::new(data).take(*budget as u64 + 1);
    let read = limited.read_to_end(&mut inflated);
    read.map_err(|_| FormatError::Damaged {
        at: 0,
        what: "a compressed variable",
    })?;
    *budget = budget
        .checked_sub(inflated.len())
        .ok_or(FormatError::TooLarge {
            what: "the size of the decompressed variables",
            limit: MAX_DECOMPRESSED_BYTES,
            unit: "bytes",
        })?;
    Ok(inflated)
}

/// A data element: its type and its bytes.
struct Element<'a> {
    kind: u32,
    data: &'a [u8],
}

impl<'a> Element<'a> {
    fn read(bytes: &mut Bytes<'a>) -> Result<Element<'a>, FormatError> {
        let first = bytes.u32("the tag of an element")?;
        // The short form has the size in the upper half, and up to four bytes of data in the tag.
        if first >> 16 != 0 {
            let part = bytes.take(4, "the data of an element")?;
            let data = part.get(..(first >> 16) as usize);
            return Ok(Element {
                kind: first & 0xffff,
                data: data.ok_or_else(|| bytes.damaged("the size of an element"))?,
            });
        }
        let size = bytes.u32("the tag of an element")? as usize;
        let data = bytes.take(size, "the data of an element")?;
        if first != COMPRESSED {
            bytes.align();
        }
        Ok(Element { kind: first, data })
    }
}

/// A variable; `None` for data of MATLAB itself, which have no name.
fn variable(data: &[u8], big_endian: bool) -> Result<Option<(String, Value)>, FormatError> {
    let (name, value) = array(&mut Bytes::new(data, big_endian), MAX_DEPTH)?;
    Ok((!name.is_empty()).then_some((name, value)))
}

/// The name and the content of an array.
fn array(bytes: &mut Bytes<'_>, depth: usize) -> Result<(String, Value), FormatError> {
    if bytes.is_empty() {
        let empty = NumericArray {
            shape: vec![0, 0],
            entries: Vec::new(),
        };
        return Ok((String::new(), Value::Numbers(empty)));
    }
    let flags = Element::read(bytes)?.data;
    let flags = flags
        .get(..4)
        .ok_or_else(|| bytes.damaged("the flags of an array"))?;
    let flags = unsigned(flags, bytes.is_big_endian()) as u32;
    let class = flags & 0xff;
    if class == 17 {
        return object(bytes);
    }
    let shape = shape(bytes)?;
    let name = text(Element::read(bytes)?.data);
    let value = match class {
        6..=15 => numbers(bytes, shape, flags)?,
        1 | 2 if depth == 0 => Value::Other("a structure that is nested too deeply".into()),
        1 => cell(bytes, &shape, depth)?,
        2 => structure(bytes, &shape, depth)?,
        3 => Value::Other("an object".into()),
        4 => characters(bytes, &shape)?,
        5 => Value::Other("a sparse matrix (convert it with `full`)".into()),
        16 => Value::Other("a function".into()),
        _ => Value::Other("data of an unknown class".into()),
    };
    Ok((name, value))
}

/// An object of a class, such as `tf`: its content is not documented.
fn object(bytes: &mut Bytes<'_>) -> Result<(String, Value), FormatError> {
    let name = text(Element::read(bytes)?.data);
    let _system = Element::read(bytes)?;
    let class = text(Element::read(bytes)?.data);
    Ok((
        name,
        Value::Other(format!("a MATLAB object of the class {class}")),
    ))
}

fn text(data: &[u8]) -> String {
    let text = String::from_utf8_lossy(data);
    text.trim_end_matches('\0').to_string()
}

/// A text of one row.
fn characters(bytes: &mut Bytes<'_>, shape: &[usize]) -> Result<Value, FormatError> {
    let big_endian = bytes.is_big_endian();
    let Element { kind, data } = Element::read(bytes)?;
    let several_rows = shape.len() == 2 && shape.first().is_some_and(|rows| *rows > 1);
    Ok(match kind {
        _ if several_rows => Value::Other("a text of several rows".into()),
        1 | 2 | 16 => Value::Text(text(data)),
        4 | 17 => Value::Text(utf16(data, big_endian)),
        _ => Value::Other("text".into()),
    })
}

fn utf16(data: &[u8], big_endian: bool) -> String {
    let units = data.chunks_exact(2);
    let units: Vec<u16> = units
        .map(|unit| unsigned(unit, big_endian) as u16)
        .collect();
    String::from_utf16_lossy(&units)
}

fn shape(bytes: &mut Bytes<'_>) -> Result<Vec<usize>, FormatError> {
    let sizes = Element::read(bytes)?.data.chunks_exact(4);
    let sizes = sizes.map(|part| unsigned(part, bytes.is_big_endian()) as usize);
    Ok(sizes.collect())
}

fn numbers(bytes: &mut Bytes<'_>, shape: Vec<usize>, flags: u32) -> Result<Value, FormatError> {
    let is_complex = flags & COMPLEX_FLAG != 0;
    let Some(count) = entry_count(&shape) else {
        return Ok(Value::Other("an array that is too large".into()));
    };
    let re = real_numbers(bytes, count)?;
    let im = if is_complex {
        real_numbers(bytes, count)?
    } else {
        vec![0.0; count]
    };
    if let (true, [flag]) = (flags & LOGICAL_FLAG != 0, re.as_slice()) {
        return Ok(Value::Flag(*flag != 0.0));
    }
    let entries = re.into_iter().zip(im).map(|(re, im)| Complex::new(re, im));
    Ok(Value::Numbers(NumericArray {
        shape,
        entries: entries.collect(),
    }))
}

fn real_numbers(bytes: &mut Bytes<'_>, count: usize) -> Result<Vec<f64>, FormatError> {
    let big_endian = bytes.is_big_endian();
    let Element { kind, data } = Element::read(bytes)?;
    let number = Number::of(kind).ok_or_else(|| bytes.damaged("the type of the numbers"))?;
    let numbers: Vec<f64> = data
        .chunks_exact(number.size)
        .map(|part| number.value(part, big_endian))
        .collect();
    if numbers.len() == count {
        Ok(numbers)
    } else {
        Err(bytes.damaged("as many numbers as the size of the array states"))
    }
}

/// How a number is stored. MATLAB stores doubles with integer values in fewer bytes.
#[derive(Clone, Copy)]
struct Number {
    size: usize,
    class: NumberClass,
}

#[derive(Clone, Copy)]
enum NumberClass {
    Signed,
    Unsigned,
    Float,
}

impl Number {
    fn of(kind: u32) -> Option<Number> {
        use NumberClass::{Float, Signed, Unsigned};
        let (size, class) = match kind {
            1 => (1, Signed),
            2 => (1, Unsigned),
            3 => (2, Signed),
            4 => (2, Unsigned),
            5 => (4, Signed),
            6 => (4, Unsigned),
            7 => (4, Float),
            9 => (8, Float),
            12 => (8, Signed),
            13 => (8, Unsigned),
            _ => return None,
        };
        Some(Number { size, class })
    }

    fn value(self, bytes: &[u8], big_endian: bool) -> f64 {
        match self.class {
            NumberClass::Signed => signed(bytes, big_endian) as f64,
            NumberClass::Unsigned => unsigned(bytes, big_endian) as f64,
            NumberClass::Float => float(bytes, big_endian),
        }
    }
}

/// A cell of one element is its element: `num` of a transfer function with one input and one output.
fn cell(bytes: &mut Bytes<'_>, shape: &[usize], depth: usize) -> Result<Value, FormatError> {
    match entry_count(shape) {
        Some(0) => Ok(Value::Empty),
        Some(1) => inner(bytes, depth),
        _ => Ok(Value::Other("a cell array of several elements".into())),
    }
}

fn structure(bytes: &mut Bytes<'_>, shape: &[usize], depth: usize) -> Result<Value, FormatError> {
    if entry_count(shape) != Some(1) {
        return Ok(Value::Other("an array of structures".into()));
    }
    let length = Element::read(bytes)?.data;
    let length = unsigned(length, bytes.is_big_endian()) as usize;
    let names = Element::read(bytes)?.data;
    if length == 0 || names.len() / length > MAX_FIELDS {
        return Err(bytes.damaged("the names of fields"));
    }
    let names = names.chunks_exact(length).map(text_before_null);
    let fields = names.map(|name| Ok((name, inner(bytes, depth)?)));
    Ok(Value::Fields(fields.collect::<Result<_, FormatError>>()?))
}

fn text_before_null(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    text(&bytes[..end.unwrap_or(bytes.len())])
}

/// An array inside another one.
fn inner(bytes: &mut Bytes<'_>, depth: usize) -> Result<Value, FormatError> {
    let element = Element::read(bytes)?;
    let mut inside = Bytes::new(element.data, bytes.is_big_endian());
    Ok(array(&mut inside, depth - 1)?.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The header of a file of this byte order.
    fn file(big_endian: bool, elements: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = vec![b' '; HEADER_BYTES - 4];
        bytes.extend(if big_endian {
            b"\x01\x00MI"
        } else {
            b"\x00\x01IM"
        });
        bytes.extend(elements.concat());
        bytes
    }

    fn number(x: u32, big_endian: bool) -> [u8; 4] {
        if big_endian {
            x.to_be_bytes()
        } else {
            x.to_le_bytes()
        }
    }

    /// An element with its tag, filled up to a multiple of eight bytes.
    fn element(kind: u32, data: &[u8], big_endian: bool) -> Vec<u8> {
        let mut bytes = number(kind, big_endian).to_vec();
        bytes.extend(number(data.len() as u32, big_endian));
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    }

    fn flags(class: u32, big_endian: bool) -> Vec<u8> {
        let words = [number(class, big_endian), [0; 4]];
        element(6, words.as_flattened(), big_endian)
    }

    fn vector(name: &[u8], bytes: &[u8], count: u32, kind: u32, big_endian: bool) -> Vec<u8> {
        let sizes = [number(1, big_endian), number(count, big_endian)];
        let parts = [
            flags(6, big_endian),
            element(5, sizes.as_flattened(), big_endian),
            element(1, name, big_endian),
            element(kind, bytes, big_endian),
        ];
        element(MATRIX, &parts.concat(), big_endian)
    }

    #[test]
    fn doubles_of_both_byte_orders_are_read_also_if_stored_as_integers() {
        for big_endian in [false, true] {
            // int16: -2 and 300.
            let words = [-2i16, 300].map(|x| {
                if big_endian {
                    x.to_be_bytes()
                } else {
                    x.to_le_bytes()
                }
            });
            let bytes = file(
                big_endian,
                &[vector(b"den", words.as_flattened(), 2, 3, big_endian)],
            );
            let found = variables(&bytes).expect("valid");
            let expected = NumericArray {
                shape: vec![1, 2],
                entries: vec![Complex::new(-2.0, 0.0), Complex::new(300.0, 0.0)],
            };
            assert_eq!(found, [("den".to_string(), Value::Numbers(expected))]);
        }
    }

    #[test]
    fn object_of_a_class_is_named_with_its_class() {
        // Flags, name, kind of system, class; what follows is not documented.
        let parts = [
            flags(17, false),
            element(1, b"C", false),
            element(1, b"MCOS", false),
            element(1, b"tf", false),
            element(6, &[0; 40], false),
        ];
        let bytes = file(false, &[element(MATRIX, &parts.concat(), false)]);
        let found = variables(&bytes).expect("valid");
        let what = "a MATLAB object of the class tf".to_string();
        assert_eq!(found, [("C".to_string(), Value::Other(what))]);
    }

    #[test]
    fn rejects_other_versions_and_sizes_that_do_not_agree() {
        let error = variables(b"MATLAB 7.3 MAT-file").expect_err("HDF5");
        assert!(error.to_string().contains("'-v7'"), "{error}");
        assert!(variables(&[0; 200]).is_err());
        // Three numbers are stated, two are stored.
        let bytes = file(false, &[vector(b"num", &[1, 2], 3, 1, false)]);
        let error = variables(&bytes).expect_err("damaged");
        assert!(error.to_string().contains("as many numbers"), "{error}");
        // A variable that ends in the middle.
        let whole = file(false, &[vector(b"num", &[1, 2, 3], 3, 1, false)]);
        assert!(variables(&whole).is_ok());
        for length in HEADER_BYTES + 1..whole.len() - 8 {
            assert!(variables(&whole[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn compressed_data_are_limited() {
        use std::io::Write;
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
        encoder
            .write_all(&vec![0; MAX_DECOMPRESSED_BYTES + 1])
            .expect("in memory");
        let compressed = encoder.finish().expect("in memory");
        let mut bytes = file(false, &[]);
        bytes.extend(number(COMPRESSED, false));
        bytes.extend(number(compressed.len() as u32, false));
        bytes.extend(compressed);
        let error = variables(&bytes).expect_err("too large");
        assert!(
            error.to_string().contains("limit of 4194304 bytes"),
            "{error}"
        );
    }
}

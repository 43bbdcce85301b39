//! Arrays of numpy: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>, versions 1 to 3.

use nalgebra::Complex;

use super::bytes::{Bytes, float, signed, unsigned};
use super::value::{NumericArray, Value, entry_count};
use crate::import_error::FormatError;

/// Longest text in characters.
const MAX_TEXT: usize = 4096;

const MAGIC: &[u8] = b"\x93NUMPY";

/// The array of a `.npy` file.
pub(super) fn array(bytes: &[u8]) -> Result<Value, FormatError> {
    let mut rest = Bytes::new(bytes, false);
    if rest.take(MAGIC.len(), "the mark of an array")? != MAGIC {
        return Err(rest.damaged("the mark of an array"));
    }
    let version = rest.take(2, "the version")?;
    let length = match version {
        [1, _] => unsigned(rest.take(2, "the length of the header")?, false) as usize,
        _ => rest.u32("the length of the header")? as usize,
    };
    let header = rest.take(length, "the header")?;
    let header = std::str::from_utf8(header).unwrap_or_default();
    let description = Description::of(header).ok_or_else(|| rest.damaged("the header"))?;
    let Some(kind) = Kind::of(&description.kind) else {
        return other(&description, &mut rest);
    };
    let Some(count) = entry_count(&description.shape) else {
        return Ok(Value::Other("an array that is too large".into()));
    };
    let data = rest.take(count * kind.size, "the numbers")?;
    let entries: Vec<Complex<f64>> = data
        .chunks_exact(kind.size)
        .map(|part| kind.number(part))
        .collect();
    Ok(Value::Numbers(if description.by_columns {
        NumericArray {
            shape: description.shape,
            entries,
        }
    } else {
        NumericArray::from_rows(description.shape, &entries)
    }))
}

/// An array of another type: one text or flag is read.
fn other(description: &Description, rest: &mut Bytes<'_>) -> Result<Value, FormatError> {
    let is_one = entry_count(&description.shape) == Some(1);
    let (class, size) = description.kind.split_at_checked(2).unwrap_or_default();
    let size: usize = size.parse().unwrap_or(0);
    match class {
        "|b" if is_one => Ok(Value::Flag(rest.take(1, "a flag")? != [0])),
        "<U" if is_one && size <= MAX_TEXT => {
            Ok(Value::Text(unicode(rest.take(4 * size, "a text")?)))
        }
        "|S" if is_one && size <= MAX_TEXT => {
            let text = String::from_utf8_lossy(rest.take(size, "a text")?);
            Ok(Value::Text(text.trim_end_matches('\0').into()))
        }
        _ => Ok(Value::Other(format!(
            "an array of the type {}",
            description.kind
        ))),
    }
}

/// A text of numpy: four bytes for each character, zeros at its end.
fn unicode(bytes: &[u8]) -> String {
    let codes = bytes
        .chunks_exact(4)
        .map(|part| unsigned(part, false) as u32);
    let characters = codes.take_while(|code| *code != 0);
    characters.filter_map(char::from_u32).collect()
}

/// The header: `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3), }`.
struct Description {
    kind: String,
    by_columns: bool,
    shape: Vec<usize>,
}

impl Description {
    fn of(header: &str) -> Option<Description> {
        let after = |key: &str| Some(header.split_once(key)?.1.trim_start());
        let kind = after("'descr':")?.strip_prefix('\'')?.split_once('\'')?.0;
        let by_columns = after("'fortran_order':")?.starts_with("True");
        let shape = after("'shape':")?.strip_prefix('(')?.split_once(')')?.0;
        let sizes = shape
            .split(',')
            .map(str::trim)
            .filter(|size| !size.is_empty());
        Some(Description {
            kind: kind.into(),
            by_columns,
            shape: sizes.map(|size| size.parse().ok()).collect::<Option<_>>()?,
        })
    }
}

/// The type of a number: `<f8` is eight bytes of floating point, little endian.
#[derive(Clone, Copy)]
struct Kind {
    class: char,
    size: usize,
    big_endian: bool,
}

impl Kind {
    fn of(text: &str) -> Option<Kind> {
        let mut characters = text.chars();
        let order = characters.next()?;
        let class = characters.next()?;
        let size: usize = characters.as_str().parse().ok()?;
        let known = match class {
            'f' => [4, 8].contains(&size),
            'c' => [8, 16].contains(&size),
            'i' | 'u' => [1, 2, 4, 8].contains(&size),
            _ => false,
        };
        known.then_some(Kind {
            class,
            size,
            big_endian: order == '>',
        })
    }

    fn number(self, bytes: &[u8]) -> Complex<f64> {
        let real = |x: f64| Complex::new(x, 0.0);
        match self.class {
            'c' => {
                let (re, im) = bytes.split_at(self.size / 2);
                Complex::new(float(re, self.big_endian), float(im, self.big_endian))
            }
            'i' => real(signed(bytes, self.big_endian) as f64),
            'u' => real(unsigned(bytes, self.big_endian) as f64),
            _ => real(float(bytes, self.big_endian)),
        }
    }
}

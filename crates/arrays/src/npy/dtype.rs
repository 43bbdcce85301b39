//! The type of the entries of an NPY file.

use super::literal::Literal;
use crate::bytes::ByteOrder;
use crate::number::{Class, Stored};
use crate::value::MAX_NAME_BYTES;

/// Most numbers of a field of several numbers that become fields of their own.
const MAX_PARTS: usize = 256;
/// Most fields of an entry.
const MAX_FIELDS: usize = 4096;

/// What an entry is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    Scalar(Scalar),
    Fields(Vec<Field>),
}

/// One number, or something else.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Scalar {
    Number {
        stored: Stored,
        order: ByteOrder,
        /// Unit of a time.
        unit: Option<String>,
    },
    Other {
        size: usize,
        what: String,
    },
}

/// A number with its name and its first byte in an entry.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Field {
    pub name: String,
    pub start: usize,
    pub scalar: Scalar,
}

impl Entry {
    /// The entry of a `descr`: `'<f8'`, or a list of fields.
    pub fn of(descr: &Literal) -> Option<Entry> {
        match descr {
            Literal::Text(code) => Scalar::of(code).map(Entry::Scalar),
            Literal::Items(items) => {
                let mut fields = Fields::default();
                for item in items {
                    fields.push(item, "")?;
                }
                Some(Entry::Fields(fields.all))
            }
            _ => None,
        }
    }

    /// Bytes of an entry.
    pub fn size(&self) -> usize {
        match self {
            Entry::Scalar(scalar) => scalar.size(),
            Entry::Fields(fields) => {
                let last = fields.last();
                last.map_or(0, |last| last.start.saturating_add(last.scalar.size()))
            }
        }
    }
}

/// Fields, one behind the other.
#[derive(Default)]
struct Fields {
    all: Vec<Field>,
    end: usize,
}

impl Fields {
    /// Appends `(name, descr)` or `(name, descr, shape)`; a name may be `(title, name)`, and a `descr` a list of fields.
    fn push(&mut self, item: &Literal, outer: &str) -> Option<()> {
        let (name, descr, shape) = match item.items()? {
            [name, descr] => (name, descr, None),
            [name, descr, shape] => (name, descr, Some(shape.items()?)),
            _ => return None,
        };
        let name = match name {
            Literal::Items(names) => names.last()?.text()?,
            name => name.text()?,
        };
        let name = format!("{outer}{name}");
        if name.len() > MAX_NAME_BYTES {
            return None;
        }
        let sizes = shape.unwrap_or_default().iter();
        let count = sizes
            .map(Literal::number)
            .try_fold(1usize, |n, size| n.checked_mul(size?))?;
        match descr {
            Literal::Text(code) => {
                self.push_scalars(&name, &Scalar::of(code)?, shape.is_some(), count)
            }
            Literal::Items(items) if count == 1 => {
                let inner = format!("{name}.");
                items.iter().try_for_each(|item| self.push(item, &inner))
            }
            _ => None,
        }
    }

    fn push_scalars(
        &mut self,
        name: &str,
        scalar: &Scalar,
        is_numbered: bool,
        count: usize,
    ) -> Option<()> {
        let is_read = matches!(scalar, Scalar::Number { .. }) && count <= MAX_PARTS;
        if !is_read {
            let size = scalar.size().checked_mul(count)?;
            let what = scalar.what();
            return self.append(name.into(), Scalar::Other { size, what });
        }
        for number in 1..=count {
            let name = if is_numbered {
                format!("{name}:{number}")
            } else {
                name.into()
            };
            self.append(name, scalar.clone())?;
        }
        Some(())
    }

    fn append(&mut self, name: String, scalar: Scalar) -> Option<()> {
        if self.all.len() == MAX_FIELDS {
            return None;
        }
        let start = self.end;
        self.end = start.checked_add(scalar.size())?;
        self.all.push(Field {
            name,
            start,
            scalar,
        });
        Some(())
    }
}

impl Scalar {
    /// The scalar of a code, such as `<f8`, `|b1` or `<M8[ns]`.
    fn of(code: &str) -> Option<Scalar> {
        let mut characters = code.chars();
        let order = match characters.next()? {
            '>' => ByteOrder::Big,
            '<' | '|' | '=' => ByteOrder::Little,
            _ => return None,
        };
        let class = characters.next()?;
        let rest = characters.as_str();
        let (size, unit) = rest.split_once('[').unwrap_or((rest, ""));
        // An object has no size that would be known.
        let size: usize = if class == 'O' { 8 } else { size.parse().ok()? };
        let unit = unit.trim_end_matches(']');
        Some(match stored(class, size) {
            Some(stored) if !is_time(class) => Scalar::Number {
                stored,
                order,
                unit: None,
            },
            Some(stored) if time_unit(unit).is_some() => Scalar::Number {
                stored,
                order,
                unit: time_unit(unit).map(String::from),
            },
            _ => Scalar::Other {
                size: if class == 'U' {
                    size.checked_mul(4)?
                } else {
                    size
                },
                what: what(class, code),
            },
        })
    }

    fn size(&self) -> usize {
        match self {
            Scalar::Number { stored, .. } => stored.size,
            Scalar::Other { size, .. } => *size,
        }
    }

    fn what(&self) -> String {
        match self {
            Scalar::Number { .. } => "a field of too many numbers".into(),
            Scalar::Other { what, .. } => what.clone(),
        }
    }
}

fn stored(class: char, size: usize) -> Option<Stored> {
    let (class, sizes): (Class, &[usize]) = match class {
        'f' => (Class::Float, &[2, 4, 8]),
        'c' => (Class::Complex, &[8, 16]),
        'i' => (Class::Signed, &[1, 2, 4, 8]),
        'u' => (Class::Unsigned, &[1, 2, 4, 8]),
        'b' => (Class::Unsigned, &[1]),
        'M' | 'm' => (Class::Signed, &[8]),
        _ => return None,
    };
    sizes.contains(&size).then_some(Stored::new(class, size))
}

fn is_time(class: char) -> bool {
    matches!(class, 'M' | 'm')
}

/// The unit of a time as a name of a unit; `m` is the minute of NumPy.
fn time_unit(unit: &str) -> Option<&str> {
    match unit {
        "m" => Some("min"),
        "s" | "ms" | "us" | "ns" | "h" | "D" => Some(unit),
        _ => None,
    }
}

fn what(class: char, code: &str) -> String {
    match class {
        'O' => "Python objects".into(),
        'U' | 'S' | 'a' => "texts".into(),
        'V' => "bytes without a type".into(),
        'f' | 'c' => format!("numbers of the type {code} (save them as float64)"),
        _ => format!("data of the type {}", code.escape_default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_numbers_are_read_and_others_named() {
        for (code, class, size, order) in [
            ("<f8", Class::Float, 8, ByteOrder::Little),
            (">f4", Class::Float, 4, ByteOrder::Big),
            ("<f2", Class::Float, 2, ByteOrder::Little),
            ("|b1", Class::Unsigned, 1, ByteOrder::Little),
            ("|u1", Class::Unsigned, 1, ByteOrder::Little),
            (">i8", Class::Signed, 8, ByteOrder::Big),
            ("<c16", Class::Complex, 16, ByteOrder::Little),
        ] {
            let expected = Scalar::Number {
                stored: Stored::new(class, size),
                order,
                unit: None,
            };
            assert_eq!(Scalar::of(code), Some(expected), "{code}");
        }
        for (code, size, word) in [
            ("|O", 8, "objects"),
            ("<U3", 12, "texts"),
            ("<f16", 16, "float64"),
            ("<M8[25us]", 8, "M8"),
        ] {
            let Some(Scalar::Other { size: found, what }) = Scalar::of(code) else {
                panic!("{code}");
            };
            assert_eq!(found, size, "{code}");
            assert!(what.contains(word), "{what}");
        }
        for code in ["", "<", "f8", "<f", "<fx", "<U99999999999999999999"] {
            assert_eq!(Scalar::of(code), None, "{code}");
        }
    }

    #[test]
    fn times_have_their_unit() {
        for (code, expected) in [("<M8[ns]", "ns"), ("<m8[ms]", "ms"), ("<M8[m]", "min")] {
            let Some(Scalar::Number { unit, .. }) = Scalar::of(code) else {
                panic!("{code}");
            };
            assert_eq!(unit.as_deref(), Some(expected));
        }
    }

    #[test]
    fn fields_follow_one_another_with_padding_and_parts() {
        let text =
            "[('t', '<f8'), ('', '|V4'), (('Force', 'u'), '<f4', (2,)), ('s', [('y', '<i2')])]";
        let entry = Literal::parse(text).and_then(|descr| Entry::of(&descr));
        let Some(Entry::Fields(fields)) = &entry else {
            panic!("{entry:?}");
        };
        let places: Vec<(&str, usize)> =
            fields.iter().map(|f| (f.name.as_str(), f.start)).collect();
        assert_eq!(
            places,
            [("t", 0), ("", 8), ("u:1", 12), ("u:2", 16), ("s.y", 20)]
        );
        assert_eq!(entry.expect("fields").size(), 22);
    }
}

//! HDF5 files, as also MAT-files of version 7.3, read by the crate `hdf5-reader`.
//!
//! ```text
//! group    -> structure of its members         dataset of numbers  -> array
//! dataset of a compound type -> structure of its fields, or complex numbers
//! ```
//!
//! A dataset that cannot be read, as with a filter of a plugin, is named with the reason; the others are read.

use std::collections::HashSet;

use hdf5_reader::group::Group;
use hdf5_reader::{CompoundField, Dataset, Datatype, Hdf5File, OpenOptions};

use crate::budget::Budget;
use crate::bytes::ByteOrder;
use crate::error::ArraysError;
use crate::number::{Class, Stored};
use crate::places::Places;
use crate::value::{MAX_NAME_BYTES, NumericArray, Value, Variables, entry_count, printable};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
const MATLAB_HEADER: &[u8] = b"MATLAB 7.3";
/// Where the signature of a file may be: behind a block of the user of 512 bytes or of a power of two above (HDF5 File Format
/// Specification, II.A). MATLAB has one of 512 bytes.
const SIGNATURE_PLACES: [usize; 5] = [0, 512, 1024, 2048, 4096];
/// Deepest group in a group.
const MAX_DEPTH: usize = 16;
/// Groups and datasets of MATLAB itself, such as `#refs#`.
const MATLAB_OWN: char = '#';

/// Whether it is an HDF5 file, or begins as one.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    let is_at = |place: &usize| {
        let rest = bytes.get(*place..);
        rest.is_some_and(|rest| rest.starts_with(SIGNATURE))
    };
    bytes.starts_with(MATLAB_HEADER) || SIGNATURE_PLACES.iter().any(is_at)
}

/// The datasets and groups of a file.
pub(crate) fn variables(bytes: &[u8], budget: &mut Budget) -> Result<Variables, ArraysError> {
    let unreadable = |error: hdf5_reader::error::Error| ArraysError::Hdf5 {
        reason: printable(error.to_string().as_bytes()),
    };
    let options = OpenOptions::default().with_chunk_cache_bytes(0);
    let file = Hdf5File::from_bytes_with_options(bytes, options).map_err(unreadable)?;
    let root = file.root_group().map_err(unreadable)?;
    let mut reader = Reader {
        budget,
        seen: HashSet::from([root.address()]),
    };
    let (groups, datasets) = root.members().map_err(unreadable)?;
    reader.members(groups, datasets, MAX_DEPTH)
}

/// What is read so far.
struct Reader<'a> {
    budget: &'a mut Budget,
    /// Addresses of the groups that are read: a group may be a member of several ones, and of itself.
    seen: HashSet<u64>,
}

impl Reader<'_> {
    fn members(
        &mut self,
        groups: Vec<Group>,
        datasets: Vec<Dataset>,
        depth: usize,
    ) -> Result<Variables, ArraysError> {
        let mut all = Variables::new();
        for dataset in datasets {
            if let Some(name) = member_name(dataset.name()) {
                let value = self.dataset(&dataset)?;
                all.push((name, value));
            }
        }
        for group in groups {
            if let Some(name) = member_name(group.name()) {
                let value = self.group(&group, depth)?;
                all.push((name, value));
            }
        }
        all.sort_by(|(a, _), (b, _)| a.cmp(b));
        Ok(all)
    }

    fn group(&mut self, group: &Group, depth: usize) -> Result<Value, ArraysError> {
        self.budget.take(0, 0)?;
        if text_attribute(group.attribute("MATLAB_sparse")).is_some() {
            return Ok(Value::Other("a sparse matrix".into()));
        }
        if depth == 0 {
            return Ok(Value::Other("a group that is nested deeply".into()));
        }
        if !self.seen.insert(group.address()) {
            return Ok(Value::Other("a group that has several names".into()));
        }
        match group.members() {
            Ok((groups, datasets)) => {
                let members = self.members(groups, datasets, depth - 1)?;
                Ok(Value::Fields(members))
            }
            Err(error) => Ok(unreadable(&error)),
        }
    }

    fn dataset(&mut self, dataset: &Dataset) -> Result<Value, ArraysError> {
        self.budget.take(0, 0)?;
        let class = text_attribute(dataset.attribute("MATLAB_class"));
        match class.as_deref() {
            Some("cell") => return Ok(Value::Other("a cell array".into())),
            Some("char") => return self.characters(dataset),
            Some("function_handle") => return Ok(Value::Other("a function".into())),
            _ => {}
        }
        let is_matlab = class.is_some();
        if is_matlab && dataset.attribute("MATLAB_empty").is_ok() {
            return Ok(Value::Other("empty".into()));
        }
        match Entry::of(dataset.dtype()) {
            Entry::Numbers(stored, order) => {
                let whole = Part {
                    stored,
                    order,
                    start: 0,
                };
                self.read(dataset, is_matlab, |array, reader| {
                    reader.numbers(array, whole, unit(dataset))
                })
            }
            Entry::Fields(fields) => self.read(dataset, is_matlab, |array, reader| {
                reader.fields(array, fields)
            }),
            Entry::Text => Ok(text(dataset)),
            Entry::Other(what) => Ok(Value::Other(what.into())),
        }
    }

    /// The bytes of a dataset, converted by `convert`.
    fn read(
        &mut self,
        dataset: &Dataset,
        is_fortran: bool,
        convert: impl FnOnce(&Array, &mut Self) -> Result<Value, ArraysError>,
    ) -> Result<Value, ArraysError> {
        let sizes = dataset.shape().iter().map(|size| usize::try_from(*size));
        let Ok(mut shape) = sizes.collect::<Result<Vec<usize>, _>>() else {
            return Ok(Value::Other("an array that is too large".into()));
        };
        // The dimensions of MATLAB are stored from the last one on.
        if is_fortran {
            shape.reverse();
        }
        let (Some(count), Ok(bytes)) = (entry_count(&shape), dataset.raw_byte_len()) else {
            return Ok(Value::Other("an array that is too large".into()));
        };
        self.budget.take_unpacked(bytes as u64)?;
        match dataset.read_raw_bytes() {
            Ok(data) => {
                let array = Array {
                    places: Places::new(&shape, is_fortran, count),
                    entry_bytes: data.len().checked_div(count).unwrap_or_default(),
                    shape,
                    data,
                };
                convert(&array, self)
            }
            Err(error) => Ok(unreadable(&error)),
        }
    }

    fn numbers(
        &mut self,
        array: &Array,
        part: Part,
        unit: Option<String>,
    ) -> Result<Value, ArraysError> {
        let Part {
            stored,
            order,
            start,
        } = part;
        self.budget
            .take(array.places.count(), stored.memory_bytes())?;
        let bytes = start..start + stored.size;
        let items = array.places.items(&array.data, array.entry_bytes, bytes);
        Ok(Value::Numbers(NumericArray {
            shape: array.shape.clone(),
            numbers: stored.numbers(order, items),
            unit,
        }))
    }

    fn fields(&mut self, array: &Array, fields: &[CompoundField]) -> Result<Value, ArraysError> {
        let mut values = Vec::new();
        for field in fields {
            let Some(name) = member_name(&field.name) else {
                continue;
            };
            let value = match Entry::of(&field.datatype) {
                Entry::Numbers(stored, order) => {
                    let start = field.byte_offset as usize;
                    let part = Part {
                        stored,
                        order,
                        start,
                    };
                    self.numbers(array, part, None)?
                }
                Entry::Fields(_) => Value::Other("a structure in a structure".into()),
                Entry::Text => Value::Other("texts".into()),
                Entry::Other(what) => Value::Other(what.into()),
            };
            values.push((name, value));
        }
        Ok(Value::Fields(values))
    }

    /// A text of MATLAB: units of UTF-16.
    fn characters(&mut self, dataset: &Dataset) -> Result<Value, ArraysError> {
        let Datatype::FixedPoint {
            size: 2,
            byte_order,
            ..
        } = dataset.dtype()
        else {
            return Ok(Value::Other("a text".into()));
        };
        let order = order(byte_order);
        self.read(dataset, true, |array, reader| {
            reader.budget.take(array.places.count(), 4)?;
            let has_several_rows = array.shape.first().is_some_and(|rows| *rows > 1);
            if has_several_rows {
                return Ok(Value::Other("a text of several lines".into()));
            }
            let units = array.data.chunks_exact(2);
            let units: Vec<u16> = units.map(|unit| order.bits(unit) as u16).collect();
            let text = String::from_utf16_lossy(&units);
            Ok(Value::Text(printable(text.as_bytes())))
        })
    }
}

/// The bytes of a dataset with its shape.
struct Array {
    shape: Vec<usize>,
    places: Places,
    entry_bytes: usize,
    data: Vec<u8>,
}

/// Numbers that begin at a byte of each entry.
#[derive(Clone, Copy)]
struct Part {
    stored: Stored,
    order: ByteOrder,
    start: usize,
}

/// What an entry of a dataset is.
enum Entry<'a> {
    Numbers(Stored, ByteOrder),
    Fields(&'a [CompoundField]),
    Text,
    Other(&'static str),
}

impl Entry<'_> {
    fn of(datatype: &Datatype) -> Entry<'_> {
        match datatype {
            Datatype::FixedPoint {
                size: size @ (1 | 2 | 4 | 8),
                signed,
                byte_order,
            } => {
                let class = if *signed {
                    Class::Signed
                } else {
                    Class::Unsigned
                };
                Entry::Numbers(Stored::new(class, usize::from(*size)), order(byte_order))
            }
            Datatype::FloatingPoint {
                size: size @ (2 | 4 | 8),
                byte_order,
            } => Entry::Numbers(
                Stored::new(Class::Float, usize::from(*size)),
                order(byte_order),
            ),
            // As a boolean of h5py.
            Datatype::Enum { base, .. } => Entry::of(base),
            Datatype::Compound { size, fields } => match complex(*size, fields) {
                Some((stored, order)) => Entry::Numbers(stored, order),
                None => Entry::Fields(fields),
            },
            Datatype::String { .. } | Datatype::VarLen { .. } => Entry::Text,
            Datatype::Reference { .. } => {
                Entry::Other("references, as of a cell array or an array of structures")
            }
            Datatype::FixedPoint { .. } | Datatype::FloatingPoint { .. } => {
                Entry::Other("numbers of an unusual size")
            }
            Datatype::Array { .. } => Entry::Other("an array of arrays"),
            Datatype::Opaque { .. } | Datatype::Bitfield { .. } => Entry::Other("bytes"),
        }
    }
}

/// Complex numbers: real and imaginary part as two floats, one behind the other.
fn complex(size: u32, fields: &[CompoundField]) -> Option<(Stored, ByteOrder)> {
    const NAMES: [[&str; 2]; 3] = [["real", "imag"], ["r", "i"], ["re", "im"]];
    let [re, im] = fields else {
        return None;
    };
    let names = [re.name.as_str(), im.name.as_str()];
    let Entry::Numbers(stored, order) = Entry::of(&re.datatype) else {
        return None;
    };
    let is_complex = NAMES.contains(&names)
        && stored.class == Class::Float
        && stored.size >= 4
        && re.datatype == im.datatype
        && re.byte_offset == 0
        && im.byte_offset as usize == stored.size
        && size as usize == 2 * stored.size;
    is_complex.then(|| (Stored::new(Class::Complex, 2 * stored.size), order))
}

fn order(byte_order: &hdf5_reader::ByteOrder) -> ByteOrder {
    match byte_order {
        hdf5_reader::ByteOrder::LittleEndian => ByteOrder::Little,
        hdf5_reader::ByteOrder::BigEndian => ByteOrder::Big,
    }
}

/// A name that can be printed; `None` of what MATLAB stores for itself, and of names that are too long.
fn member_name(name: &str) -> Option<String> {
    let is_used = !name.starts_with(MATLAB_OWN) && name.len() <= MAX_NAME_BYTES;
    is_used.then(|| printable(name.as_bytes()))
}

fn text(dataset: &Dataset) -> Value {
    match dataset.read_string() {
        Ok(text) => Value::Text(printable(text.as_bytes())),
        Err(_) => Value::Other("texts".into()),
    }
}

/// The unit of a dataset by its attribute, as `units` of netCDF and h5py: one word.
fn unit(dataset: &Dataset) -> Option<String> {
    let names = ["units", "unit", "Units", "Unit"];
    let unit = names
        .iter()
        .find_map(|name| text_attribute(dataset.attribute(name)))?;
    let unit = printable(unit.trim().as_bytes());
    let is_one_word = !unit.is_empty() && !unit.contains(char::is_whitespace);
    is_one_word.then_some(unit)
}

fn text_attribute(attribute: hdf5_reader::error::Result<hdf5_reader::Attribute>) -> Option<String> {
    attribute.ok()?.read_string().ok()
}

fn unreadable(error: &hdf5_reader::error::Error) -> Value {
    let reason = printable(error.to_string().as_bytes());
    Value::Other(format!("an array that cannot be read: {reason}"))
}

#[cfg(test)]
mod tests;

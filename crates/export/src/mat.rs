//! MATLAB, level 5, little-endian, not compressed ("MAT-File Format", The MathWorks, chapter 1).
//!
//! A data element is a tag (type and number of bytes, 32 bits each) and data, padded to 8 bytes. An array is an element whose data
//! are the elements flags, dimensions, name and contents.
//!
//! No crate writes such files as a stream: `matrw` and `mat5` hold all variables in memory, `matfile` only reads, and `matio-rs`
//! needs a C library.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use super::file::Output;
use super::response::Response;
use super::rows::{self, Rows};
use super::sections::Sections;
use super::{ExportError, SIGNALS, Signal, Value};
use bench_base::units::rad_s;
use bench_identify::Frf;
use bench_recording::Recording;
use bench_rt::record::TickRecord;

/// Types of data elements.
const INT8: u32 = 1;
const UINT16: u32 = 4;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const UINT64: u32 = 13;
const MATRIX: u32 = 14;

/// Classes of arrays.
const STRUCT_CLASS: u32 = 2;
const CHAR_CLASS: u32 = 4;
const DOUBLE_CLASS: u32 = 6;
const UINT64_CLASS: u32 = 15;
/// Flag of an array with an imaginary part.
const COMPLEX: u32 = 0x0800;

/// Bytes of a field name in a struct, with the terminating zero.
const FIELD_NAME_BYTES: usize = 32;

/// A column vector for each signal: doubles, NaN where there is no measurement, and 64-bit integers for counts.
pub(super) fn signals(recording: &Path, file: &File) -> Result<Recording, ExportError> {
    let recording = Recording::open(recording)?;
    let rows = recording.tick_count();
    let mut heads = vec![header().to_vec()];
    for signal in &SIGNALS {
        heads.push(column_head(signal, rows)?);
    }
    // The header of the file is a section, and so is each column behind it.
    let lengths = heads.iter().enumerate().map(|(index, head)| {
        let data = if index == 0 { 0 } else { 8 * rows };
        head.len() as u64 + data
    });
    let mut columns = Columns(Sections::new(file, lengths));
    for (index, head) in heads.iter().enumerate() {
        columns.0.append(index, head)?;
    }
    rows::read(&recording, &mut columns)?;
    columns.0.finish()?;
    Ok(recording)
}

/// Everything of a column before its numbers.
fn column_head(signal: &Signal, rows: u64) -> Result<Vec<u8>, ExportError> {
    let (class, kind) = match signal.value {
        Value::Real(..) => (DOUBLE_CLASS, DOUBLE),
        Value::Count(_) => (UINT64_CLASS, UINT64),
    };
    let head = array_head(class, &[dimension(rows)?, 1], signal.name);
    let bytes = 8 * rows;
    let array_tag = tag(MATRIX, head.len() as u64 + 8 + bytes)?;
    Ok([&array_tag[..], &head, &tag(kind, bytes)?].concat())
}

/// Writes the numbers of each column, which begin with section 1.
struct Columns<'a>(Sections<'a>);

impl Rows for Columns<'_> {
    fn push(&mut self, record: &TickRecord) -> Result<(), ExportError> {
        for (index, signal) in SIGNALS.iter().enumerate() {
            let bytes = match signal.value {
                Value::Real(..) => signal.number(record).to_le_bytes(),
                Value::Count(value) => value(record).to_le_bytes(),
            };
            self.0.append(index + 1, &bytes)?;
        }
        Ok(())
    }
}

/// The struct `frf` with the fields of an `idfrd` object: `ResponseData` (1 x 1 x N), `Frequency` (N x 1), `FrequencyUnit`, `Ts`,
/// `InputName`, `InputUnit`, `OutputName`, `OutputUnit`, `CovarianceData` (1 x 1 x N x 2 x 2: the covariance of real and imaginary
/// part), and `Coherence` (N x 1) and `ResolutionHz` (N x 1), which `idfrd` does not have.
///
/// The error of a measured response is circular: real and imaginary part have the variance sigma(|H|)^2 each, and no covariance.
pub(super) fn response(response: &Response<'_>, out: &mut Output) -> Result<(), ExportError> {
    let frf = response.frf;
    let points = dimension(frf.len() as u64)?;
    let column = [points, 1];
    let real: Vec<f64> = frf.response.iter().map(|h| h.re).collect();
    let imaginary: Vec<f64> = frf.response.iter().map(|h| h.im).collect();
    let frequency_rad_s: Vec<f64> = frf.frequency_hz.iter().map(|f| rad_s(*f)).collect();
    let fields: Vec<(&str, Vec<u8>)> = vec![
        (
            "ResponseData",
            numbers(&[1, 1, points], &real, Some(&imaginary))?,
        ),
        ("Frequency", numbers(&column, &frequency_rad_s, None)?),
        ("FrequencyUnit", text("rad/s")?),
        ("Ts", numbers(&[1, 1], &[response.period_s], None)?),
        ("InputName", text("current")?),
        ("InputUnit", text("A")?),
        ("OutputName", text("position")?),
        ("OutputUnit", text("m")?),
        (
            "CovarianceData",
            numbers(&[1, 1, points, 2, 2], &covariance(frf), None)?,
        ),
        ("Coherence", numbers(&column, &frf.coherence, None)?),
        ("ResolutionHz", numbers(&column, &frf.resolution_hz, None)?),
    ];
    out.write_all(&header())?;
    out.write_all(&structure("frf", &fields)?)?;
    Ok(())
}

/// The four entries of all 2 x 2 matrices, the first frequency index fastest.
fn covariance(frf: &Frf) -> Vec<f64> {
    let variance: Vec<f64> = frf.magnitude_sigma.iter().map(|s| s * s).collect();
    let zero = vec![0.0; variance.len()];
    [&variance[..], &zero, &zero, &variance].concat()
}

/// 116 bytes of text, 8 bytes without meaning here, version and byte order.
fn header() -> [u8; 128] {
    let mut header = [b' '; 128];
    let text = b"MATLAB 5.0 MAT-file, written by bench";
    header[..text.len()].copy_from_slice(text);
    header[116..124].fill(0);
    header[124..].copy_from_slice(&[0x00, 0x01, b'I', b'M']);
    header
}

fn dimension(count: u64) -> Result<i32, ExportError> {
    i32::try_from(count).map_err(|_| ExportError::TooLarge {
        bytes: count.saturating_mul(8),
    })
}

fn tag(kind: u32, bytes: u64) -> Result<[u8; 8], ExportError> {
    let length = u32::try_from(bytes).map_err(|_| ExportError::TooLarge { bytes })?;
    let mut tag = [0; 8];
    tag[..4].copy_from_slice(&kind.to_le_bytes());
    tag[4..].copy_from_slice(&length.to_le_bytes());
    Ok(tag)
}

/// An element with its padding. The data are shorter than 2^32 bytes: names, dimensions and flags.
fn small_element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut element = kind.to_le_bytes().to_vec();
    element.extend((data.len() as u32).to_le_bytes());
    element.extend(data);
    element.resize(element.len().next_multiple_of(8), 0);
    element
}

/// Flags, dimensions and name of an array.
fn array_head(class_and_flags: u32, dimensions: &[i32], name: &str) -> Vec<u8> {
    let flags = [class_and_flags.to_le_bytes(), [0; 4]].concat();
    let dimensions: Vec<u8> = dimensions.iter().flat_map(|d| d.to_le_bytes()).collect();
    [
        small_element(UINT32, &flags),
        small_element(INT32, &dimensions),
        small_element(INT8, name.as_bytes()),
    ]
    .concat()
}

fn array(head: &[u8], contents: &[u8]) -> Result<Vec<u8>, ExportError> {
    let mut array = tag(MATRIX, (head.len() + contents.len()) as u64)?.to_vec();
    array.extend(head);
    array.extend(contents);
    Ok(array)
}

/// An array of doubles without a name, the first index fastest.
fn numbers(
    dimensions: &[i32],
    real: &[f64],
    imaginary: Option<&[f64]>,
) -> Result<Vec<u8>, ExportError> {
    let mut contents = Vec::new();
    for part in [Some(real), imaginary].into_iter().flatten() {
        contents.extend(tag(DOUBLE, 8 * part.len() as u64)?);
        contents.extend(part.iter().flat_map(|number| number.to_le_bytes()));
    }
    let flags = if imaginary.is_some() { COMPLEX } else { 0 };
    array(&array_head(DOUBLE_CLASS | flags, dimensions, ""), &contents)
}

/// A row of characters without a name.
fn text(text: &str) -> Result<Vec<u8>, ExportError> {
    let units: Vec<u16> = text.encode_utf16().collect();
    let bytes: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
    let head = array_head(CHAR_CLASS, &[1, dimension(units.len() as u64)?], "");
    array(&head, &small_element(UINT16, &bytes))
}

/// A struct of one element. The names of the fields have fewer than 32 bytes.
fn structure(name: &str, fields: &[(&str, Vec<u8>)]) -> Result<Vec<u8>, ExportError> {
    let mut names = vec![0; FIELD_NAME_BYTES * fields.len()];
    for (slot, (name, _)) in names.chunks_mut(FIELD_NAME_BYTES).zip(fields) {
        slot[..name.len()].copy_from_slice(name.as_bytes());
    }
    // The length of the names is an element in the short form: number of bytes and type in one word.
    let mut contents = (4 << 16 | INT32).to_le_bytes().to_vec();
    contents.extend((FIELD_NAME_BYTES as u32).to_le_bytes());
    contents.extend(small_element(INT8, &names));
    for (_, field) in fields {
        contents.extend(field);
    }
    array(&array_head(STRUCT_CLASS, &[1, 1], name), &contents)
}

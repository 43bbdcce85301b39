//! The first 13 lines of a dataset.

use super::dataset::Function;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::value::printable;

/// How the data are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    Text,
    Binary(ByteOrder),
    /// Binary numbers of VAX or IBM.
    OtherBinary,
}

/// The form of a dataset by the line with its number; `None` for other datasets than 58 and 58b.
///
/// Columns 1 to 6 are the number, column 7 is `b` for binary data, 8 to 13 the order of the bytes (1 little-endian), 14 to 19 the format
/// (2 is IEEE 754).
pub(super) fn form(line: &[u8]) -> Option<Form> {
    if field(line, 0, 6) != "58" {
        return None;
    }
    match line.get(6) {
        Some(b'b' | b'B') if field(line, 13, 19) != "2" => Some(Form::OtherBinary),
        Some(b'b' | b'B') if field(line, 7, 13) == "1" => Some(Form::Binary(ByteOrder::Little)),
        Some(b'b' | b'B') => Some(Form::Binary(ByteOrder::Big)),
        _ => Some(Form::Text),
    }
}

/// Abscissas of equal distance: the first one and the step as written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Even {
    pub first: f64,
    pub step: f64,
    pub step_text: String,
}

/// What the lines before the data say.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub function: Function,
    pub id: String,
    pub place: String,
    pub is_complex: bool,
    pub is_double: bool,
    pub points: usize,
    /// `None` for abscissas that stand beside the ordinates.
    pub even: Option<Even>,
    pub abscissa_unit: Option<String>,
    pub unit: Option<String>,
    pub denominator_unit: Option<String>,
}

impl Header {
    pub fn read(file: &mut Bytes<'_>) -> Result<Header, ArraysError> {
        let lines = lines(file)?;
        let what = "the numbers of lines 6 and 7 of a dataset 58";
        Header::of(&lines).ok_or_else(|| file.damaged(what))
    }

    fn of(lines: &[&[u8]; 11]) -> Option<Header> {
        let function = match field(lines[5], 0, 5).parse().ok()? {
            1 => Function::TimeResponse,
            4 => Function::FrequencyResponse,
            code => Function::Other(code),
        };
        let form = String::from_utf8_lossy(lines[6]).into_owned();
        let form: Vec<&str> = form.split_whitespace().collect();
        let (is_complex, is_double) = match *form.first()? {
            "2" => (false, false),
            "4" => (false, true),
            "5" => (true, false),
            "6" => (true, true),
            _ => return None,
        };
        Some(Header {
            function,
            id: stated(&field(lines[0], 0, 80)).unwrap_or_default(),
            place: place(lines[5]),
            is_complex,
            is_double,
            points: form.get(1)?.parse().ok()?,
            even: even(&form)?,
            abscissa_unit: unit(lines[7]),
            unit: unit(lines[8]),
            denominator_unit: unit(lines[9]),
        })
    }
}

fn lines<'a>(file: &mut Bytes<'a>) -> Result<[&'a [u8]; 11], ArraysError> {
    let mut lines = [&[][..]; 11];
    for line in &mut lines {
        let next = file.line();
        *line = next.ok_or_else(|| file.damaged("11 lines before the data of a dataset 58"))?;
    }
    Ok(lines)
}

/// Columns of a line, counted from 0, without spaces around them.
fn field(line: &[u8], start: usize, end: usize) -> String {
    let part = line.get(start..end.min(line.len()));
    printable(part.unwrap_or_default().trim_ascii())
}

/// A text that is not left out.
fn stated(text: &str) -> Option<String> {
    (!text.is_empty() && text != "NONE").then(|| text.to_string())
}

/// The unit of an axis: the second label, in columns 48 to 67.
fn unit(line: &[u8]) -> Option<String> {
    stated(&field(line, 47, 67))
}

/// Response node and direction: `2:+Z`, or `2:-RX` for a rotation; `2` for a scalar.
fn place(line: &[u8]) -> String {
    let node = field(line, 41, 51);
    let direction: i32 = field(line, 51, 55).parse().unwrap_or_default();
    let sign = if direction < 0 { '-' } else { '+' };
    match direction.unsigned_abs() {
        code @ 1..=3 => format!("{node}:{sign}{}", axis(code)),
        code @ 4..=6 => format!("{node}:{sign}R{}", axis(code - 3)),
        _ => node,
    }
}

fn axis(code: u32) -> char {
    match code {
        1 => 'X',
        2 => 'Y',
        _ => 'Z',
    }
}

/// The abscissas by the fields 3 to 5 of line 7; `Some(None)` if each has its own number.
fn even(form: &[&str]) -> Option<Option<Even>> {
    match *form.get(2)? {
        "0" => Some(None),
        "1" => {
            let step_text = (*form.get(4)?).to_string();
            Some(Some(Even {
                first: number(form.get(3)?)?,
                step: number(&step_text)?,
                step_text,
            }))
        }
        _ => None,
    }
}

/// A number as Fortran writes it, also `1.0D-03`.
pub(super) fn number(text: &str) -> Option<f64> {
    let read = text.parse().ok();
    read.or_else(|| text.replace(['d', 'D'], "e").parse().ok())
}

//! Patterns for the lines of probes that send text.
//!
//! ```text
//! {value}       a decimal number: spaces, an optional sign, digits with at most one point; at most 15 digits
//! {value:8}     the same in exactly 8 characters
//! {value:8.4}   the same with exactly 4 digits after the point
//! {code}        a whole number
//! {skip}        any characters, or none, up to the first place where the text after the field is found
//! \r \n \t      carriage return, line feed, tabulator;   \xNN a byte;   \\ and \{ the characters themselves
//! other characters stand for themselves
//! ```
//!
//! A pattern matches a whole line. Only a `{value}` with a width may be followed directly by another field. Set the width
//! where the probe has a fixed one: then a line that lost or gained a character is not used as a value.

use super::super::error::SerialError;

/// A compiled pattern.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Pattern {
    pieces: Vec<Piece>,
}

#[derive(Clone, Debug, PartialEq)]
enum Piece {
    Literal(Vec<u8>),
    Value {
        width: Option<usize>,
        decimals: Option<usize>,
    },
    Code,
    Skip,
}

/// The texts that a line has in place of the fields.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fields<'a> {
    pub value: Option<&'a [u8]>,
    pub code: Option<&'a [u8]>,
}

/// A decimal number as written: `digits / 10^decimals`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decimal {
    pub digits: i64,
    pub decimals: i32,
}

impl Decimal {
    /// The nearest f64: digits (at most 15) and power of ten are exact in f64, so only the division rounds.
    pub(super) fn to_f64(self) -> f64 {
        self.digits as f64 / 10f64.powi(self.decimals)
    }

    /// Parses `text` as one number; `None` if it contains anything else.
    pub(super) fn read(text: &[u8]) -> Option<Self> {
        let (is_negative, unsigned) = split_sign(skip_spaces(text))?;
        let mut parts = unsigned.splitn(2, |byte| *byte == b'.');
        let (whole, fraction) = (parts.next()?, parts.next().unwrap_or_default());
        let digits = read_digits(&[whole, fraction].concat())?;
        Some(Self {
            digits: if is_negative { -digits } else { digits },
            decimals: fraction.len() as i32,
        })
    }
}

fn skip_spaces(text: &[u8]) -> &[u8] {
    let spaces = text.iter().take_while(|byte| **byte == b' ').count();
    &text[spaces..]
}

fn split_sign(text: &[u8]) -> Option<(bool, &[u8])> {
    Some(match text.split_first()? {
        (b'-', rest) => (true, rest),
        (b'+', rest) => (false, rest),
        _ => (false, text),
    })
}

/// 1 to 15 digits as a number.
fn read_digits(digits: &[u8]) -> Option<i64> {
    if !(1..=15).contains(&digits.len()) || !digits.iter().all(u8::is_ascii_digit) {
        return None;
    }
    Some(
        digits
            .iter()
            .fold(0, |number, digit| 10 * number + i64::from(digit - b'0')),
    )
}

impl Pattern {
    /// Compiles `text`, the setting `name`.
    pub(super) fn compile(name: &'static str, text: &str) -> Result<Self, SerialError> {
        Self::parse(text).map_err(|expected| SerialError::Setting {
            name,
            value: format!("{text:?}"),
            expected,
        })
    }

    fn parse(text: &str) -> Result<Self, &'static str> {
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some(next) = rest.chars().next() {
            let parse = if next == '{' { field } else { literal };
            let (piece, after) = parse(rest)?;
            pieces.push(piece);
            rest = after;
        }
        if pieces.windows(2).any(is_ambiguous) {
            return Err(
                "a pattern with text after every field without a width, to mark where the field ends",
            );
        }
        Ok(Self { pieces })
    }

    /// Compiles text without fields: a terminator, a request, a text in place of a value.
    pub(super) fn bytes(name: &'static str, text: &str) -> Result<Vec<u8>, SerialError> {
        match Self::compile(name, text)?.pieces.as_slice() {
            [] => Ok(Vec::new()),
            [Piece::Literal(bytes)] => Ok(bytes.clone()),
            _ => Err(SerialError::Setting {
                name,
                value: format!("{text:?}"),
                expected: "plain text without {fields}",
            }),
        }
    }

    /// The numbers of `{value}` and of `{code}` fields.
    pub(super) fn count_fields(&self) -> (usize, usize) {
        let pieces = || self.pieces.iter();
        let values = pieces().filter(|piece| matches!(piece, Piece::Value { .. }));
        let codes = pieces().filter(|piece| matches!(piece, Piece::Code));
        (values.count(), codes.count())
    }

    /// Width and number of decimals that `{value}` requires.
    fn value_size(&self) -> (Option<usize>, Option<usize>) {
        let mut sizes = self.pieces.iter().filter_map(|piece| match piece {
            Piece::Value { width, decimals } => Some((*width, *decimals)),
            _ => None,
        });
        sizes.next_back().unwrap_or_default()
    }

    /// The number of digits after the point that `{value}` requires.
    pub(super) fn decimals(&self) -> Option<usize> {
        self.value_size().1
    }

    /// The width that `{value}` requires.
    pub(super) fn width(&self) -> Option<usize> {
        self.value_size().0
    }

    /// The fields of `line` if it matches.
    pub(super) fn read<'a>(&self, line: &'a [u8]) -> Option<Fields<'a>> {
        let mut fields = Fields::default();
        let mut rest = line;
        for (index, piece) in self.pieces.iter().enumerate() {
            let length = piece.length_in(rest, self.pieces.get(index + 1))?;
            let (text, after) = rest.split_at_checked(length)?;
            match piece {
                Piece::Value { .. } => fields.value = Some(text),
                Piece::Code => fields.code = Some(text),
                Piece::Literal(_) | Piece::Skip => {}
            }
            rest = after;
        }
        rest.is_empty().then_some(fields)
    }

    /// The line with `value` and `code` in place of the fields. `None` if `value` does not have the required width.
    pub(super) fn write(&self, value: &str, code: i64) -> Option<Vec<u8>> {
        let mut line = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Literal(bytes) => line.extend(bytes),
                Piece::Value { width, .. } if width.is_some_and(|width| width != value.len()) => {
                    return None;
                }
                Piece::Value { .. } => line.extend(value.bytes()),
                Piece::Code => line.extend(code.to_string().bytes()),
                Piece::Skip => {}
            }
        }
        Some(line)
    }
}

/// Whether the first piece of a pair has no width and the second does not mark its end.
fn is_ambiguous(pair: &[Piece]) -> bool {
    matches!(pair, [first, second] if first.is_open() && !matches!(second, Piece::Literal(_)))
}

impl Piece {
    /// Whether the end of this piece depends on what follows.
    fn is_open(&self) -> bool {
        matches!(
            self,
            Self::Value { width: None, .. } | Self::Code | Self::Skip
        )
    }

    /// Number of bytes of `rest` that belong to this piece; `None` if it does not match.
    fn length_in(&self, rest: &[u8], next: Option<&Piece>) -> Option<usize> {
        match (self, next) {
            (Self::Literal(bytes), _) => rest.starts_with(bytes).then_some(bytes.len()),
            (
                Self::Value {
                    width: Some(width), ..
                },
                _,
            ) => Some(*width),
            (_, Some(Self::Literal(end))) => {
                rest.windows(end.len()).position(|window| window == end)
            }
            _ => Some(rest.len()),
        }
    }
}

/// Parses the field at the start of `text`; returns it and the rest.
fn field(text: &str) -> Result<(Piece, &str), &'static str> {
    let end = text.split_once('}');
    let (start, after) =
        end.ok_or("a pattern with a } for every {, or \\{ for the character itself")?;
    let piece = match &start[1..] {
        "value" => Piece::Value {
            width: None,
            decimals: None,
        },
        "code" => Piece::Code,
        "skip" => Piece::Skip,
        sized => sized_value(sized)?,
    };
    Ok((piece, after))
}

/// Parses `value:W` or `value:W.D`.
fn sized_value(field: &str) -> Result<Piece, &'static str> {
    let size = field.strip_prefix("value:");
    let size = size.ok_or("a pattern with the fields {value}, {value:W.D}, {code}, {skip}")?;
    value_of_size(size)
        .ok_or("a pattern with {value:W} or {value:W.D}, W from 1 to 20 and D below W")
}

fn value_of_size(size: &str) -> Option<Piece> {
    let (width, decimals) = match size.split_once('.') {
        None => (size.parse().ok()?, None),
        Some((width, decimals)) => (width.parse().ok()?, Some(decimals.parse().ok()?)),
    };
    let is_valid = (1..=20).contains(&width) && decimals.is_none_or(|decimals| decimals < width);
    is_valid.then_some(Piece::Value {
        width: Some(width),
        decimals,
    })
}

/// Parses plain text up to the next field; returns it and the rest.
fn literal(text: &str) -> Result<(Piece, &str), &'static str> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(next) = rest.chars().next().filter(|next| *next != '{') {
        let length = if next == '\\' {
            let (byte, length) = escape(rest)
                .ok_or("text with \\r, \\n, \\t, \\\\, \\{ or \\xNN after a backslash")?;
            bytes.push(byte);
            length
        } else {
            bytes.extend(next.to_string().bytes());
            next.len_utf8()
        };
        rest = &rest[length..]; // a boundary between characters
    }
    Ok((Piece::Literal(bytes), rest))
}

/// The byte of the escape at the start of `text`, and the length of the escape.
fn escape(text: &str) -> Option<(u8, usize)> {
    match text.as_bytes().get(1)? {
        b'r' => Some((b'\r', 2)),
        b'n' => Some((b'\n', 2)),
        b't' => Some((b'\t', 2)),
        b'\\' => Some((b'\\', 2)),
        b'{' => Some((b'{', 2)),
        b'x' => Some((u8::from_str_radix(text.get(2..4)?, 16).ok()?, 4)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(pattern: &str, line: &str) -> Option<Decimal> {
        let pattern = Pattern::compile("line", pattern).unwrap();
        Decimal::read(pattern.read(line.as_bytes())?.value?)
    }

    #[test]
    fn finds_fields_between_literals() {
        let number = |digits, decimals| Some(Decimal { digits, decimals });
        assert_eq!(value("{value}", "+01.2345"), number(12345, 4));
        assert_eq!(value("M1,{value:8.4}", "M1,-01.2345"), number(-12345, 4));
        assert_eq!(value("{skip}={value}mm", "distance= 3.5mm"), number(35, 1));
        assert_eq!(value("\\x02{value}\\x03", "\u{2}7\u{3}"), number(7, 0));
        assert_eq!(
            value("{value:3}{value:2}", "12345"),
            number(45, 0),
            "the last field counts"
        );
    }

    #[test]
    fn rejects_lines_that_do_not_match_completely() {
        let lines = [
            "",
            "M1,",
            "M1,+01.234",
            "M1,+01.23456",
            "M2,+01.2345",
            "M1,+01.2345 ",
            " M1,+01.2345",
            "M1,XXXXXXXX",
        ];
        for line in lines {
            assert_eq!(value("M1,{value:8}", line), None, "{line:?}");
        }
    }

    #[test]
    fn rejects_text_that_is_not_exactly_one_number() {
        let texts = [
            "",
            "+",
            "-",
            ".",
            "+.",
            "1.2.3",
            "1e3",
            "--1",
            "1-",
            "0x1",
            "1 ",
            "nan",
            "inf",
            "1234567890123456",
        ];
        for text in texts {
            assert_eq!(Decimal::read(text.as_bytes()), None, "{text:?}");
        }
        let numbers = [
            ("0.1", 0.1),
            (".5", 0.5),
            ("5.", 5.0),
            ("  -2.75", -2.75),
            ("+000123", 123.0),
        ];
        for (text, expected) in numbers {
            let number = Decimal::read(text.as_bytes()).map(Decimal::to_f64);
            assert_eq!(number, Some(expected), "{text:?}");
        }
    }

    #[test]
    fn rejects_invalid_patterns_with_the_reason() {
        let cases = [
            ("{value", "}"),
            ("{number}", "{skip}"),
            ("{value:0}", "1 to 20"),
            ("{value:4.4}", "below W"),
            ("{skip}{value}", "where the field ends"),
            ("\\q", "backslash"),
            ("\\x2", "xNN"),
            ("\\", "backslash"),
        ];
        for (pattern, reason) in cases {
            let error = Pattern::compile("line", pattern).unwrap_err().to_string();
            assert!(
                error.contains("line") && error.contains(reason),
                "{pattern}: {error}"
            );
        }
        assert!(Pattern::bytes("terminator", "{value}").is_err());
    }
}

//! A small language for the lines of probes that write their values.
//!
//! ```text
//! {value}       a decimal number: spaces, a sign or none, digits with one point or none; 15 digits at most
//! {value:8}     the same in exactly 8 characters
//! {value:8.4}   the same with exactly 4 digits after the point
//! {code}        a whole number
//! {skip}        any characters, none included, up to the first place where what follows it in the pattern stands
//! \r \n \t      carriage return, line feed, tabulator;   \xNN a byte;   \\ and \{ the characters themselves
//! anything else stands for itself
//! ```
//!
//! A pattern matches a whole line. Only the sized `{value}` may be followed by another hole directly. Give the size where
//! the probe has a fixed one: then a line that lost or gained a character is not taken for a value.

use super::error::SerialError;

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

/// What stood in the holes of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fields<'a> {
    pub value: Option<&'a [u8]>,
    pub code: Option<&'a [u8]>,
}

/// A number as written: `digits / 10^decimals`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decimal {
    pub digits: i64,
    pub decimals: i32,
}

impl Decimal {
    /// Digits and power of ten are exact in f64 (15 digits), so the quotient is the nearest f64 to what was written.
    pub(super) fn to_f64(self) -> f64 {
        self.digits as f64 / 10f64.powi(self.decimals)
    }

    /// Reads `text` as a whole; `None` if it is anything but one number.
    pub(super) fn read(text: &[u8]) -> Option<Self> {
        let spaces = text.iter().take_while(|byte| **byte == b' ').count();
        let text = &text[spaces..]; // no more of them than there are bytes
        let (negative, unsigned) = match text.split_first()? {
            (b'-', rest) => (true, rest),
            (b'+', rest) => (false, rest),
            _ => (false, text),
        };
        let mut parts = unsigned.splitn(2, |byte| *byte == b'.');
        let (whole, fraction) = (parts.next()?, parts.next().unwrap_or_default());
        let count = whole.len() + fraction.len();
        if !(1..=15).contains(&count) || !whole.iter().chain(fraction).all(u8::is_ascii_digit) {
            return None;
        }
        let digits = whole
            .iter()
            .chain(fraction)
            .fold(0, |sum, digit| 10 * sum + i64::from(digit - b'0'));
        Some(Self {
            digits: if negative { -digits } else { digits },
            decimals: fraction.len() as i32,
        })
    }
}

impl Pattern {
    /// Compiles `text`, the setting `name`.
    pub(super) fn compile(name: &'static str, text: &str) -> Result<Self, SerialError> {
        let refuse = |wants| SerialError::Setting {
            name,
            value: format!("{text:?}"),
            wants,
        };
        let mut pieces = Vec::new();
        let mut rest = text;
        while let Some(next) = rest.chars().next() {
            let (piece, after) = if next == '{' {
                hole(rest)
            } else {
                literal(rest)
            }
            .map_err(refuse)?;
            pieces.push(piece);
            rest = after;
        }
        if pieces
            .windows(2)
            .any(|pair| pair[0].is_open() && !matches!(pair[1], Piece::Literal(_)))
        {
            return Err(refuse(
                "a literal after every hole without a size, or nobody knows where the hole ends",
            ));
        }
        Ok(Self { pieces })
    }

    /// Compiles literal text only: a terminator, a word, a request.
    pub(super) fn bytes(name: &'static str, text: &str) -> Result<Vec<u8>, SerialError> {
        match Self::compile(name, text)?.pieces.as_slice() {
            [] => Ok(Vec::new()),
            [Piece::Literal(bytes)] => Ok(bytes.clone()),
            _ => Err(SerialError::Setting {
                name,
                value: format!("{text:?}"),
                wants: "plain text, without {holes}",
            }),
        }
    }

    /// How many `{value}` and how many `{code}` it has.
    pub(super) fn holes(&self) -> (usize, usize) {
        let count =
            |wanted: fn(&Piece) -> bool| self.pieces.iter().filter(|piece| wanted(piece)).count();
        (
            count(|piece| matches!(piece, Piece::Value { .. })),
            count(|piece| matches!(piece, Piece::Code)),
        )
    }

    /// The number of digits after the point that `{value}` asks for.
    pub(super) fn decimals(&self) -> Option<usize> {
        self.pieces.iter().find_map(|piece| {
            if let Piece::Value { decimals, .. } = piece {
                *decimals
            } else {
                None
            }
        })
    }

    /// The holes of `line`, if it matches.
    pub(super) fn read<'a>(&self, line: &'a [u8]) -> Option<Fields<'a>> {
        let mut fields = Fields::default();
        let mut rest = line;
        for (index, piece) in self.pieces.iter().enumerate() {
            let length = piece.extent(rest, self.pieces.get(index + 1))?;
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

    /// The line with its holes filled: the device's side. `None` if a text has not the size its hole asks for.
    pub(super) fn write(&self, value: &str, code: i64) -> Option<Vec<u8>> {
        let mut line = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Literal(bytes) => line.extend(bytes),
                Piece::Value {
                    width: Some(width), ..
                } if *width != value.len() => return None,
                Piece::Value { .. } => line.extend(value.bytes()),
                Piece::Code => line.extend(code.to_string().bytes()),
                Piece::Skip => {}
            }
        }
        Some(line)
    }

    /// The width that `{value}` asks for.
    pub(super) fn width(&self) -> Option<usize> {
        self.pieces.iter().find_map(|piece| {
            if let Piece::Value { width, .. } = piece {
                *width
            } else {
                None
            }
        })
    }
}

impl Piece {
    /// Whether only what follows says where it ends.
    fn is_open(&self) -> bool {
        matches!(
            self,
            Self::Value { width: None, .. } | Self::Code | Self::Skip
        )
    }

    /// Bytes of `rest` that belong to this piece.
    fn extent(&self, rest: &[u8], next: Option<&Piece>) -> Option<usize> {
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

/// Reads a hole at the start of `text`; returns it and what follows.
fn hole(text: &str) -> Result<(Piece, &str), &'static str> {
    let (inside, after) = text[1..]
        .split_once('}')
        .ok_or("a } for every {, or \\{ for the character itself")?;
    let piece = match inside.split_once(':') {
        None if inside == "value" => Piece::Value {
            width: None,
            decimals: None,
        },
        None if inside == "code" => Piece::Code,
        None if inside == "skip" => Piece::Skip,
        Some(("value", size)) => {
            sized(size).ok_or("{value:W} or {value:W.D} with W from 1 to 20 and D below W")?
        }
        _ => return Err("{value}, {value:W.D}, {code} or {skip}"),
    };
    Ok((piece, after))
}

fn sized(size: &str) -> Option<Piece> {
    let (width, decimals) = match size.split_once('.') {
        None => (size.parse().ok()?, None),
        Some((width, decimals)) => (width.parse().ok()?, Some(decimals.parse().ok()?)),
    };
    let fits = (1..=20).contains(&width) && decimals.is_none_or(|decimals| decimals < width);
    fits.then_some(Piece::Value {
        width: Some(width),
        decimals,
    })
}

/// Reads plain text up to the next hole; returns it and what follows.
fn literal(text: &str) -> Result<(Piece, &str), &'static str> {
    let mut bytes = Vec::new();
    let mut rest = text;
    while let Some(next) = rest.chars().next().filter(|next| *next != '{') {
        let taken = if next == '\\' {
            let (byte, taken) =
                escape(rest).ok_or("\\r, \\n, \\t, \\\\, \\{ or \\xNN after a backslash")?;
            bytes.push(byte);
            taken
        } else {
            bytes.extend(next.to_string().bytes());
            next.len_utf8()
        };
        rest = &rest[taken..]; // at a character's end: taken is the length of whole characters
    }
    Ok((Piece::Literal(bytes), rest))
}

/// The byte that an escape at the start of `text` stands for, and the escape's length.
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
    fn holes_are_found_between_literals() {
        let two = |digits, decimals| Some(Decimal { digits, decimals });
        assert_eq!(value("{value}", "+01.2345"), two(12345, 4));
        assert_eq!(value("M1,{value:8.4}", "M1,-01.2345"), two(-12345, 4));
        assert_eq!(value("{skip}={value}mm", "distance= 3.5mm"), two(35, 1));
        assert_eq!(value("\\x02{value}\\x03", "\u{2}7\u{3}"), two(7, 0));
        assert_eq!(
            value("{value:3}{value:2}", "12345"),
            two(45, 0),
            "the last one holds"
        );
    }

    #[test]
    fn what_does_not_match_as_a_whole_is_no_value() {
        for line in [
            "",
            "M1,",
            "M1,+01.234",
            "M1,+01.23456",
            "M2,+01.2345",
            "M1,+01.2345 ",
            " M1,+01.2345",
            "M1,XXXXXXXX",
        ] {
            assert_eq!(value("M1,{value:8}", line), None, "{line:?}");
        }
    }

    #[test]
    fn a_number_is_one_number_and_nothing_else() {
        for text in [
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
        ] {
            assert_eq!(Decimal::read(text.as_bytes()), None, "{text:?}");
        }
        for (text, expected) in [
            ("0.1", 0.1),
            (".5", 0.5),
            ("5.", 5.0),
            ("  -2.75", -2.75),
            ("+000123", 123.0),
        ] {
            assert_eq!(
                Decimal::read(text.as_bytes()).map(Decimal::to_f64),
                Some(expected),
                "{text:?}"
            );
        }
    }

    #[test]
    fn a_pattern_nobody_can_read_is_refused_with_the_reason() {
        for (pattern, word) in [
            ("{value", "}"),
            ("{number}", "{skip}"),
            ("{value:0}", "1 to 20"),
            ("{value:4.4}", "below W"),
            ("{skip}{value}", "where the hole ends"),
            ("\\q", "backslash"),
            ("\\x2", "xNN"),
            ("\\", "backslash"),
        ] {
            let error = Pattern::compile("line", pattern).unwrap_err().to_string();
            assert!(
                error.contains("line") && error.contains(word),
                "{pattern}: {error}"
            );
        }
        assert!(Pattern::bytes("terminator", "{value}").is_err());
    }
}

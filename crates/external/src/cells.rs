//! The cells of a line, and the numbers in them.

use std::borrow::Cow;

/// What separates the cells of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    Tab,
    Semicolon,
    Comma,
    /// Any number of spaces and tabs.
    Spaces,
}

/// How the cells of a line are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Format {
    pub separator: Separator,
    /// Whether numbers have a comma in place of the decimal point.
    pub decimal_comma: bool,
}

impl Format {
    /// All formats, the usual ones first.
    pub const ALL: [Format; 8] = [
        Format::new(Separator::Comma, false),
        Format::new(Separator::Tab, false),
        Format::new(Separator::Semicolon, false),
        Format::new(Separator::Spaces, false),
        Format::new(Separator::Tab, true),
        Format::new(Separator::Semicolon, true),
        Format::new(Separator::Spaces, true),
        // The numbers are in quotes.
        Format::new(Separator::Comma, true),
    ];

    const fn new(separator: Separator, decimal_comma: bool) -> Format {
        Format {
            separator,
            decimal_comma,
        }
    }

    /// The cells of a line without spaces around them.
    fn all_cells<'a>(&self, line: &'a str) -> Vec<Cow<'a, str>> {
        match self.separator {
            Separator::Tab => separated(line, b'\t'),
            Separator::Semicolon => separated(line, b';'),
            Separator::Comma => separated(line, b','),
            Separator::Spaces => line.split_whitespace().map(unquoted).collect(),
        }
    }

    /// The cells of a line. An empty one at the end, after a last separator, is none.
    pub fn cells<'a>(&self, line: &'a str) -> Vec<Cow<'a, str>> {
        let mut cells = self.all_cells(line);
        if cells.len() > 1 && cells.last().is_some_and(|last| last.is_empty()) {
            cells.pop();
        }
        cells
    }

    /// The cells of a line of a table with so many columns, the last of which may be empty.
    pub fn row<'a>(&self, line: &'a str, columns: usize) -> Vec<Cow<'a, str>> {
        let cells = self.all_cells(line);
        if cells.len() == columns {
            cells
        } else {
            self.cells(line)
        }
    }

    /// The number in a cell; not necessarily finite.
    pub fn number(&self, cell: &str) -> Option<f64> {
        if self.decimal_comma && cell.contains(',') {
            // A point beside the decimal comma may separate thousands: it is refused, not guessed. A second comma does not parse.
            if cell.contains('.') {
                return None;
            }
            return cell.replacen(',', ".", 1).parse().ok();
        }
        cell.parse().ok()
    }
}

fn separated(line: &str, separator: u8) -> Vec<Cow<'_, str>> {
    if !line.contains('"') {
        let cells = line.split(char::from(separator));
        return cells.map(|cell| Cow::Borrowed(cell.trim())).collect();
    }
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(separator)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    let mut record = csv::StringRecord::new();
    match reader.read_record(&mut record) {
        Ok(true) => record.iter().map(|cell| Cow::Owned(cell.into())).collect(),
        _ => Vec::new(),
    }
}

fn unquoted(cell: &str) -> Cow<'_, str> {
    let quoted = cell
        .strip_prefix('"')
        .and_then(|rest| rest.strip_suffix('"'));
    Cow::Borrowed(quoted.unwrap_or(cell))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_separator_within_quotes_separates_nothing() {
        let format = Format::new(Separator::Semicolon, true);
        assert_eq!(
            format.cells("\"time; s\"; 0,5 ;\"1,2\""),
            ["time; s", "0,5", "1,2"]
        );
    }

    #[test]
    fn a_last_separator_ends_the_line() {
        let format = Format::new(Separator::Comma, false);
        assert_eq!(format.cells("1,2,"), ["1", "2"]);
        assert_eq!(format.cells("1,,2"), ["1", "", "2"]);
    }

    #[test]
    fn numbers_have_a_point_or_a_comma() {
        let comma = Format::new(Separator::Semicolon, true);
        for (cell, number) in [
            ("0,5", Some(0.5)),
            ("-1,25e-3", Some(-1.25e-3)),
            ("3", Some(3.0)),
            ("0.5", Some(0.5)),
            ("1.000,5", None),
            ("1,2,3", None),
            ("off", None),
        ] {
            assert_eq!(comma.number(cell), number, "{cell}");
        }
        let point = Format::new(Separator::Semicolon, false);
        assert_eq!(
            (point.number("0,5"), point.number("0.5")),
            (None, Some(0.5))
        );
    }
}

//! Where the samples of a text begin, how its lines are written, and what its columns are called.
//!
//! ```text
//! Recorder 2, run 7              preamble, any lines
//! # rate 500 Hz                  comment: #, % or // at the beginning
//! time   force   position        names, in a line of their own or as the last comment
//! s      N       m               units, in a line of their own
//! 0.000  0.0     -2.5e-07        samples: the lines that most lines look like
//! Comment: stopped by hand       remarks behind the last sample
//! ```

use super::cells::Format;
use super::times::TimeUnit;

/// Lines from which the format is found.
const SAMPLED: usize = 40;
/// Beginnings of a comment.
const COMMENTS: [&str; 3] = ["#", "%", "//"];

/// The structure of a table of text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    pub format: Format,
    /// Names of the columns; their numbers from 1 in a file without names.
    pub names: Vec<String>,
    pub has_names: bool,
    /// Units of the columns; none in a file without a line of units.
    pub units: Vec<String>,
    /// Index of the first line of samples.
    pub first: usize,
    /// Index behind the last line of samples.
    pub end: usize,
}

/// Why a text has no layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum NoLayout {
    /// No lines of at least two cells of which two are numbers.
    NoColumns,
    /// A line directly before the samples that has another number of columns; both numbers, and the index of the first line
    /// of samples.
    OtherHeader {
        header: usize,
        columns: usize,
        first: usize,
        format: Format,
    },
}

/// A line without its comment mark; `None` for any other line.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    let mark = COMMENTS.iter().find(|mark| line.starts_with(**mark))?;
    Some(line[mark.len()..].trim_start_matches(['#', '%', '/']))
}

/// Whether a line has no samples.
pub(crate) fn is_skipped(line: &str) -> bool {
    line.trim().is_empty() || comment(line).is_some()
}

impl Layout {
    /// The layout of a text.
    pub fn of(lines: &[&str]) -> Result<Layout, NoLayout> {
        let pattern = Pattern::of(lines).ok_or(NoLayout::NoColumns)?;
        let first = lines.iter().position(|line| pattern.begins(line));
        let first = first.ok_or(NoLayout::NoColumns)?;
        let first = first + usize::from(pattern.is_numbering(&lines[first..]));
        let heading = Heading::of(&lines[..first], &pattern);
        if let Some(header) = heading.other_count {
            return Err(NoLayout::OtherHeader {
                header,
                columns: pattern.columns,
                first,
                format: pattern.format,
            });
        }
        let end = pattern.end(lines);
        let numbers = (1..=pattern.columns).map(|number| number.to_string());
        Ok(Layout {
            end,
            format: pattern.format,
            has_names: heading.names.is_some(),
            names: heading.names.unwrap_or_else(|| numbers.collect()),
            units: heading.units,
            first,
        })
    }
}

/// What most lines of samples look like.
struct Pattern {
    format: Format,
    columns: usize,
    /// Which columns are numbers, or times.
    numeric: Vec<bool>,
}

impl Pattern {
    /// The format in which the most cells are numbers, over the lines at the end: a preamble is at the beginning.
    fn of(lines: &[&str]) -> Option<Pattern> {
        let used = lines.iter().rev().filter(|line| !is_skipped(line));
        let sampled: Vec<&str> = used.take(SAMPLED).copied().collect();
        let patterns = Format::ALL
            .iter()
            .filter_map(|format| Pattern::in_format(*format, &sampled));
        let mut best: Option<(f64, Pattern)> = None;
        for (score, pattern) in patterns {
            // Of equal ones the first, which is the more usual one.
            if best.as_ref().is_none_or(|(other, _)| score > *other) {
                best = Some((score, pattern));
            }
        }
        best.map(|(_, pattern)| pattern)
    }

    /// The pattern of lines in a format, with the number of cells that are numbers, times their share.
    fn in_format(format: Format, lines: &[&str]) -> Option<(f64, Pattern)> {
        let rows: Vec<Vec<bool>> = lines
            .iter()
            .map(|line| numeric_cells(format, line))
            .collect();
        let columns = most_frequent(rows.iter().map(Vec::len))?;
        let alike: Vec<&Vec<bool>> = rows.iter().filter(|row| row.len() == columns).collect();
        let numeric: Vec<bool> = (0..columns)
            .map(|k| 2 * alike.iter().filter(|row| row[k]).count() >= alike.len())
            .collect();
        let numbers = numeric.iter().filter(|is_number| **is_number).count();
        let share = numbers as f64 / columns as f64;
        let score = alike.len() as f64 * numbers as f64 * share;
        (numbers >= 2).then_some((
            score,
            Pattern {
                format,
                columns,
                numeric,
            },
        ))
    }

    /// Whether the samples begin with this line: it has as many columns, and a number where the others have one; a line with a
    /// single such number is a damaged line of samples.
    fn begins(&self, line: &str) -> bool {
        if is_skipped(line) {
            return false;
        }
        let numeric = numeric_cells(self.format, line);
        let numbers = numeric.iter().filter(|is_number| **is_number).count();
        let expected = self.numeric.iter().filter(|is_number| **is_number).count();
        numeric.len() == self.columns && 2 * numbers >= expected && numbers >= 1
    }
}

/// Fewest columns whose numbers are a heading: two numbers may well be a sample.
const NUMBERED_COLUMNS: usize = 3;
/// A first number that is as far from the second as the second from the third, apart from this part of the distance, is a time.
const EQUAL_DISTANCE: f64 = 0.01;

impl Pattern {
    /// Whether the first of some lines has the numbers of the columns in place of names: 0, 1, 2 or 1, 2, 3, where the lines below have
    /// decimals, and do not continue it as the times of samples do.
    fn is_numbering(&self, lines: &[&str]) -> bool {
        let rows = lines.iter().filter(|line| !is_skipped(line)).take(3);
        let rows: Vec<Vec<f64>> = rows.map(|line| self.numbers(line)).collect();
        let [heading, second, third] = rows.as_slice() else {
            return false;
        };
        let has_all = rows.iter().all(|row| row.len() == self.columns);
        if !has_all || self.columns < NUMBERED_COLUMNS {
            return false;
        }
        let counts_from = |start: usize| (start..).zip(heading).all(|(k, cell)| *cell == k as f64);
        let has_decimals = |row: &Vec<f64>| row.iter().any(|cell| cell.fract() != 0.0);
        let continues = (0..self.columns).any(|k| {
            let step = third[k] - second[k];
            step != 0.0 && (second[k] - heading[k] - step).abs() < EQUAL_DISTANCE * step.abs()
        });
        (counts_from(0) || counts_from(1))
            && has_decimals(second)
            && has_decimals(third)
            && !continues
    }

    fn numbers(&self, line: &str) -> Vec<f64> {
        let cells = self.format.row(line, self.columns);
        cells
            .iter()
            .filter_map(|cell| self.format.number(cell))
            .collect()
    }

    /// The index behind the last line that is no remark: remarks begin with a letter, and have another number of cells than a sample.
    fn end(&self, lines: &[&str]) -> usize {
        let is_remark = |line: &str| {
            let cells = self.format.cells(line);
            let first = cells.first().map_or("", |cell| cell.as_ref());
            let is_word = first.starts_with(char::is_alphabetic) && !self.is_numeric(first);
            is_skipped(line) || is_word && cells.len() != self.columns
        };
        let last = lines.iter().rposition(|line| !is_remark(line));
        last.map_or(0, |last| last + 1)
    }

    fn is_numeric(&self, cell: &str) -> bool {
        self.format.number(cell).is_some()
    }
}

/// Which cells of a line are numbers or stamps of time.
fn numeric_cells(format: Format, line: &str) -> Vec<bool> {
    let cells = format.cells(line);
    let is_numeric = |cell: &str| format.number(cell).is_some() || super::stamp::is_stamp(cell);
    cells.iter().map(|cell| is_numeric(cell)).collect()
}

fn most_frequent(counts: impl Iterator<Item = usize>) -> Option<usize> {
    let counts: Vec<usize> = counts.collect();
    let times = |count: usize| counts.iter().filter(|other| **other == count).count();
    counts
        .iter()
        .copied()
        .max_by_key(|count| (times(*count), *count))
}

/// What stands before the samples.
#[derive(Default)]
struct Heading {
    names: Option<Vec<String>>,
    units: Vec<String>,
    /// The number of columns of a line directly before the samples that has another one.
    other_count: Option<usize>,
}

impl Heading {
    fn of(before: &[&str], pattern: &Pattern) -> Heading {
        let cells = |line: &str| -> Vec<String> {
            let cells = pattern.format.cells(line);
            cells.iter().map(|cell| printable(cell)).collect()
        };
        let plain = before.iter().rev().filter(|line| !is_skipped(line));
        let mut plain = plain.map(|line| cells(line)).peekable();
        let fits = |row: &Vec<String>| row.len() == pattern.columns;
        match plain.next() {
            Some(last) if fits(&last) => {
                let above: Vec<Vec<String>> = plain.take_while(fits).take(2).collect();
                Heading::of_lines(last, above)
            }
            Some(last) if last.len() > 1 => Heading {
                other_count: Some(last.len()),
                ..Heading::default()
            },
            _ => {
                let last_comment = before.iter().rev().find_map(|line| comment(line));
                Heading {
                    names: last_comment.map(cells).filter(fits),
                    ..Heading::default()
                }
            }
        }
    }
}

impl Heading {
    /// The heading by the line directly before the samples and the lines above it, the lowest first: names, then units, then further
    /// descriptions.
    fn of_lines(last: Vec<String>, above: Vec<Vec<String>>) -> Heading {
        let mut lines = std::iter::once(last.clone()).chain(above);
        let units = lines.by_ref().find(|line| are_units(line));
        match (units, lines.next()) {
            (Some(units), Some(names)) => Heading {
                names: Some(names),
                units,
                other_count: None,
            },
            _ => Heading {
                names: Some(last),
                ..Heading::default()
            },
        }
    }
}

/// Whether the cells are units: most of them known ones, or in brackets.
fn are_units(cells: &[String]) -> bool {
    const KNOWN: [&str; 59] = [
        "s", "sec", "ms", "us", "µs", "ns", "min", "n", "mn", "kn", "a", "ma", "v", "mv", "m",
        "mm", "um", "µm", "nm", "m/s", "mm/s", "m/s2", "m/s^2", "m/s²", "g", "deg", "rad", "°",
        "hz", "rad/s", "db", "m/a", "um/a", "mm/a", "%", "-", "1", "none", "pa", "bar", "counts",
        "volt", "volts", "ampere", "amperes", "amp", "amps", "newton", "newtons", "meter",
        "meters", "metre", "metres", "micron", "microns", "inch", "degree", "degrees", "hertz",
    ];
    let is_unit = |cell: &String| {
        let bare = cell.trim_matches(['[', ']', '(', ')', '<', '>', ' ']);
        let is_known = KNOWN.contains(&bare.to_lowercase().as_str());
        bare.len() < cell.len() || bare.is_empty() || is_known || TimeUnit::is_one(bare)
    };
    2 * cells.iter().filter(|cell| is_unit(cell)).count() > cells.len()
}

/// A name that can be printed: control characters could change the terminal.
fn printable(name: &str) -> String {
    let characters = name.chars();
    let printable = characters.map(|c| if c.is_control() { '\u{fffd}' } else { c });
    printable.collect()
}

#[cfg(test)]
mod tests {
    use super::super::cells::Separator;
    use super::*;

    const ROWS: &str = "0,1,2\n0.5,1.5,2.5\n1,-1,1e-3\n1.5,0,4\n";

    fn layout(text: &str) -> Result<Layout, NoLayout> {
        Layout::of(&text.lines().collect::<Vec<_>>())
    }

    fn names(text: &str) -> Vec<String> {
        layout(text).expect("a layout").names
    }

    #[test]
    fn names_stand_before_the_samples_whatever_precedes_them() {
        for heading in [
            "t,u,y\n",
            "Recorder 2\nrun 7\n\nt,u,y\n",
            "# Recorder 2, run 7\n# rate 500 Hz\nt,u,y\n",
            "% t,u,y\n",
            "// made by hand\n# t,u,y\n",
            "t,u,y,\n",
            "\"t\",\"u\",\"y\"\n",
        ] {
            assert_eq!(
                names(&format!("{heading}{ROWS}")),
                ["t", "u", "y"],
                "{heading}"
            );
        }
    }

    #[test]
    fn a_line_of_units_follows_the_names() {
        for units in ["s,N,m", "[s],[N],[m]", "(ms),(),(um)"] {
            let found = layout(&format!("t,u,y\n{units}\n{ROWS}")).expect("a layout");
            assert_eq!(found.names, ["t", "u", "y"], "{units}");
            assert_eq!(found.units.join(","), units);
            assert_eq!(found.first, 2);
        }
    }

    #[test]
    fn numbers_of_the_columns_are_names_and_a_first_sample_is_none() {
        for (text, names, first) in [
            ("0,1,2\n0.0,0.1,0.2\n0.5,0.3,0.4\n1.0,0.5,0.1\n", "0,1,2", 1),
            ("1,2,3\n0.0,0.1,0.2\n0.5,0.3,0.4\n1.0,0.5,0.1\n", "1,2,3", 1),
            // Times go on from 0; integers may be samples; two columns; other numbers.
            ("0,1,2\n0.5,0.1,0.2\n1.0,0.3,0.4\n1.5,0.5,0.1\n", "1,2,3", 0),
            ("1,2,3\n5,0,1\n9,1,0\n11,3,2\n", "1,2,3", 0),
            ("0,1\n0.0,0.1\n0.5,0.3\n1.0,0.5\n", "1,2", 0),
            ("0,2,3\n0.0,0.1,0.2\n0.5,0.3,0.4\n1.0,0.5,0.1\n", "1,2,3", 0),
        ] {
            let found = layout(text).expect("a layout");
            assert_eq!(
                (found.names.join(",").as_str(), found.first),
                (names, first),
                "{text}"
            );
        }
    }

    #[test]
    fn remarks_behind_the_last_sample_are_no_samples_and_others_stay() {
        for (behind, end) in [
            ("", 5),
            ("Comment: stopped by hand\n", 5),
            ("\n# end\nEnd of record\nOperator: A, B\n\n", 5),
            // Damaged samples.
            ("off,off,off\n", 6),
            ("2.0,1\n", 6),
            ("nan,1\n", 6),
            ("Pause\n2,1,2\nComment: end\n", 7),
        ] {
            let found = layout(&format!("t,u,y\n{ROWS}{behind}")).expect("a layout");
            assert_eq!((found.first, found.end), (1, end), "{behind}");
        }
    }

    #[test]
    fn columns_without_names_have_their_numbers() {
        let found = layout(ROWS).expect("a layout");
        assert!(!found.has_names && found.first == 0);
        assert_eq!(found.names, ["1", "2", "3"]);
    }

    #[test]
    fn finds_separator_and_decimal_point_by_the_samples() {
        let with = |separator: &str, point: &str| {
            let rows = ROWS.replace(',', "|").replace('.', point);
            format!("\"a, b\"|\"c; d\"|e\n{rows}").replace('|', separator)
        };
        for (separator, point, expected) in [
            (",", ".", Separator::Comma),
            (";", ".", Separator::Semicolon),
            (";", ",", Separator::Semicolon),
            ("\t", ".", Separator::Tab),
            ("\t", ",", Separator::Tab),
        ] {
            let found = layout(&with(separator, point)).expect("a layout");
            assert_eq!(found.format.separator, expected, "{separator}{point}");
            assert_eq!(
                found.format.decimal_comma,
                point == ",",
                "{separator}{point}"
            );
            assert_eq!(found.names, ["a, b", "c; d", "e"]);
        }
        for separator in [" ", "   "] {
            let text = format!("t,u,y\n{ROWS}").replace(',', separator);
            let found = layout(&text).expect("a layout");
            assert_eq!(found.format.separator, Separator::Spaces);
            assert_eq!(found.names, ["t", "u", "y"]);
        }
    }

    #[test]
    fn semicolons_separate_names_that_have_commas() {
        let text = format!(
            "Time [s, rel.];Force [N, meas.];Pos [m, probe 1]\n{}",
            ROWS.replace(',', ";")
        );
        assert_eq!(
            names(&text),
            ["Time [s, rel.]", "Force [N, meas.]", "Pos [m, probe 1]"]
        );
    }

    #[test]
    fn a_column_of_text_does_not_hide_the_numbers() {
        let text = "t,state,u,y\n0,on,1,2\n1,off,2,3\n2,on,3,4\n";
        assert_eq!(names(text), ["t", "state", "u", "y"]);
        assert_eq!(layout(text).expect("a layout").first, 1);
    }

    #[test]
    fn a_damaged_first_sample_is_no_heading() {
        let found = layout("t,u,y\n0,1,off\n1,2,3\n2,3,4\n3,4,5\n").expect("a layout");
        assert_eq!((found.first, found.names.join(",")), (1, "t,u,y".into()));
    }

    #[test]
    fn names_of_another_number_are_refused() {
        let NoLayout::OtherHeader {
            header,
            columns,
            first,
            ..
        } = layout("t,u,y\n0,5,1,0,2,0\n0,6,1,1,2,1\n0,7,1,2,2,2\n").expect_err("other columns")
        else {
            panic!("no columns");
        };
        assert_eq!((header, columns, first), (3, 6, 1));
    }

    #[test]
    fn text_without_numbers_has_no_columns() {
        for text in ["", "t,u,y\n", "a letter\nto a friend\n", "1\n2\n3\n"] {
            assert_eq!(layout(text), Err(NoLayout::NoColumns), "{text}");
        }
    }

    #[test]
    fn names_cannot_change_the_terminal() {
        assert_eq!(
            names(&format!("t,\u{1b}[31mu,y\n{ROWS}"))[1],
            "\u{fffd}[31mu"
        );
    }
}

//! Text for a terminal: tables, wrapped sentences, labelled lines, at most 80 columns wide.

use bench_report::figures::Figure;
use bench_report::table::Table;

/// Largest width of a line, in columns.
const WIDTH: usize = 80;
/// The gap between two columns of a table.
const GAP: &str = "  ";
/// Width of the label of a labelled line.
const LABEL: usize = 13;
/// Width of the name of a figure.
const NAME: usize = 23;

/// Rows of cells, right-aligned below a header. A table wider than 80 columns is split into several ones below each
/// other, each with the first column of the whole.
pub(super) fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let header: Vec<String> = header.iter().map(|cell| cell.to_string()).collect();
    let lines: Vec<&Vec<String>> = std::iter::once(&header).chain(rows).collect();
    let widths: Vec<usize> = (0..header.len())
        .map(|column| width(&lines, column))
        .collect();
    let parts = split(&widths);
    let parts: Vec<String> = parts
        .iter()
        .map(|columns| part(&lines, &widths, columns))
        .collect();
    parts.join("\n")
}

/// A table of a result.
pub(super) fn result_table(result: &Table) -> String {
    let columns: Vec<String> = result.columns.iter().map(|name| terminal(name)).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let rows = result.rows.iter();
    let rows: Vec<Vec<String>> = rows
        .map(|row| row.iter().map(|cell| terminal(cell)).collect())
        .collect();
    table(&columns, &rows)
}

/// Figures as lines `  Phase margin           31.50 deg at 46.00 Hz`.
pub(super) fn figure_lines(figures: &[Figure]) -> String {
    let lines = figures.iter().map(|figure| {
        let text = terminal(&figure.text());
        format!("  {:<NAME$}{text}\n", figure.name)
    });
    lines.collect()
}

/// Figures as one sentence: `overshoot 3.1 %, RMS of the error 0.0021 um`.
pub(super) fn figure_sentence(figures: &[Figure]) -> String {
    let texts: Vec<String> = figures
        .iter()
        .map(|figure| {
            format!(
                "{} {}",
                uncapitalised(&figure.name),
                terminal(&figure.text())
            )
        })
        .collect();
    texts.join(", ")
}

/// Text of a page for a terminal, which may lack the typographic minus sign and the Greek letter.
pub(super) fn terminal(text: &str) -> String {
    text.replace(['\u{2212}', '–'], "-").replace('µ', "u")
}

/// `Overshoot` as `overshoot`; an abbreviation such as `RMS` stays.
fn uncapitalised(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next();
    let rest = letters.as_str();
    match first {
        Some(first) if !rest.starts_with(char::is_uppercase) => {
            first.to_lowercase().chain(rest.chars()).collect()
        }
        _ => name.into(),
    }
}

fn width(lines: &[&Vec<String>], column: usize) -> usize {
    let cells = lines.iter().filter_map(|line| line.get(column));
    cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
}

/// The columns of each part, the first one in all of them.
fn split(widths: &[usize]) -> Vec<Vec<usize>> {
    let first = widths.first().copied().unwrap_or(0);
    let mut parts = vec![vec![0]];
    let mut taken = first;
    for (column, width) in widths.iter().enumerate().skip(1) {
        let needed = GAP.len() + width;
        let is_full = taken + needed > WIDTH && parts.last().is_some_and(|part| part.len() > 1);
        if is_full {
            parts.push(vec![0]);
            taken = first;
        }
        taken += needed;
        parts
            .iter_mut()
            .last()
            .into_iter()
            .for_each(|part| part.push(column));
    }
    parts
}

fn part(lines: &[&Vec<String>], widths: &[usize], columns: &[usize]) -> String {
    let lines = lines.iter().map(|line| row(line, widths, columns));
    lines.collect()
}

fn row(line: &[String], widths: &[usize], columns: &[usize]) -> String {
    let padded = columns.iter().filter_map(|&column| {
        let width = widths[column];
        line.get(column).map(|cell| format!("{cell:>width$}"))
    });
    padded.collect::<Vec<_>>().join(GAP) + "\n"
}

/// Text in lines of at most 80 columns, each indented by `indent`. A word longer than a line has its own line.
pub(super) fn wrap(text: &str, indent: usize) -> String {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= WIDTH => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(format!("{:indent$}{word}", "")),
        }
    }
    lines.iter().map(|line| line.clone() + "\n").collect()
}

/// A line `  label      text`, wrapped below its text.
pub(super) fn labelled(label: &str, text: &str) -> String {
    let wrapped = wrap(text, LABEL);
    let label = format!("  {label}");
    let text = wrapped.get(LABEL..).unwrap_or("\n");
    format!("{label:<LABEL$}{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn widest(text: &str) -> usize {
        text.lines()
            .map(|line| line.chars().count())
            .max()
            .unwrap_or(0)
    }

    #[test]
    fn figures_have_the_signs_of_a_terminal() {
        let figures = [
            Figure::new("RMS of the error", -0.25, "µm", 2),
            Figure::new("Gain margin", None::<f64>, "dB", 2),
        ];
        assert_eq!(
            figure_lines(&figures),
            "  RMS of the error       -0.25 um\n  Gain margin            none\n"
        );
        assert_eq!(
            figure_sentence(&figures),
            "RMS of the error -0.25 um, gain margin none"
        );
    }

    #[test]
    fn aligns_cells_to_the_right() {
        let rows = [
            vec!["1".to_string(), "22".to_string()],
            vec!["333".into(), "4".into()],
        ];
        assert_eq!(table(&["a", "b"], &rows), "  a   b\n  1  22\n333   4\n");
    }

    #[test]
    fn splits_a_table_wider_than_80_columns_and_repeats_the_first_column() {
        let header: Vec<String> = (0..12).map(|k| format!("column {k:02}")).collect();
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let rows = [(0..12).map(|k| k.to_string()).collect::<Vec<_>>()];
        let text = table(&header, &rows);
        assert!(widest(&text) <= 80, "{text}");
        assert_eq!(text.matches("column 00").count(), 2, "{text}");
        assert!(header.iter().all(|name| text.contains(name)), "{text}");
    }

    #[test]
    fn wraps_at_80_columns_and_keeps_every_word() {
        let text = "word ".repeat(60);
        let wrapped = labelled("recording", &text);
        assert!(widest(&wrapped) <= 80 && wrapped.starts_with("  recording  word word"));
        assert_eq!(wrapped.matches("word").count(), 60);
        let path = "/a".repeat(60);
        assert_eq!(
            labelled("recording", &path),
            format!("  recording  {path}\n")
        );
        assert_eq!(labelled("none", ""), "  none       \n");
    }
}

//! A table of text: the one form in which a result reaches the terminal and the pages.

use crate::html::{escaped, table};

/// How much room a table has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// A page has room for all columns.
    Page,
    /// A terminal has room for 80 characters, so that columns of less importance are left out.
    Terminal,
}

impl Width {
    /// A head or a cell that only a page has room for.
    pub(crate) fn page_only<T>(self, cell: T) -> Option<T> {
        match self {
            Width::Page => Some(cell),
            Width::Terminal => None,
        }
    }
}

/// Columns with their rows. Each row has a cell for each column.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<'a>(columns: impl IntoIterator<Item = &'a str>) -> Table {
        Table {
            columns: columns.into_iter().map(String::from).collect(),
            rows: Vec::new(),
        }
    }

    /// The table with these rows in addition.
    pub fn with_rows(mut self, rows: impl IntoIterator<Item = Vec<String>>) -> Table {
        self.rows.extend(rows);
        self
    }

    /// Whether there is nothing to show.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The first rows.
    pub fn first(mut self, count: usize) -> Table {
        self.rows.truncate(count);
        self
    }

    /// The table as HTML.
    pub fn html(&self) -> String {
        let columns: Vec<&str> = self.columns.iter().map(String::as_str).collect();
        let rows: String = self.rows.iter().map(|cells| row_html(cells)).collect();
        table(&columns, &rows)
    }
}

fn row_html(cells: &[String]) -> String {
    let cells: String = cells
        .iter()
        .map(|cell| format!("<td class=\"n\">{}</td>", escaped(cell)))
        .collect();
    format!("<tr>{cells}</tr>\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn html_has_every_cell_escaped() {
        let table = Table::new(["|S| <"]).with_rows([vec!["−1 & 2".to_string()]]);
        let html = table.html();
        assert!(html.contains("<th>|S| &lt;</th>"), "{html}");
        assert!(html.contains("<td class=\"n\">−1 &amp; 2</td>"), "{html}");
    }
}

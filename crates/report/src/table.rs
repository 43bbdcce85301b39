//! A table of text: the one form in which a result reaches the terminal and the pages.

use crate::html::{escaped, table};

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
    pub fn new<const N: usize>(columns: [&str; N]) -> Table {
        Table {
            columns: columns.map(String::from).to_vec(),
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

    /// The table without a column.
    pub fn without(mut self, column: &str) -> Table {
        if let Some(index) = self.columns.iter().position(|name| name == column) {
            self.columns.remove(index);
            self.rows.iter_mut().for_each(|row| {
                row.remove(index);
            });
        }
        self
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
    fn a_column_is_left_out_of_head_and_rows() {
        let row = ["1", "2", "3"].map(String::from).to_vec();
        let table = Table::new(["a", "b", "c"]).with_rows([row]).without("b");
        assert_eq!(table.columns, ["a", "c"]);
        assert_eq!(table.rows, [["1", "3"]]);
        assert_eq!(table.clone().without("unknown"), table);
    }

    #[test]
    fn html_has_every_cell_escaped() {
        let table = Table::new(["|S| <"]).with_rows([vec!["−1 & 2".to_string()]]);
        let html = table.html();
        assert!(html.contains("<th>|S| &lt;</th>"), "{html}");
        assert!(html.contains("<td class=\"n\">−1 &amp; 2</td>"), "{html}");
    }
}

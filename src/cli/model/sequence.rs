//! `bench model sequence`: signs, dominant modes, and what the tables of Chapter 3 read from them.

use serde::Serialize;

use super::super::error::CliError;
use super::super::options::BenchOptions;
use super::super::output::{print_json, print_text};
use crate::config::Purpose;
use crate::model::plant::{self, ModalModel};
use crate::model::zeros::{self, ModalSum, Sequence, ZeroCounts};

#[derive(Debug, Serialize)]
struct Report {
    profile: String,
    sign_sequence: String,
    dominant_sequence: String,
    /// The row of Tables 3-1 to 3-4 with these signs and this sequence; absent for other numbers of modes or where no row
    /// has the sequence.
    table: Option<RowJson>,
    /// The kinds of the zeros of the modes that show.
    computed: String,
    agree: Option<bool>,
}

#[derive(Debug, Serialize)]
struct RowJson {
    table: &'static str,
    row: usize,
    printed: &'static str,
    kinds: Vec<String>,
}

pub(super) fn run(options: &BenchOptions) -> Result<(), CliError> {
    let config = options.load(Purpose::Model, &[])?;
    let modal = ModalModel::of(&plant::build(&config.plant)?)?;
    let report = report(options.profile(), &modal)?;
    if options.json {
        print_json(&report)
    } else {
        print_text(&text(&report))
    }
}

fn report(profile: &str, modal: &ModalModel) -> Result<Report, CliError> {
    let sum = ModalSum::visible(modal)?;
    let sequence = Sequence::of(&sum)?;
    let row = zeros::table_of(&sum).and_then(|table| table.row(&sum, &sequence));
    let computed = ZeroCounts::of(&sum.undamped_zeros()?);
    Ok(Report {
        profile: profile.into(),
        sign_sequence: zeros::sign_sequence(modal),
        dominant_sequence: sequence.to_string(),
        table: row.map(|row| RowJson {
            table: row.table,
            row: row.number,
            printed: row.printed,
            kinds: row.kinds.iter().map(ZeroCounts::to_string).collect(),
        }),
        computed: computed.to_string(),
        agree: row.map(|row| row.kinds.contains(&computed)),
    })
}

fn text(report: &Report) -> String {
    let read = match &report.table {
        Some(row) => format!(
            "{} (Table {}, row {}: {})",
            row.kinds.join(" or "),
            row.table,
            row.row,
            row.printed
        ),
        None => "no row of Tables 3-1 to 3-4 has this sequence".into(),
    };
    let verdict = match report.agree {
        Some(true) => "   as the table says",
        Some(false) => "   NOT as the table says",
        None => "",
    };
    format!(
        "{}\n  signs           {}\n  dominant modes  {}\n  zeros foretold  {read}\n  zeros computed  {}{verdict}\n",
        report.profile, report.sign_sequence, report.dominant_sequence, report.computed,
    )
}

//! `bench model sequence`: signs, dominant modes, and the kinds of zeros that the tables of Chapter 3 read from them.

use super::super::error::CliError;
use super::super::output::print_result;
use super::Profiled;
use bench_config::Purpose;
use bench_order::BenchOptions;
use bench_plant::zeros::ZeroCounts;
use bench_plant::{ModalModel, build};
use bench_thesis::{SequenceReport, TableRow};

pub(super) fn run(options: &BenchOptions) -> Result<(), CliError> {
    let config = options.load(Purpose::Model, &[])?;
    let report = SequenceReport::of(&ModalModel::of(&build(&config.plant)?)?)?;
    let profile = options.profile();
    let report = Profiled { profile, report };
    print_result(options.json, &report, |profiled| {
        text(profile, &profiled.report)
    })
}

fn text(profile: &str, report: &SequenceReport) -> String {
    let read = report.table.map_or(
        "no row of Tables 3-1 to 3-4 has this sequence".into(),
        row_text,
    );
    let agreement = match report.agree {
        Some(true) => " (agrees)",
        Some(false) => " (DISAGREES)",
        None => "",
    };
    format!(
        "{profile}\n  signs            {}\n  dominant modes   {}\n  zeros predicted  {read}\n  zeros computed   {}{agreement}\n",
        report.sign_sequence, report.dominant_sequence, report.computed,
    )
}

fn row_text(row: &TableRow) -> String {
    let kinds: Vec<String> = row.kinds.iter().map(ZeroCounts::to_string).collect();
    let (table, number, printed) = (row.table, row.number, row.printed);
    format!(
        "{} (Table {table}, row {number}: {printed})",
        kinds.join(" or ")
    )
}

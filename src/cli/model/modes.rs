//! `bench model modes`: modes, residues, signs and zeros at one operating point.

use super::super::error::CliError;
use super::super::output::print_result;
use super::super::table::table;
use super::Profiled;
use bench_base::decimal::Decimal;
use bench_config::Purpose;
use bench_order::BenchOptions;
use bench_plant::zeros::Zero;
use bench_thesis::{ModeSummary, PlantSummary};

pub(super) fn run(options: &BenchOptions) -> Result<(), CliError> {
    let config = options.load(Purpose::Model, &[])?;
    let report = PlantSummary::of(&config.plant)?;
    let profile = options.profile();
    let report = Profiled { profile, report };
    print_result(options.json, &report, |profiled| {
        text(profile, &profiled.report)
    })
}

fn text(profile: &str, plant: &PlantSummary) -> String {
    let tables = [modes_table(&plant.modes), shapes_table(plant)].join("\n");
    let (zeros, damped) = (zeros_table(&plant.zeros), zeros_table(&plant.damped_zeros));
    format!(
        "{}\n\n{tables}\nzeros without damping\n{zeros}\nzeros with damping\n{damped}\nsigns           {}\ndominant modes  {}\nCNMP pairs      {} ({} with damping)\nphase drop      {} deg\n{}",
        title(profile, plant),
        plant.sign_sequence,
        plant.dominant_sequence,
        plant.cnmp_pairs,
        plant.damped_cnmp_pairs,
        plant.phase_drop_deg,
        bound_text(plant),
    )
}

fn title(profile: &str, plant: &PlantSummary) -> String {
    let point = plant
        .operating_point_m
        .map(|m| format!("at Y1o = {:.4} mm", Decimal(m * 1e3)));
    let asymmetry = plant
        .mass_asymmetry
        .map(|ratio| format!("mass asymmetry {:+.2} %", Decimal(ratio * 100.0)));
    let details: Vec<String> = point.into_iter().chain(asymmetry).collect();
    format!("{profile} {}", details.join(", "))
        .trim_end()
        .into()
}

fn modes_table(modes: &[ModeSummary]) -> String {
    let rows: Vec<Vec<String>> = modes.iter().enumerate().map(mode_row).collect();
    let header = ["mode", "rad/s", "Hz", "damping", "residue 1/kg", "sign"];
    table(&header, &rows)
}

fn mode_row((index, mode): (usize, &ModeSummary)) -> Vec<String> {
    vec![
        (index + 1).to_string(),
        format!("{:.3}", mode.omega_rad_s),
        format!("{:.4}", mode.frequency_hz),
        format!("{:.5}", mode.damping_ratio),
        format!("{:+.6}", Decimal(mode.residue)),
        mode.sign.symbol().to_string(),
    ]
}

/// A row for each mode, a column for each coordinate.
fn shapes_table(plant: &PlantSummary) -> String {
    let mut header = vec!["shape"];
    header.extend(plant.coordinates.iter().map(String::as_str));
    let rows: Vec<Vec<String>> = plant
        .modes
        .iter()
        .enumerate()
        .map(|(index, mode)| {
            let mut row = vec![(index + 1).to_string()];
            row.extend(mode.shape.iter().map(|x| format!("{:+.4}", Decimal(*x))));
            row
        })
        .collect();
    table(&header, &rows)
}

fn zeros_table(zeros: &[Zero]) -> String {
    let rows: Vec<Vec<String>> = zeros
        .iter()
        .map(|zero| {
            let (re, im) = (Decimal(zero.s.re), Decimal(zero.s.im));
            vec![
                format!("{re:+.4}"),
                format!("{im:+.4}"),
                zero.kind.name().into(),
            ]
        })
        .collect();
    table(&["re rad/s", "im rad/s", "kind"], &rows)
}

/// The narrowest of the bounds.
fn bound_text(plant: &PlantSummary) -> String {
    let (alpha, peak) = (PlantSummary::ALPHA, PlantSummary::PEAK);
    plant.bounds.first().map_or(String::new(), |bound| {
        let omega = bound.bandwidth_rad_s;
        format!("bandwidth       at most {omega:.1} rad/s for |S| < {alpha} with a peak below {peak} (Eq. 1-3)\n")
    })
}

//! Chapter 3: zeros by the variation of modal residues.

mod damped;
mod three_modes;
mod two_modes;

pub(crate) use damped::{fig_3_15, fig_3_16};
pub(crate) use three_modes::{fig_3_9, fig_3_10, fig_3_11, fig_3_12, fig_3_13, fig_3_14};
pub(crate) use two_modes::{fig_3_2, fig_3_3, fig_3_4, fig_3_5, fig_3_6, fig_3_8};

use super::FigureError;
use super::model::{even, geometric};
use bench_plant::zeros::{ModalSum, ModalTerm};
use bench_report::{Chart, Pen, Scale};
use bench_thesis::{Sequence, StepFeatures, StepResponse};

const W: &str = "Frequency (rad/s)";

/// A sum of modes: frequency in rad/s, damping ratio, residue in 1/kg.
fn sum(modes: &[(f64, f64, f64)]) -> Result<ModalSum, FigureError> {
    let term = |&(omega_rad_s, damping_ratio, residue_per_kg): &(f64, f64, f64)| ModalTerm {
        omega_rad_s,
        damping_ratio,
        residue_per_kg,
    };
    Ok(ModalSum::new(modes.iter().map(term).collect(), 0.0)?)
}

/// The size of one mode's part over frequency.
fn part(omega_rad_s: f64, residue_per_kg: f64, over: &[f64]) -> Vec<(f64, f64)> {
    let term = ModalTerm::undamped(omega_rad_s, residue_per_kg);
    over.iter().map(|w| (*w, term.part(*w).abs())).collect()
}

/// Frequencies that are dense around resonances without damping.
fn dense(low: f64, high: f64, resonances: &[f64]) -> Vec<f64> {
    let mut all = geometric(low, high, 400);
    for w in resonances {
        all.extend((-300..=300).map(|k| w * (1.0 + 1e-5 * (f64::from(k) / 26.0).sinh())));
    }
    all.retain(|w| (low..=high).contains(w));
    all.sort_by(f64::total_cmp);
    all
}

fn sequence(sum: &ModalSum) -> Result<String, FigureError> {
    Ok(Sequence::of(sum)?.to_string())
}

/// The response to a step of 1 N.
fn step(sum: &ModalSum, seconds: f64, count: usize) -> Vec<(f64, f64)> {
    let response = StepResponse::new(sum);
    even(0.0, seconds, count)
        .into_iter()
        .map(|t| (t, response.position_m(t)))
        .collect()
}

fn initial(sum: &ModalSum) -> StepFeatures {
    StepResponse::new(sum).initial()
}

fn step_chart(heading: &str, seconds: f64) -> Chart {
    Chart::new(
        heading,
        Scale::linear("Time (s)").within(0.0, seconds),
        Scale::linear("Position (m for 1 N)"),
    )
}

fn zero_line(chart: Chart) -> Chart {
    chart.line(
        "",
        Pen::solid(bench_report::colours::GREY).thin(),
        vec![(0.0, 0.0), (1e3, 0.0)],
    )
}

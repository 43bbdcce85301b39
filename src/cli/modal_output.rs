//! Modes, zeros and verdict of an excitation, as JSON and as text.

use serde::Serialize;

use super::table::table;
use crate::identify::modal::{FittedMode, ModalFit, ModelOrder};
use crate::identify::verdict::{Cnmp, UncertainZero, Verdict};

/// The part of a report that describes the fit; its names are a contract.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ModalSummary {
    modes: Vec<FittedMode>,
    /// Zeros of the fit, with damping, in the band of the verdict; of a conjugate pair the one above the real axis.
    zeros: Vec<UncertainZero>,
    cnmp: Cnmp,
    why: String,
    /// Reduced chi-square: 1 if the residual of the fit is noise.
    fit_chi2_per_freedom: Option<f64>,
    /// Delay beyond that of the configuration, by the fit.
    fit_delay_s: Option<f64>,
    fit_delay_sigma_s: Option<f64>,
    /// Phase lag over the modes beyond that of a minimum-phase system of the same magnitude: 360 for each pair of CNMP zeros.
    phase_fall_deg: Option<f64>,
    /// The modes of each significant model order: the stability chart.
    orders: Vec<ModelOrder>,
}

impl ModalSummary {
    /// The summary of a fit and its verdict.
    pub(super) fn new(fit: Option<&ModalFit>, verdict: &Verdict) -> ModalSummary {
        ModalSummary {
            modes: fit.map_or(Vec::new(), ModalFit::modes),
            zeros: verdict.zeros.clone(),
            cnmp: verdict.cnmp,
            why: verdict.why.clone(),
            fit_chi2_per_freedom: fit.map(|fit| fit.chi2_per_freedom),
            fit_delay_s: fit.map(|fit| fit.delay_s().value),
            fit_delay_sigma_s: fit.map(|fit| fit.delay_s().sigma),
            phase_fall_deg: verdict.phase.map(|phase| -phase.excess_phase_deg),
            orders: fit.map_or(Vec::new(), |fit| fit.orders.clone()),
        }
    }

    /// The summary of a run without analysis.
    pub(super) fn none(why: &str) -> ModalSummary {
        ModalSummary::new(None, &Verdict::undecided(why.into()))
    }

    pub(super) fn why(&self) -> &str {
        &self.why
    }

    /// Reduced chi-square of the fit.
    pub(super) fn chi2_per_freedom(&self) -> Option<f64> {
        self.fit_chi2_per_freedom
    }

    /// Tables of modes and zeros, and the verdict.
    pub(super) fn text(&self) -> String {
        let verdict = format!("CNMP zeros: {}: {}\n", self.cnmp.name(), self.why);
        if self.modes.is_empty() {
            return verdict;
        }
        let header = [
            "mode Hz",
            "+-",
            "damping",
            "+-",
            "residue 1/kg",
            "+-",
            "sign",
        ];
        let rows: Vec<_> = self.modes.iter().map(mode_row).collect();
        let modes = table(&header, &rows);
        format!(
            "\n{modes}\n{}\n+- is the 95 % confidence interval\n{verdict}",
            self.zero_table()
        )
    }

    fn zero_table(&self) -> String {
        if self.zeros.is_empty() {
            return "no zeros in the band of the verdict\n".into();
        }
        let header = ["zero rad/s", "+- re", "kind", "right of the axis"];
        let rows: Vec<_> = self.zeros.iter().map(zero_row).collect();
        table(&header, &rows)
    }
}

fn mode_row(mode: &FittedMode) -> Vec<String> {
    let (frequency_hz, damping_ratio) = (mode.frequency_hz(), mode.damping_ratio);
    vec![
        format!("{:.4}", frequency_hz.value),
        format!("{:.1e}", frequency_hz.half_width_95()),
        format!("{:.6}", damping_ratio.value),
        format!("{:.1e}", damping_ratio.half_width_95()),
        format!("{:+.6}", mode.residue_per_kg.value),
        format!("{:.1e}", mode.residue_per_kg.half_width_95()),
        mode.sign().to_string(),
    ]
}

fn zero_row(zero: &UncertainZero) -> Vec<String> {
    vec![
        format!("{:+.3} +- {:.3}j", zero.s.re, zero.s.im),
        format!("{:.1e}", zero.real_part().half_width_95()),
        zero.kind.name().into(),
        format!("{:.2} %", 100.0 * zero.rhp_probability),
    ]
}

//! What an excitation shows of the stage: its modes, its zeros, and whether some are CNMP.

use serde::Serialize;

use super::table::table;
use crate::identify::modal::{FittedMode, ModalFit, SIGMAS_95};
use crate::identify::verdict::{UncertainZero, Verdict};

/// The part of the report that a fit makes; its names are a contract.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Shown {
    modes: Vec<ModeJson>,
    /// Of the fit, with damping, in the band of the verdict; of a conjugate pair the one above the real axis.
    zeros: Vec<ZeroJson>,
    /// `detected`, `excluded` or `undecided`.
    cnmp: &'static str,
    why: String,
    /// The power of what the modes leave over that of the noise: 1 where they explain all.
    fit_chi2_per_freedom: Option<f64>,
    /// How much later than the configuration says the stage answers, by the fit.
    fit_delay_s: Option<f64>,
    fit_delay_sigma_s: Option<f64>,
    /// How far the phase falls over the modes beyond what the magnitude asks for: 360 a pair of CNMP zeros.
    phase_fall_deg: Option<f64>,
    /// The modes at each order that was found worth it, from one mode on: the stability chart.
    orders: Vec<OrderJson>,
}

/// A mode with its standard deviations.
#[derive(Clone, Debug, Serialize)]
pub(super) struct ModeJson {
    frequency_hz: f64,
    frequency_hz_sigma: f64,
    damping_ratio: f64,
    damping_ratio_sigma: f64,
    /// 1/kg, from force to displacement.
    residue: f64,
    residue_sigma: f64,
    sign: char,
    sign_error_probability: f64,
}

#[derive(Clone, Debug, Serialize)]
struct ZeroJson {
    re_rad_s: f64,
    im_rad_s: f64,
    covariance: [[f64; 2]; 2],
    rhp_probability: f64,
    kind: &'static str,
}

#[derive(Clone, Debug, Serialize)]
struct OrderJson {
    frequency_hz: Vec<f64>,
    damping_ratio: Vec<f64>,
    chi2_per_freedom: f64,
}

fn hz(omega_rad_s: f64) -> f64 {
    omega_rad_s / (2.0 * std::f64::consts::PI)
}

impl Shown {
    /// What a fit and its verdict show.
    pub(super) fn of(fit: Option<&ModalFit>, verdict: &Verdict) -> Shown {
        Shown {
            modes: fit.map_or(Vec::new(), |fit| fit.modes().iter().map(mode).collect()),
            zeros: verdict.zeros.iter().map(zero).collect(),
            cnmp: verdict.cnmp.name(),
            why: verdict.why.clone(),
            fit_chi2_per_freedom: fit.map(|fit| fit.chi2_per_freedom),
            fit_delay_s: fit.map(|fit| fit.delay_s().value),
            fit_delay_sigma_s: fit.map(|fit| fit.delay_s().sigma),
            phase_fall_deg: verdict.phase.map(|phase| -phase.excess_phase_deg),
            orders: fit.map_or(Vec::new(), |fit| fit.orders.iter().map(order).collect()),
        }
    }

    /// Nothing was made.
    pub(super) fn nothing(why: &str) -> Shown {
        Shown {
            modes: Vec::new(),
            zeros: Vec::new(),
            cnmp: "undecided",
            why: why.into(),
            fit_chi2_per_freedom: None,
            fit_delay_s: None,
            fit_delay_sigma_s: None,
            phase_fall_deg: None,
            orders: Vec::new(),
        }
    }

    pub(super) fn why(&self) -> &str {
        &self.why
    }

    /// The power of what the modes leave over that of the noise.
    pub(super) fn chi2(&self) -> Option<f64> {
        self.fit_chi2_per_freedom
    }

    /// For people: intervals hold the truth with 95 %.
    pub(super) fn text(&self) -> String {
        let verdict = format!("CNMP zeros: {}: {}\n", self.cnmp, self.why);
        if self.modes.is_empty() {
            return verdict;
        }
        let modes = [
            "mode Hz",
            "+-",
            "damping",
            "+-",
            "residue 1/kg",
            "+-",
            "sign",
        ];
        let zeros = ["zero rad/s", "+- re", "kind", "right of the axis"];
        let zeros = match self.zeros.is_empty() {
            true => "no zeros up to where a verdict is given\n".into(),
            false => table(&zeros, &self.zero_rows()),
        };
        format!(
            "\n{}\n{zeros}\n+- holds the truth with 95 %\n{verdict}",
            table(&modes, &self.mode_rows())
        )
    }

    fn mode_rows(&self) -> Vec<Vec<String>> {
        let row = |m: &ModeJson| {
            vec![
                format!("{:.4}", m.frequency_hz),
                format!("{:.1e}", SIGMAS_95 * m.frequency_hz_sigma),
                format!("{:.6}", m.damping_ratio),
                format!("{:.1e}", SIGMAS_95 * m.damping_ratio_sigma),
                format!("{:+.6}", m.residue),
                format!("{:.1e}", SIGMAS_95 * m.residue_sigma),
                m.sign.to_string(),
            ]
        };
        self.modes.iter().map(row).collect()
    }

    fn zero_rows(&self) -> Vec<Vec<String>> {
        let row = |z: &ZeroJson| {
            vec![
                format!("{:+.3} +- {:.3}j", z.re_rad_s, z.im_rad_s),
                format!("{:.1e}", SIGMAS_95 * z.covariance[0][0].sqrt()),
                z.kind.into(),
                format!("{:.2} %", 100.0 * z.rhp_probability),
            ]
        };
        self.zeros.iter().map(row).collect()
    }
}

pub(super) fn mode(mode: &FittedMode) -> ModeJson {
    ModeJson {
        frequency_hz: mode.frequency_hz().value,
        frequency_hz_sigma: mode.frequency_hz().sigma,
        damping_ratio: mode.damping_ratio.value,
        damping_ratio_sigma: mode.damping_ratio.sigma,
        residue: mode.residue_per_kg.value,
        residue_sigma: mode.residue_per_kg.sigma,
        sign: mode.sign(),
        sign_error_probability: mode.sign_error_probability(),
    }
}

fn zero(zero: &UncertainZero) -> ZeroJson {
    ZeroJson {
        re_rad_s: zero.s.re,
        im_rad_s: zero.s.im,
        covariance: zero.covariance,
        rhp_probability: zero.rhp_probability,
        kind: zero.kind.name(),
    }
}

fn order(order: &crate::identify::modal::ModelOrder) -> OrderJson {
    let modes = &order.parameters.modes;
    OrderJson {
        frequency_hz: modes.iter().map(|mode| hz(mode.omega_rad_s)).collect(),
        damping_ratio: modes.iter().map(|mode| mode.damping_ratio).collect(),
        chi2_per_freedom: order.chi2_per_freedom,
    }
}

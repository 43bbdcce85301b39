//! The margins of a designed controller around each measured response.

use serde::Serialize;

use super::error::TuneSourceError;
use super::identified::{IdentifiedFrf, ModeRole};
use crate::analysis::{FrfError, points};
use crate::results::{MeasuredLoopMargins, margins_around};
use bench_base::units::hz;
use bench_config::Config;
use bench_control::measured::{MeasuredLoop, OutsideBand, Stability};
use bench_control::tuning::DISC_SIGMAS_95;
use bench_control::{ClosedLoop, ControllerFile, ControllerText, SectionSettings};
use bench_identify::Estimate;
use bench_identify::modal::FittedMode;
use bench_identify::scatter::SigmaSource;
use bench_identify::verdict::Cnmp;
use bench_plant::SignalPath;

/// Part of half the sampling rate up to which the tolerance above the band is computed: C has zeros at its end.
const HIGHEST: f64 = 0.98;

/// A fitted mode and how the design uses it.
#[derive(Clone, Debug, Serialize)]
pub struct UsedMode {
    /// The mode.
    #[serde(flatten)]
    pub mode: FittedMode,
    /// How it is used.
    pub role: ModeRole,
}

/// A measured response with the margins of a controller around it. The names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct FrfEvidence {
    /// Name of the plant in the design.
    pub plant: String,
    /// The file as the user named it.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// First and last measured frequency in hertz.
    pub band_hz: [f64; 2],
    /// Number of measured frequencies.
    pub frequencies: usize,
    /// Where the standard deviations of the response come from.
    pub sigma: SigmaSource,
    /// Whether there are CNMP zeros.
    pub cnmp: Cnmp,
    /// The reasons.
    pub why: String,
    /// The fitted modes.
    pub modes: Vec<UsedMode>,
    /// Fitted delay in seconds beyond that of the configuration.
    pub excess_delay_s: Estimate,
    /// Reduced chi-square of the fit.
    pub chi2_per_freedom: f64,
    /// Whether the loop with the measured response is stable, by Nyquist's criterion.
    pub stability: Stability,
    /// The distance of L from -1; `None` if the loop is not stable.
    pub modulus_margin: Option<Estimate>,
    /// Smallest |1 + L| - c sigma |C| over the measured frequencies: at each of them the true distance is larger with 95 %.
    pub modulus_margin_lower: f64,
    /// Its frequency in hertz.
    pub modulus_margin_lower_at_hz: f64,
    /// Bounds outside of the measured band, by the fitted modes.
    pub outside_band: OutsideBand,
    /// Smallest |1 + L|/|C| above the band in m/A: a response of less there, beside that of the fitted modes, cannot make the loop
    /// unstable.
    pub tolerated_above_m_per_a: f64,
}

impl FrfEvidence {
    /// Whether the measured loop is stable with a lower modulus margin of at least `least`.
    pub fn fulfils(&self, least: f64) -> bool {
        self.stability == Stability::Stable && self.modulus_margin_lower >= least
    }
}

/// The margins of a controller around each response.
///
/// # Errors
/// When the crossover or the peak of |S| may lie outside of a measured band.
pub fn evidence(
    frfs: &[IdentifiedFrf],
    sections: &[SectionSettings],
    config: &Config,
) -> Result<Vec<FrfEvidence>, TuneSourceError> {
    frfs.iter()
        .map(|frf| of_one(frf, sections, config))
        .collect()
}

fn of_one(
    frf: &IdentifiedFrf,
    sections: &[SectionSettings],
    config: &Config,
) -> Result<FrfEvidence, TuneSourceError> {
    let model = closed_loop(frf, sections, config)?;
    let refused = |why: FrfError| TuneSourceError::File {
        file: frf.source.file.clone(),
        why: Box::new(why),
    };
    let found = margins_around(&frf.source.measured, &model, config).map_err(refused)?;
    let (lower, at_rad_s) = lower_margin(frf, &model, config).map_err(refused)?;
    Ok(FrfEvidence {
        modulus_margin_lower: lower,
        modulus_margin_lower_at_hz: hz(at_rad_s),
        tolerated_above_m_per_a: tolerated_above(&found, &model),
        modulus_margin: found.margins.as_ref().map(|margins| margins.modulus_margin),
        stability: found.count.stability,
        band_hz: found.band_hz,
        outside_band: found.outside_band,
        frequencies: frf.source.measured.frf.len(),
        sigma: frf.source.measured.sigma,
        plant: frf.plant.name.clone(),
        file: frf.source.file.clone(),
        sha256: frf.source.sha256.clone(),
        cnmp: frf.verdict.cnmp,
        why: frf.verdict.why.clone(),
        modes: used_modes(frf),
        excess_delay_s: frf.fit.delay_s(),
        chi2_per_freedom: frf.fit.chi2_per_freedom,
    })
}

fn used_modes(frf: &IdentifiedFrf) -> Vec<UsedMode> {
    let modes = frf.fit.modes().into_iter().zip(&frf.roles);
    modes
        .map(|(mode, role)| UsedMode { mode, role: *role })
        .collect()
}

/// The controller around all fitted modes.
fn closed_loop(
    frf: &IdentifiedFrf,
    sections: &[SectionSettings],
    config: &Config,
) -> Result<ClosedLoop, TuneSourceError> {
    let file = ControllerFile {
        title: String::new(),
        section: sections.to_vec(),
    };
    let text = ControllerText {
        name: "the designed controller".into(),
        text: toml::to_string(&file).unwrap_or_default(),
    };
    let design = text.design(config.servo.rate_hz)?;
    let (modes, plant) = frf.whole();
    let force_constant = config.motor.force_constant_n_per_a;
    Ok(ClosedLoop::new(plant, modes, force_constant, design)?)
}

/// The smallest |1 + L| - c sigma |C| in the measured band, and its frequency in rad/s.
fn lower_margin(
    frf: &IdentifiedFrf,
    model: &ClosedLoop,
    config: &Config,
) -> Result<(f64, f64), FrfError> {
    let points = points(&frf.source.measured.frf, &SignalPath::from(config));
    let law = |w: f64| model.law_response(w);
    Ok(MeasuredLoop::new(&points, &law, &[])?.least_distance(DISC_SIGMAS_95))
}

fn tolerated_above(found: &MeasuredLoopMargins, model: &ClosedLoop) -> f64 {
    let from_rad_s = found.outside_band.above.from_rad_s;
    let to_rad_s = HIGHEST * model.nyquist_rad_s();
    let tolerated = |w: f64| (model.sampled_loop(w) + 1.0).norm() / model.law_response(w).norm();
    let frequencies = model.frequencies(from_rad_s, to_rad_s.max(from_rad_s));
    frequencies
        .into_iter()
        .map(tolerated)
        .fold(f64::INFINITY, f64::min)
}

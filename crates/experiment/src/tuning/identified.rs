//! The plant of a measured response: fitted modes, and the distance of the response from them.

use nalgebra::{Complex, DMatrix};
use serde::Serialize;

use super::distinct::{check_distinct, check_modes};
use super::error::TuneSourceError;
use super::mode_fit::{best_fit, groups};
use super::source::FrfSource;
use crate::analysis::{FrfError, check_rate, check_static_conventions, judge_excess, points};
use bench_base::units::{hz, rad_s};
use bench_config::Config;
use bench_control::measured::{MeasuredLoop, check_gaps};
use bench_control::tuning::{DISC_SIGMAS_95, IdentifiedResponse, MeasuredPlant, loop_plant};
use bench_identify::modal::{FittedMode, MeasurementChain, ModalFit, Parameter};
use bench_identify::verdict::{self, Verdict, VerdictScope};
use bench_plant::UnmodelledMode;
use bench_plant::{LoopPlant, Mode, SignalPath};

/// The verdict on CNMP zeros covers the band up to this multiple of the highest mode that is used with its sign.
const LAST_MODE: f64 = 1.2;
/// A mode whose largest response is below this part of the static response is minor: it counts with any phase.
const MINOR: f64 = 0.2;
/// The static response by the fit over the response at the first frequency: below 1 near the first mode, 1 far below it.
const STATIC_RATIO: std::ops::RangeInclusive<f64> = 0.1..=2.0;
/// Modes of two operating points whose frequencies differ by less than this ratio are one mode of the stage.
const SAME_MODE: f64 = 0.05;
/// Largest ratio of the travel at full current and the permitted travel, and of its inverse.
const MAX_TRAVEL_RATIO: f64 = 300.0;

/// How a design uses a fitted mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ModeRole {
    /// With its sign, as a mode of the plant.
    Signed,
    /// With any phase: its largest response is a small part of the static one at every operating point, or it is not determined
    /// separately from its neighbours.
    AnyPhase,
    /// With any phase: the 95 % interval of its residue contains zero.
    UncertainSign,
}

/// A measured response with its fitted modes.
#[derive(Clone, Debug)]
pub struct IdentifiedFrf {
    /// The response.
    pub source: FrfSource,
    /// All fitted modes.
    pub fit: ModalFit,
    /// How each of them is used, lowest frequency first.
    pub roles: Vec<ModeRole>,
    /// The verdict on CNMP zeros of the modes that are used with their signs.
    pub verdict: Verdict,
    /// The plant of the design.
    pub plant: MeasuredPlant,
}

impl IdentifiedFrf {
    /// The plants of some responses, each of another operating point.
    ///
    /// # Errors
    /// When a response cannot be used, or two are of one operating point.
    pub fn all(
        sources: Vec<FrfSource>,
        config: &Config,
    ) -> Result<Vec<IdentifiedFrf>, TuneSourceError> {
        check_distinct(&sources)?;
        let fits = sources.iter().map(|source| fitted(source, config));
        let fits: Vec<ModalFit> = fits.collect::<Result<_, _>>()?;
        let major_rad_s: Vec<f64> = fits.iter().flat_map(major_modes_rad_s).collect();
        let frfs = sources.into_iter().zip(fits).enumerate();
        let frfs = frfs.map(|(index, (source, fit))| {
            let name = source.point_name();
            let name = name.unwrap_or_else(|| format!("FRF {}", index + 1));
            IdentifiedFrf::new(name, source, fit, &major_rad_s, config)
        });
        let frfs: Vec<IdentifiedFrf> = frfs.collect::<Result<_, _>>()?;
        let modes = frfs.iter().map(|frf| (&frf.source, frf.signed_modes()));
        check_modes(&modes.collect::<Vec<_>>())?;
        Ok(frfs)
    }

    fn new(
        name: String,
        source: FrfSource,
        fit: ModalFit,
        major_rad_s: &[f64],
        config: &Config,
    ) -> Result<IdentifiedFrf, TuneSourceError> {
        let roles = roles(&fit, major_rad_s);
        let response = response(&source, &fit, &roles, config);
        let response = response.map_err(|why| refused(&source, why))?;
        let verdict = verdict(&source, &fit, &roles, config)?;
        Ok(IdentifiedFrf {
            plant: MeasuredPlant {
                name,
                modes: modes_of(&fit, &roles, |role| role == ModeRole::Signed),
                minor: minor_modes(&fit, &roles),
                response,
            },
            source,
            fit,
            roles,
            verdict,
        })
    }

    /// The modes that the design uses with their signs.
    pub fn signed_modes(&self) -> Vec<FittedMode> {
        let modes = self.fit.modes().into_iter().zip(&self.roles);
        let signed = modes.filter(|(_, role)| **role == ModeRole::Signed);
        signed.map(|(mode, _)| mode).collect()
    }

    /// Frequencies in hertz of the modes with an uncertain sign.
    pub fn uncertain_signs_hz(&self) -> Vec<f64> {
        let modes = self.fit.modes().into_iter().zip(&self.roles);
        let uncertain = modes.filter(|(_, role)| **role == ModeRole::UncertainSign);
        uncertain
            .map(|(mode, _)| mode.frequency_hz().value)
            .collect()
    }

    /// All fitted modes and the signal path, which describe the response best.
    pub fn whole(&self) -> (Vec<Mode>, LoopPlant) {
        let modes = modes_of(&self.fit, &self.roles, |_| true);
        let response = &self.plant.response;
        let plant = loop_plant(&response.path, &modes, response.remainder_m_per_n);
        (modes, plant)
    }
}

fn refused(source: &FrfSource, why: FrfError) -> TuneSourceError {
    TuneSourceError::File {
        file: source.file.clone(),
        why: Box::new(why),
    }
}

/// The modes of a response that belongs to the signal path of `config`.
fn fitted(source: &FrfSource, config: &Config) -> Result<ModalFit, TuneSourceError> {
    check_rate(&source.measured, config).map_err(|why| refused(source, why))?;
    check_unit(source, config)?;
    check_phases(source, config).map_err(|why| refused(source, why))?;
    let file = source.file.clone();
    let fit = best_fit(source, &MeasurementChain::bench(config));
    let fit = fit.map_err(|why| TuneSourceError::Fit {
        file: file.clone(),
        why,
    })?;
    check_fit(source, &fit, config).map_err(|why| refused(source, why))?;
    check_static_response(source, &fit, config)?;
    Ok(fit)
}

/// Refuses a table in other conventions than the bench has. Of a recording they are known.
fn check_phases(source: &FrfSource, config: &Config) -> Result<(), FrfError> {
    if source.measured.recorded.is_some() {
        return Ok(());
    }
    let static_sign = config.motor.force_constant_n_per_a.signum();
    check_static_conventions(&source.measured.frf, static_sign)
}

/// Refuses a stage without a spring to ground, and a response that begins above the first mode: the static response by the fit then
/// differs from the response at the first frequency.
fn check_static_response(
    source: &FrfSource,
    fit: &ModalFit,
    config: &Config,
) -> Result<(), TuneSourceError> {
    let (first_hz, _) = source.measured.band_hz();
    let at_first = source.measured.frf.response.first();
    let at_first = at_first.map_or(f64::NAN, |response| response.norm());
    let ratio = static_m_per_n(fit) * config.motor.force_constant_n_per_a / at_first;
    let major = major_modes_rad_s(fit)
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    if STATIC_RATIO.contains(&ratio) && hz(major) >= first_hz {
        Ok(())
    } else {
        Err(TuneSourceError::Static {
            file: source.file.clone(),
            ratio,
            first_hz,
        })
    }
}

/// Compares the travel at full current with the permitted travel: a factor of a thousand is another unit.
fn check_unit(source: &FrfSource, config: &Config) -> Result<(), TuneSourceError> {
    let frf = &source.measured.frf;
    let (Some(&frequency_hz), Some(response)) = (frf.frequency_hz.first(), frf.response.first())
    else {
        return Ok(());
    };
    let response_m_per_a = response.norm();
    let (current_a, travel_m) = (
        config.amplifier.current_limit_a,
        config.interlock.soft_limit_m,
    );
    let ratio = response_m_per_a * current_a / travel_m;
    if (1.0 / MAX_TRAVEL_RATIO..=MAX_TRAVEL_RATIO).contains(&ratio) {
        Ok(())
    } else {
        Err(TuneSourceError::Unit {
            file: source.file.clone(),
            response_m_per_a,
            frequency_hz,
            current_a,
            travel_m,
            ratio,
        })
    }
}

/// Refuses a response whose delay is not that of the signal path, or with a gap that may hide a resonance.
fn check_fit(source: &FrfSource, fit: &ModalFit, config: &Config) -> Result<(), FrfError> {
    let path = SignalPath::from(config);
    judge_excess(fit.delay_s(), &LoopPlant::of(&path, &[]))?;
    let modes = fit.parameters.modes.iter();
    let damping = modes
        .map(|mode| mode.damping_ratio)
        .filter(|zeta| *zeta > 0.0);
    let least = damping.fold(0.5, f64::min);
    Ok(check_gaps(&points(&source.measured.frf, &path), least)?)
}

/// The static response by the fit in m/N; infinite with a free body.
fn static_m_per_n(fit: &ModalFit) -> f64 {
    let terms = fit.parameters.modes.iter();
    let compliances = terms.map(|term| term.residue_per_kg / (term.omega_rad_s * term.omega_rad_s));
    compliances.sum::<f64>() + fit.parameters.remainder_m_per_n
}

/// Frequencies in rad/s of the modes of certain sign that are not minor.
fn major_modes_rad_s(fit: &ModalFit) -> Vec<f64> {
    let least_m_per_n = MINOR * static_m_per_n(fit).abs();
    let modes = fit.modes().into_iter();
    let major =
        modes.filter(|mode| has_certain_sign(mode) && largest_m_per_n(mode) >= least_m_per_n);
    major.map(|mode| mode.omega_rad_s.value).collect()
}

/// How each mode is used, given the frequencies of the modes that are not minor at some operating point.
fn roles(fit: &ModalFit, major_rad_s: &[f64]) -> Vec<ModeRole> {
    let modes = fit.modes();
    let groups = groups(&modes);
    let is_grouped = |k: usize| {
        groups
            .iter()
            .any(|group| group.len() > 1 && group.contains(&k))
    };
    let role = |(k, mode): (usize, &FittedMode)| {
        let same = |major: &f64| (mode.omega_rad_s.value / major - 1.0).abs() < SAME_MODE;
        if is_grouped(k) {
            ModeRole::AnyPhase
        } else if !has_certain_sign(mode) {
            ModeRole::UncertainSign
        } else if major_rad_s.iter().any(same) {
            ModeRole::Signed
        } else {
            ModeRole::AnyPhase
        }
    };
    modes.iter().enumerate().map(role).collect()
}

/// Whether the 95 % interval of the residue excludes zero.
fn has_certain_sign(mode: &FittedMode) -> bool {
    let (low, high) = mode.residue_per_kg.interval_95();
    low > 0.0 || high < 0.0
}

/// The larger of the static response of a mode and that at its resonance, in m/N.
fn largest_m_per_n(mode: &FittedMode) -> f64 {
    let (w, zeta) = (mode.omega_rad_s.value, mode.damping_ratio.value);
    mode.residue_per_kg.value.abs() / (w * w * (2.0 * zeta).min(1.0))
}

/// The modes of some roles.
fn modes_of(fit: &ModalFit, roles: &[ModeRole], is_used: impl Fn(ModeRole) -> bool) -> Vec<Mode> {
    let terms = fit.parameters.modes.iter().zip(roles);
    let used = terms.filter(|(_, role)| is_used(**role));
    used.map(|(term, _)| Mode {
        force_gain: term.residue_per_kg,
        ..Mode::unit(term.omega_rad_s, term.damping_ratio)
    })
    .collect()
}

/// The modes that count with any phase: one alone with the 95 % limit of its residue, a group with the fitted residues, whose sum is
/// determined.
fn minor_modes(fit: &ModalFit, roles: &[ModeRole]) -> Vec<Vec<UnmodelledMode>> {
    let modes = fit.modes();
    let minor = groups(&modes).into_iter();
    let minor = minor.filter(|group| group.iter().all(|k| roles[*k] != ModeRole::Signed));
    minor
        .map(|group| match group.as_slice() {
            [k] => vec![as_unmodelled(&modes[*k], upper_residue(&modes[*k]))],
            several => several
                .iter()
                .map(|k| as_unmodelled(&modes[*k], modes[*k].residue_per_kg.value))
                .collect(),
        })
        .collect()
}

fn as_unmodelled(mode: &FittedMode, residue_per_kg: f64) -> UnmodelledMode {
    UnmodelledMode {
        frequency_hz: mode.frequency_hz().value,
        damping_ratio: mode.damping_ratio.value,
        residue_per_kg,
    }
}

/// The 95 % limit of the magnitude of a residue in 1/kg.
fn upper_residue(mode: &FittedMode) -> f64 {
    mode.residue_per_kg.value.abs() + mode.residue_per_kg.half_width_95()
}

fn response(
    source: &FrfSource,
    fit: &ModalFit,
    roles: &[ModeRole],
    config: &Config,
) -> Result<IdentifiedResponse, FrfError> {
    let parameters = &fit.parameters;
    let path = SignalPath::from(config).with_added_delay(parameters.delay_s);
    let modes = modes_of(fit, roles, |_| true);
    let whole = loop_plant(&path, &modes, parameters.remainder_m_per_n);
    Ok(IdentifiedResponse {
        deviation: deviation(source, &whole, config)?,
        path,
        remainder_m_per_n: parameters.remainder_m_per_n,
        covariance: covariance(fit, roles),
    })
}

/// |P_measured - P| + c sigma in m/A at the measured frequencies.
fn deviation(
    source: &FrfSource,
    plant: &LoopPlant,
    config: &Config,
) -> Result<Vec<(f64, f64)>, FrfError> {
    let frf = &source.measured.frf;
    let points = points(frf, &SignalPath::from(config));
    let unity = |_| Complex::new(1.0, 0.0);
    let measured = MeasuredLoop::new(&points, &unity, &[])?;
    let frequencies = frf.frequency_hz.iter().map(|f| rad_s(*f));
    let deviation = frequencies.map(|w| {
        let distance = (measured.plant(w) - plant.response(w)).norm();
        (w, distance + DISC_SIGMAS_95 * measured.plant_sigma(w))
    });
    Ok(deviation.collect())
}

/// The covariance of the modes that are used with their signs, of R and of the delay.
fn covariance(fit: &ModalFit, roles: &[ModeRole]) -> DMatrix<f64> {
    let free = fit.parameters.free();
    let is_used = |parameter: &Parameter| match parameter {
        Parameter::Frequency(k)
        | Parameter::Damping(k)
        | Parameter::Residue(k)
        | Parameter::Rate(k) => roles[*k] == ModeRole::Signed,
        Parameter::Remainder | Parameter::Delay => true,
    };
    let used: Vec<usize> = (0..free.len()).filter(|i| is_used(&free[*i])).collect();
    DMatrix::from_fn(used.len(), used.len(), |i, j| {
        fit.covariance[(used[i], used[j])]
    })
}

fn verdict(
    source: &FrfSource,
    fit: &ModalFit,
    roles: &[ModeRole],
    config: &Config,
) -> Result<Verdict, TuneSourceError> {
    let signed = modes_of(fit, roles, |role| role == ModeRole::Signed);
    let highest = signed
        .iter()
        .map(|mode| mode.omega_rad_s)
        .fold(0.0, f64::max);
    let up_to_rad_s = LAST_MODE * highest;
    let chain = MeasurementChain::bench(config);
    let scope = VerdictScope::up_to(up_to_rad_s);
    let data = &source.measured.frf.data;
    verdict::verdict(&scope.input(fit, data, &chain)).map_err(TuneSourceError::Zeros)
}

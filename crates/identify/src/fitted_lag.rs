//! A first-order lag between input and output that is not stated, as of a current loop, a voltage source or a filter of the probe.
//!
//! ```text
//! H(s) = G(s)/(1 + s tau)           tau one parameter beside those of the modes
//! ```
//!
//! tau is fitted if modes with real residues alone do not describe the data, or only with some that nearly cancel, are not determined, or
//! have the damping of a filter. It is found by a scan with a few modes, and then as the
//! value of least chi^2. The result is accepted if
//!
//! 1. few modes then leave noise as the residual, do not nearly cancel, and are determined;
//! 2. they have fewer parameters, tau included, than those without a lag, if these describe the data as well;
//! 3. tau differs from 0 by more than its noise;
//! 4. no mode is heavily damped: such a mode takes the place of another filter.
//!
//! With the voltage of a coil as the input, modes with complex residues are tried behind modes with real ones: the induced voltage damps
//! the stage at the coil alone. Complex residues must then be significantly better than real ones with the same lag.
//!
//! The error of tau is included in those of modes and zeros, as the standard deviations say how far tau and they are coupled.

use std::f64::consts::TAU;

use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::complex_residues;
use crate::frf::with_relative_error;
use crate::modal::{
    self, FitError, InputPath, MeasurementChain, ModalFit, ModalParameters, Nearest, Residues,
};
use crate::observation::{Observation, Source, describes};
use crate::part::{PART_MODES, part};
use crate::profile::{self, is_progress};
use crate::{Estimate, FrfDatum};
use bench_plant::{InputKind, OutputKind};

/// The scan begins at a lag that turns the response by this angle in radians at the end of the band ...
const LEAST_ANGLE_RAD: f64 = 0.02;
/// ... ends at one that turns it by atan of this at its beginning ...
const LARGEST_RATIO: f64 = 3.0;
/// ... and has lags that differ by this factor.
const SCAN_FACTOR: f64 = 2.0;
/// Near the best one, lags that differ by this factor are scanned. A wrong lag then changes the response by 5 % at most, and modes with
/// a relative error of some per cent are those of the stage.
const FINE_FACTOR: f64 = 1.2;
/// Number of these lags to either side.
const FINE_STEPS: i32 = 2;
/// Number of modes in the scan.
const SCANNED_MODES: usize = 4;
/// Errors over the response with which the lag is refined, one after the other.
const RELATIVE_ERRORS: [f64; 2] = [0.03, 0.003];
/// First step of ln tau.
const FIRST_STEP: f64 = 0.1;
/// The lag may differ from the scanned ones by this factor.
const BEYOND_SCAN: f64 = 4.0;
/// Largest number of fits with the lag of the one before.
const MAX_REFITS: usize = 6;
/// A lag of fewer standard deviations is noise.
const CERTAIN_SIGMAS: f64 = 5.0;

/// A first-order lag between input and output that was fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedLag {
    /// Its time constant tau in seconds.
    pub lag_s: Estimate,
}

impl FittedLag {
    /// The path of an input with this lag.
    pub(crate) fn in_path(&self, path: InputPath) -> InputPath {
        InputPath {
            lag_s: self.lag_s.value,
            ..path
        }
    }

    /// What was found.
    pub fn description(&self) -> String {
        let Estimate { value, .. } = self.lag_s;
        format!(
            "a first-order lag of {:.4} ± {:.4} ms (a pole at {:.1} Hz) between input and output, which is not stated, is fitted: modes and zeros are those without it (--input-lag states another one; 0s none)",
            1e3 * value,
            1e3 * self.lag_s.half_width_95(),
            1.0 / (TAU * value)
        )
    }
}

/// The modes through a lag.
pub(crate) struct FitThroughLag {
    pub(crate) lag: FittedLag,
    pub(crate) chain: MeasurementChain,
    pub(crate) fit: ModalFit,
}

/// The fit with a lag, if it describes the data and a fit without one does not. With the voltage of a coil as the input, complex residues
/// are tried as well.
pub(crate) fn fit_through_lag(seen: &Observation<'_>) -> Option<FitThroughLag> {
    let max_modes = max_modes(seen)?;
    let is_voltage = seen.source.input_kind == Some(InputKind::Voltage);
    fit_with(seen, Residues::Real, max_modes).or_else(|| {
        is_voltage
            .then(|| fit_with(seen, Residues::complex(), max_modes))
            .flatten()
    })
}

fn fit_with(seen: &Observation<'_>, residues: Residues, max_modes: usize) -> Option<FitThroughLag> {
    let unknown = UnknownLag {
        source: seen.source,
        kind: seen.chain.output(),
        residues,
    };
    let data = &seen.frf.data;
    let near = unknown.described(&part(data))?;
    let LagWithModes { lag_s: lag, modes } = unknown.refined(data, &near)?;
    let max_modes = match unknown.residues {
        Residues::Real => max_modes,
        // A further one takes the place of what is left of the lag.
        Residues::Complex(_) => modes.modes.len(),
    };
    let chain = unknown.chain(lag.value, data);
    let fit = modal::fit_few(data, &chain, &unknown.residues, max_modes).ok()?;
    let of_logarithm = Estimate {
        value: lag.value.ln(),
        sigma: lag.sigma / lag.value,
    };
    let fit = profile::with_error(fit, of_logarithm, |ln_lag, modes| {
        unknown.nearest(data, ln_lag, modes)
    });
    let lag_is_certain = lag.value > CERTAIN_SIGMAS * lag.sigma;
    let is_accepted = match unknown.residues {
        Residues::Real => fit.is_of_a_stage(),
        Residues::Complex(_) => {
            fit.is_of_a_stage() && complex_residues::is_accepted(&fit, data, &chain)
        }
    };
    (lag_is_certain && is_accepted && is_simpler(&fit, seen.fit)).then_some(FitThroughLag {
        lag: FittedLag { lag_s: lag },
        chain,
        fit,
    })
}

/// Whether a lag is looked for: it is not stated, and modes without one do not describe the response as those of a stage.
pub(crate) fn is_looked_for(seen: &Observation<'_>) -> bool {
    max_modes(seen).is_some()
}

/// Largest number of modes through a lag; `None` if no lag is looked for.
fn max_modes(seen: &Observation<'_>) -> Option<usize> {
    if !seen.source.fits_lag {
        return None;
    }
    match seen.fit {
        Ok(fit) if fit.is_of_a_stage() => None,
        Ok(fit) if fit.chi2_per_freedom <= MAX_CHI2_PER_FREEDOM => {
            Some(fit.parameters.modes.len().min(PART_MODES))
        }
        Ok(_) | Err(FitError::Undetermined { .. }) => Some(PART_MODES),
        Err(_) => None,
    }
}

/// Whether modes and lag have fewer parameters than modes without it that leave noise as well.
fn is_simpler(fit: &ModalFit, without: &Result<ModalFit, FitError>) -> bool {
    match without {
        Ok(without) if without.leaves_noise() => {
            fit.number_of_parameters() + 1 < without.number_of_parameters()
        }
        _ => true,
    }
}

/// A lag of any length in the chain of a source.
struct UnknownLag {
    source: Source,
    kind: OutputKind,
    residues: Residues,
}

impl UnknownLag {
    fn chain(&self, lag_s: f64, data: &[FrfDatum]) -> MeasurementChain {
        let source = Source {
            input_path: InputPath {
                lag_s,
                ..self.source.input_path
            },
            ..self.source
        };
        source.chain(self.kind, data)
    }

    /// The lag with which a few modes describe the data, and these modes; `None` if they do not.
    fn described(&self, data: &[FrfDatum]) -> Option<LagWithModes> {
        let mut found = self.scan(data)?;
        for relative_error in RELATIVE_ERRORS {
            let near = self.refined(&with_relative_error(data, relative_error), &found)?;
            // Modes in the place of a part of the lag are no longer needed.
            found = self.best_of(data, std::iter::once(near.lag_s.value))?;
        }
        // Without the error the data show smaller modes. Those of a lag that is not exact are too many: the next ones are fewer.
        let mut before: Option<ModalFit> = None;
        for _ in 0..MAX_REFITS {
            let chain = self.chain(found.lag_s.value, data);
            let fit = modal::fit_few(data, &chain, &self.residues, PART_MODES).ok()?;
            let is_stuck = |before: &ModalFit| !describes(&fit) && !is_progress(before, &fit);
            let is_real = self.residues == Residues::Real;
            if is_real && before.as_ref().is_some_and(is_stuck) {
                return None;
            }
            let is_complete = match self.residues {
                Residues::Real => fit.is_sum_of_few_modes(),
                Residues::Complex(_) => fit.is_of_a_stage(),
            };
            found.modes = self.of_the_stage(&fit);
            found = self.refined(data, &found)?;
            if is_complete {
                return Some(found);
            }
            before = Some(fit);
        }
        None
    }

    /// The modes of a fit; of complex residues those without the damping of a filter, which take the place of a part of the lag.
    fn of_the_stage(&self, fit: &ModalFit) -> ModalParameters {
        match self.residues {
            Residues::Real => fit.parameters.clone(),
            Residues::Complex(_) => fit.lightly_damped_modes(),
        }
    }

    /// The scanned lag with which a few modes describe the data best: first in large, then in small steps.
    fn scan(&self, data: &[FrfDatum]) -> Option<LagWithModes> {
        let (least_s, largest_s) = scanned_s(data)?;
        let lags = std::iter::successors(Some(least_s), |lag_s| Some(lag_s * SCAN_FACTOR));
        let lags = lags.take_while(|lag_s| *lag_s < largest_s);
        let near_s = self.best_of(data, lags)?.lag_s.value;
        let steps = -FINE_STEPS..=FINE_STEPS;
        self.best_of(data, steps.map(|k| near_s * FINE_FACTOR.powi(k)))
    }

    fn best_of(
        &self,
        data: &[FrfDatum],
        lags_s: impl Iterator<Item = f64>,
    ) -> Option<LagWithModes> {
        let fits = lags_s.filter_map(|lag_s| {
            let chain = self.chain(lag_s, data);
            let fit = modal::coarse_fit(data, &chain, SCANNED_MODES).ok()?;
            Some((lag_s, fit))
        });
        let best = fits.min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        let (lag_s, fit) = best?;
        Some(LagWithModes {
            lag_s: Estimate {
                value: lag_s,
                sigma: 0.0,
            },
            modes: fit.parameters,
        })
    }

    /// The lag of least chi^2 near one, with as many modes.
    fn refined(&self, data: &[FrfDatum], near: &LagWithModes) -> Option<LagWithModes> {
        let (least_s, largest_s) = scanned_s(data)?;
        let start = profile::Start {
            modes: &near.modes,
            value: near.lag_s.value.ln(),
            step: FIRST_STEP,
            limits: ((least_s / BEYOND_SCAN).ln(), (largest_s * BEYOND_SCAN).ln()),
        };
        let best = profile::best(&start, |ln_lag, modes| self.nearest(data, ln_lag, modes))?;
        let value = best.value.value.exp();
        Some(LagWithModes {
            lag_s: Estimate {
                value,
                sigma: value * best.value.sigma,
            },
            modes: best.modes,
        })
    }

    /// The modes of least chi^2 with a lag of exp(`ln_lag`) seconds, near given ones.
    fn nearest(&self, data: &[FrfDatum], ln_lag: f64, modes: &ModalParameters) -> Nearest {
        let data = &modal::merged(data, modes);
        modal::nearest(modes, data, &self.chain(ln_lag.exp(), data))
    }
}

/// A lag with the modes that it was found with.
struct LagWithModes {
    lag_s: Estimate,
    modes: ModalParameters,
}

/// The least and the largest lag of the scan in seconds.
fn scanned_s(data: &[FrfDatum]) -> Option<(f64, f64)> {
    let (first, last) = (data.first()?, data.last()?);
    let least_s = LEAST_ANGLE_RAD / last.omega_rad_s();
    Some((least_s, LARGEST_RATIO / first.omega_rad_s()))
}

#[cfg(test)]
mod tests;

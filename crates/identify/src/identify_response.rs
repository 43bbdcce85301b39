//! From a response that another program has computed to modes and verdict, without a model of the stage.

use bench_base::units::rad_s;
use bench_plant::{InputKind, OutputKind, PlantError};

use crate::Frf;
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use crate::external_verdict::judged;
use crate::first_fit::FirstFit;
use crate::fitted_lag::FittedLag;
use crate::independent::independent;
use crate::modal::{self, FitError, InputPath, MeasurementChain, ModalFit};
use crate::observation::{Observation, Source};
use crate::part::Part;
use crate::plausibility::{
    OtherModel, complex_model, implausible, known_cause, lag_model, response_hint,
};
use crate::remedies::OF_RESPONSE;
use crate::scatter::Scatter;
use crate::verdict::{Cnmp, Verdict, VerdictScope};

/// Samples per second over the last frequency of a response whose rate is not known: 400 lines of 1024 samples, the usual ratio of
/// analysers.
const ANALYSER_RATIO: f64 = 2.56;
/// Standard deviations whose median ratio to the scatter is below this are too small: reduced chi-square is then above its limit with
/// the right modes.
const TOO_SMALL: f64 = 0.5;

/// The analysis of a measured response.
#[derive(Clone, Debug)]
pub struct ResponseAnalysis {
    /// The response in the band, with the data of the fit.
    pub frf: Frf,
    /// Its modes, or why none can be fitted.
    pub fit: Result<ModalFit, FitError>,
    /// The verdict on CNMP zeros.
    pub verdict: Verdict,
    /// The hold of the input, and its lag, which are stated or fitted.
    pub input_path: InputPath,
    /// The lag of the input, if it was fitted.
    pub fitted_lag: Option<FittedLag>,
    /// What the input is, if that is stated.
    pub input_kind: Option<InputKind>,
    /// The kind of the output that was assumed.
    pub output_kind: OutputKind,
    /// The chain from the input to the force that follows from them.
    pub chain: MeasurementChain,
    /// The analysed band in hertz.
    pub band_hz: (f64, f64),
    /// The verdict covers modes and zeros up to here, the end of the band, in rad/s.
    pub judged_up_to_rad_s: f64,
}

/// Why a response cannot be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ResponseError {
    /// The limits of the band do not rise from 0.
    #[error(
        "{low_hz} to {high_hz} Hz is not a band; give two frequencies above 0, the lower one first"
    )]
    Limits {
        /// Lower limit.
        low_hz: f64,
        /// Upper limit.
        high_hz: f64,
    },
    /// No point lies in the band.
    #[error(
        "the response has no frequency from {low_hz} to {high_hz} Hz, but {points} from {first_hz:.4} to {last_hz:.4} Hz; choose a band within them"
    )]
    NoPoint {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
        /// Number of frequencies of the response.
        points: usize,
        /// The first one.
        first_hz: f64,
        /// The last one.
        last_hz: f64,
    },
    /// A held input has no response beyond half of its rate that is different from that below.
    #[error(
        "the response reaches {last_hz:.4} Hz, but that of an input that is held at {rate_hz} Hz ends at half of this rate; correct the rate, or choose a band below {limit_hz} Hz",
        limit_hz = 0.5 * .rate_hz
    )]
    BeyondHalfRate {
        /// Last frequency in the band.
        last_hz: f64,
        /// Samples of the held input per second.
        rate_hz: f64,
    },
    /// The zeros of the fit cannot be computed.
    #[error(transparent)]
    Zeros(#[from] PlantError),
}

/// How a response is identified. As [`Identification`](crate::Identification), it takes any unit of input and output.
///
/// ```
/// use bench_identify::{Frf, FrfPoint, ResponseIdentification};
/// use nalgebra::Complex;
///
/// // Two modes, 30 and 80 Hz, with residues of opposite signs, and an error of 1e-4 of the static response.
/// let mode = |s: Complex<f64>, hz: f64, residue: f64| {
///     let w = std::f64::consts::TAU * hz;
///     (s * s + s * (0.02 * w) + w * w).inv() * residue
/// };
/// let mut frf = Frf::default();
/// for k in 1..800 {
///     let frequency_hz = 0.25 * f64::from(k);
///     let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
///     let error = Complex::from_polar(1.4e-9, f64::from(k * k));
///     frf.push(FrfPoint {
///         frequency_hz,
///         response: mode(s, 30.0, 0.5) - mode(s, 80.0, 0.3) + error,
///         coherence: 1.0,
///         variance: 2e-18,
///         resolution_hz: 0.25,
///     });
/// }
/// let found = ResponseIdentification::new().band_hz(1.0, 150.0).run(&frf)?;
/// let signs: String = found.fit.expect("modes").modes().iter().map(|mode| mode.sign()).collect();
/// assert_eq!(signs, "+-");
/// # Ok::<(), bench_identify::ResponseError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ResponseIdentification {
    band_hz: Option<(f64, f64)>,
    held_at_hz: Option<f64>,
    stated_lag_s: Option<f64>,
    input_kind: Option<InputKind>,
    output_kind: Option<OutputKind>,
}

impl ResponseIdentification {
    /// Without further settings all frequencies of the response are analysed, and its input is the force itself.
    pub fn new() -> ResponseIdentification {
        ResponseIdentification::default()
    }

    /// Analyses only this band. The verdict covers modes and zeros in it.
    #[must_use]
    pub fn band_hz(mut self, low_hz: f64, high_hz: f64) -> ResponseIdentification {
        self.band_hz = Some((low_hz, high_hz));
        self
    }

    /// The input is a command that is held between its samples, so many of which are output per second, and the output is sampled at
    /// the same rate: hold and aliases are those of such samples.
    #[must_use]
    pub fn held_at_hz(mut self, rate_hz: f64) -> ResponseIdentification {
        self.held_at_hz = Some(rate_hz);
        self
    }

    /// A first-order lag lies between the input and the force, for example a current loop; 0: none does. Unless stated, a lag is fitted
    /// if modes do not describe the response without one.
    #[must_use]
    pub fn lag_s(mut self, lag_s: f64) -> ResponseIdentification {
        self.stated_lag_s = Some(lag_s);
        self
    }

    /// What the input is; see [`Identification::input_kind`](crate::Identification::input_kind).
    #[must_use]
    pub fn input_kind(mut self, kind: InputKind) -> ResponseIdentification {
        self.input_kind = Some(kind);
        self
    }

    /// The output is the position, the velocity or the acceleration of the stage. Without this, it is the position.
    #[must_use]
    pub fn output_kind(mut self, kind: OutputKind) -> ResponseIdentification {
        self.output_kind = Some(kind);
        self
    }

    /// Identifies a response with the standard deviations that it has. Points closer than its resolution, or with correlated errors, are
    /// left out of the fit ([`Frf::data`] of the result has the others).
    ///
    /// # Errors
    /// When no point lies in the band, the response reaches beyond half the rate of a held input, or the zeros cannot be computed.
    pub fn run(&self, frf: &Frf) -> Result<ResponseAnalysis, ResponseError> {
        let frf = self.within_band(frf)?;
        let input_path = self.input_path();
        let band_hz = frf.band_hz();
        let source = Source {
            rate_hz: self.held_at_hz.unwrap_or(ANALYSER_RATIO * band_hz.1),
            input_path,
            input_kind: self.input_kind,
            fits_lag: self.stated_lag_s.is_none(),
        };
        let output_kind = self.output_kind.unwrap_or_default();
        let assumed = source.chain(output_kind, &frf.data);
        let part = Part::of(&frf.data, &assumed);
        let with_few = Observation {
            source,
            frf: &frf,
            fit: part.few(),
            chain: &assumed,
            stated: self.output_kind,
            clear_kind: None,
            part: &part,
            output_step: None,
            remedies: &OF_RESPONSE,
        };
        let FirstFit {
            fit,
            chain,
            lag: first_lag,
            clear_kind,
            source,
        } = FirstFit::of(&with_few, true, || modal::fit(&frf.data, &assumed));
        let judged_up_to_rad_s = rad_s(band_hz.1);
        let observation = Observation {
            source,
            fit: &fit,
            chain: &chain,
            clear_kind,
            ..with_few
        };
        let known = known_cause(&observation);
        let has_complex_residues = fit
            .as_ref()
            .is_ok_and(|fit| !fit.parameters.has_real_residues());
        let other = match (&known, first_lag) {
            (None, None) if !has_complex_residues => {
                lag_model(&observation).or_else(|| complex_model(&observation))
            }
            _ => None,
        };
        let why = match other {
            Some(_) => None,
            None => known.or_else(|| implausible(&observation)),
        };
        let (fit, chain, lag) = match other {
            Some(OtherModel { fit, chain, lag }) => (Ok(fit), chain, lag),
            None => (fit, chain, first_lag),
        };
        let scope = VerdictScope::up_to(judged_up_to_rad_s);
        let verdict = judged(why, &frf, &fit, &chain, scope, |verdict| {
            response_hint(verdict, &fit)
        })?;
        let too_small = small_sigmas(&verdict, &fit, &frf);
        Ok(ResponseAnalysis {
            verdict: verdict
                .with(lag.map(|lag| lag.description()))
                .with(too_small),
            frf,
            fit,
            input_path: lag.map_or(input_path, |lag| lag.in_path(input_path)),
            fitted_lag: lag,
            input_kind: self.input_kind,
            output_kind,
            chain,
            band_hz,
            judged_up_to_rad_s,
        })
    }

    fn input_path(&self) -> InputPath {
        InputPath {
            hold_s: self.held_at_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz),
            lag_s: self.stated_lag_s.unwrap_or(0.0),
        }
    }

    /// The points in the band, with the independent ones as data.
    fn within_band(&self, frf: &Frf) -> Result<Frf, ResponseError> {
        let (low_hz, high_hz) = self.band_hz.unwrap_or((0.0, f64::INFINITY));
        if !(low_hz >= 0.0 && low_hz < high_hz) {
            return Err(ResponseError::Limits { low_hz, high_hz });
        }
        let mut within = frf.between_hz(low_hz, high_hz);
        let (first_hz, last_hz) = frf.band_hz();
        if within.is_empty() {
            let points = frf.len();
            return Err(ResponseError::NoPoint {
                low_hz,
                high_hz,
                points,
                first_hz,
                last_hz,
            });
        }
        let (_, last_hz) = within.band_hz();
        match self.held_at_hz {
            Some(rate_hz) if last_hz >= 0.5 * rate_hz => {
                return Err(ResponseError::BeyondHalfRate { last_hz, rate_hz });
            }
            _ => {}
        }
        within.data = independent(&within);
        Ok(within)
    }
}

/// Why a fit may seem not to describe the response: standard deviations far below its scatter.
fn small_sigmas(verdict: &Verdict, fit: &Result<ModalFit, FitError>, frf: &Frf) -> Option<String> {
    let chi2 = fit.as_ref().ok()?.chi2_per_freedom;
    if verdict.cnmp != Cnmp::Undecided || chi2 <= MAX_CHI2_PER_FREEDOM {
        return None;
    }
    let scatter = Scatter::of(&frf.frequency_hz, &frf.response)?;
    let sigmas = frf.magnitude_sigma.iter().zip(&scatter.variance);
    let mut ratios: Vec<f64> = sigmas
        .map(|(sigma, variance)| sigma / (0.5 * variance).sqrt())
        .collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    (median < TOO_SMALL).then(|| {
        format!(
            "the standard deviations of the file are only {median:.2} times the scatter of the response; leave out their column if they are not those of this response, so that they are estimated from the scatter"
        )
    })
}

#[cfg(test)]
mod tests;

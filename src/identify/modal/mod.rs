//! From the measured response to the modes: how many, where, how damped, with which residue, and how sure.
//!
//! ```text
//! frf_data of bins --search--> orders 1, 2, ... by evidence --noise from what is left--> refine --> modes, R, tau, covariance
//! ```
//!
//! The model is the plant's own form, G(s) = R + sum of r_k/(s^2 + 2 zeta_k w_k s + w_k^2) (Eq. 3-2) with real residues, seen
//! through hold, amplifier and delays ([`MeasurementChain`]). So every parameter is one of the mechanics, no pole is one of the
//! computation, and nothing is expanded into a polynomial.
//!
//! The noise is first that of the estimator, then what the fit leaves over around each block: where the model misses
//! something, the errors grow with it.

mod merged;
mod normal;
mod refine;
mod response;
mod search;
mod view;

use nalgebra::DMatrix;

pub use refine::Parameters;
pub use response::UncertainPole;
pub use search::ModelOrder;
pub use view::MeasurementChain;

use crate::identify::FrfDatum;
use crate::model::plant::Sign;
pub(crate) use refine::Entry;
use refine::{Seen, covariance, refine};

/// Blocks to either side over which the noise is averaged: 64 degrees of freedom a side.
const NOISE_BLOCKS: usize = 32;

/// A response that shows no modes.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Nothing stands out.
    #[error(
        "no mode stands out of the noise between {low_hz:.3} and {high_hz:.3} Hz; excite more, or for longer, or look whether the probe sees the stage"
    )]
    NoMode {
        /// Lowest frequency.
        low_hz: f64,
        /// Highest frequency.
        high_hz: f64,
    },
    /// Fewer data than parameters.
    #[error("{frf_data} frequencies do not determine a mode; record for longer or widen the band")]
    TooFew {
        /// How many there are.
        frf_data: usize,
    },
    /// The parameters cannot be told apart.
    #[error(
        "the response does not tell the parameters of {modes} modes apart; record for longer or excite more"
    )]
    Undetermined {
        /// How many modes were found.
        modes: usize,
    },
}

/// Standard deviations to either side that hold 95 % of a normal distribution.
pub const SIGMAS_95: f64 = 1.959_963_984_540_054;

/// A number with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
}

impl Estimate {
    /// The same in another unit.
    pub fn scaled(self, factor: f64) -> Estimate {
        Estimate {
            value: self.value * factor,
            sigma: self.sigma * factor.abs(),
        }
    }

    /// Probability that a number of a normal distribution is below zero.
    pub fn below_zero_probability(self) -> f64 {
        0.5 * libm::erfc(self.value / (self.sigma * std::f64::consts::SQRT_2))
    }
}

/// One mode as fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FittedMode {
    /// Undamped natural frequency in rad/s; exactly 0 of a free body.
    pub omega_rad_s: Estimate,
    /// Damping ratio.
    pub damping_ratio: Estimate,
    /// Residue in 1/kg.
    pub residue_per_kg: Estimate,
}

impl FittedMode {
    /// Probability that the residue has the other sign, for errors of a normal distribution.
    pub fn sign_error_probability(&self) -> f64 {
        Estimate {
            value: self.residue_per_kg.value.abs(),
            ..self.residue_per_kg
        }
        .below_zero_probability()
    }

    /// The sign of its residue.
    pub fn sign(&self) -> char {
        Sign::of(self.residue_per_kg.value).symbol()
    }

    /// Undamped natural frequency in hertz.
    pub fn frequency_hz(&self) -> Estimate {
        self.omega_rad_s.scaled(0.5 * std::f64::consts::FRAC_1_PI)
    }
}

/// The modes that a response shows.
#[derive(Clone, Debug, PartialEq)]
pub struct ModalFit {
    /// The parameters, slowest mode first.
    pub parameters: Parameters,
    /// Covariance of w (rad/s), zeta, r (1/kg) of each mode (of a free body r alone), of R (m/N) and tau (s), in that order.
    pub covariance: DMatrix<f64>,
    /// All orders that were found worth it, for the stability chart.
    pub orders: Vec<ModelOrder>,
    /// chi^2 over its degrees of freedom by the estimator's own noise: 1 where the model explains all but noise.
    pub chi2_per_freedom: f64,
    /// Frequencies that were fitted, in hertz.
    pub band_hz: (f64, f64),
}

/// Fits modes to the frf_data of a record, as many as there is evidence for.
pub fn fit(frf_data: &[FrfDatum], view: &MeasurementChain<'_>) -> Result<ModalFit, FitError> {
    let [first, .., last] = frf_data else {
        return Err(FitError::TooFew {
            frf_data: frf_data.len(),
        });
    };
    let band_hz = (first.frequency_hz, last.frequency_hz);
    let orders = search::orders(view, frf_data);
    let best = orders.last().ok_or(FitError::NoMode {
        low_hz: band_hz.0,
        high_hz: band_hz.1,
    })?;
    let mut start = best.parameters.clone();
    start
        .modes
        .sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
    let frf_data = &merged::merged(frf_data, &start);
    if 2 * frf_data.len() <= start.entries().len() {
        return Err(FitError::TooFew {
            frf_data: frf_data.len(),
        });
    }
    let start = search::without_the_needless(start, view, frf_data);
    let seen = Seen::of(&start, view, frf_data);
    let chi2_per_freedom = seen.chi2 / (2 * frf_data.len() - start.entries().len()) as f64;
    let frf_data = with_noise_of(&seen, frf_data, start.entries().len());
    let (parameters, seen) = refine(start, view, &frf_data, 0.0);
    let modes = parameters.modes.len();
    let covariance =
        covariance(&parameters, &seen, &frf_data).ok_or(FitError::Undetermined { modes })?;
    Ok(ModalFit {
        covariance,
        chi2_per_freedom,
        orders,
        parameters,
        band_hz,
    })
}

/// The frf_data with the noise that a fit of `parameters` leaves over: the mean of |e|^2/v around each.
fn with_noise_of(seen: &Seen, frf_data: &[FrfDatum], parameters: usize) -> Vec<FrfDatum> {
    let freedom = 1.0 - parameters as f64 / (2 * frf_data.len()) as f64;
    let ratio: Vec<f64> = seen
        .left
        .iter()
        .zip(frf_data)
        .map(|(e, b)| e.norm_sqr() / b.variance / freedom)
        .collect();
    let around = |b: usize| {
        let near = &ratio[b.saturating_sub(NOISE_BLOCKS)..(b + NOISE_BLOCKS + 1).min(ratio.len())];
        near.iter().sum::<f64>() / near.len() as f64
    };
    frf_data
        .iter()
        .enumerate()
        .map(|(b, block)| FrfDatum {
            variance: block.variance * around(b),
            ..*block
        })
        .collect()
}

impl ModalFit {
    /// The modes with their errors, slowest first.
    pub fn modes(&self) -> Vec<FittedMode> {
        let entries = self.parameters.entries();
        let sigma = |wanted: Entry| {
            entries
                .iter()
                .position(|entry| *entry == wanted)
                .map_or(0.0, |i| self.covariance[(i, i)].sqrt())
        };
        let of = |(k, term): (usize, &crate::model::zeros::ModalTerm)| FittedMode {
            omega_rad_s: Estimate {
                value: term.omega_rad_s,
                sigma: sigma(Entry::Omega(k)),
            },
            damping_ratio: Estimate {
                value: term.damping_ratio,
                sigma: sigma(Entry::Damping(k)),
            },
            residue_per_kg: Estimate {
                value: term.residue_per_kg,
                sigma: sigma(Entry::Residue(k)),
            },
        };
        self.parameters.modes.iter().enumerate().map(of).collect()
    }

    /// How much later than its view the plant answers, in seconds.
    pub fn delay_s(&self) -> Estimate {
        let last = self.covariance.nrows() - 1;
        Estimate {
            value: self.parameters.delay_s,
            sigma: self.covariance[(last, last)].sqrt(),
        }
    }
}

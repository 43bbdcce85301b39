//! From recorded signals to a frequency response function (FRF) with standard deviations, its modes, and a verdict.
//!
//! ```text
//! Signals -> drift removed -> FFT of the whole record -> local models of neighbouring bins -> Frf -> CSV, plots
//!                                                                                    '--> its data -> modal -> verdict
//! ```
//!
//! | to find | look in |
//! |---|---|
//! | two signals, all steps with the default settings | [`Identification`] |
//! | the same of a closed loop with its reference | [`Identification::run_with_reference`] |
//! | a response of another program, in any unit | [`ResponseIdentification`] |
//! | the default estimator, for records that begin and end at rest | [`local`] |
//! | the same without smoothing, for a fit | [`Frf::data`] |
//! | plant, loop gain and sensitivities of a stage in closed loop | [`joint`] |
//! | the estimator that the configuration selects | [`response`] |
//! | the response while a run goes on | [`GrowingResponse`] |
//! | defects of an external record | [`record_check`] |
//! | an output with steps above its noise, or with samples that are no readings | [`ReadingsFit`] |
//! | the band that an input excites | [`excited_band_hz`] |
//! | averages of repetitions, of periods, of segments | [`repeated`], [`periodic`], [`welch`] |
//! | the periods in which a plant settles | [`settling`] |
//! | distortion, odd and even, separated from noise | [`harmonics`], [`linearity`], [`with_distortion`] |
//! | readings and set-points of irregular times | [`resampling`], [`setpoint_timing`] |
//! | the excess delay of a response over its model | [`delay`] |
//! | standard deviations of a response that has none | [`scatter`] |
//! | modes with confidence intervals | [`modal`] |
//! | whether there are CNMP zeros | [`verdict`] |
//! | FRFs as CSV | [`frf_csv`] |
//!
//! Sign convention of all estimators: y = H u, so a lag of the output is a negative phase.

#![deny(unsafe_code)]

mod band;
mod changed_modes;
mod chi2_limits;
mod clock_skew;
mod complex_residues;
pub mod delay;
mod error;
mod estimator;
mod excited_band;
mod external_analysis;
mod external_signals;
mod external_verdict;
mod fft;
mod first_fit;
mod fitted_lag;
mod frf;
pub mod frf_csv;
pub mod frf_value;
mod growing;
mod identification;
mod identify_response;
mod in_time;
mod independent;
mod local_model;
mod mean;
pub mod modal;
mod multisine_lines;
mod noise_parts;
mod observation;
mod other_kind;
mod part;
mod periodic_part;
mod plausibility;
mod prepared;
mod profile;
pub mod record_check;
mod remedies;
pub mod repeated;
pub mod scatter;
mod settings;
mod signals;
mod static_sign;
mod steady_input;
mod sweep_harmonics;
mod timing;
pub mod verdict;
pub mod welch;

pub use bench_base::estimate::{Estimate, SIGMAS_95};
pub use bench_plant::{InputKind, OutputKind};
pub use clock_skew::ClockSkew;
pub use error::{BandError, IdentifyError, Signal, SignalsError};
pub use excited_band::excited_band_hz;
pub use external_analysis::ExternalAnalysis;
pub use fitted_lag::FittedLag;
pub use frf::{Frf, FrfDatum, FrfPoint, PHASE_SIGMA_LIMIT_RAD, Unit, best_of, wrapped_phase_rad};
pub use growing::{GrowingPoint, GrowingResponse};
pub use identification::{Identification, IdentificationError};
pub use identify_response::{ResponseAnalysis, ResponseError, ResponseIdentification};
pub use in_time::ReadingsFit;
pub use local_model::{joint, local};
pub use multisine_lines::distortion::{distortion_ratio, with_distortion};
pub use multisine_lines::{harmonics, linearity, periodic, settling};
pub(crate) use noise_parts::{NoiseParts, PowerDatum};
pub use periodic_part::{Distortion, DistortionSource, PeriodicPart};
pub use settings::{Estimator, EstimatorSettings, IdentifySettings, LocalModel, ResolutionPoint};
pub use signals::Signals;
pub use static_sign::StaticSign;
pub use sweep_harmonics::SweepHarmonic;
pub use timing::{resampling, setpoint_timing};

/// The frequency response by the estimator that the configuration selects, with its data for a fit.
///
/// # Errors
/// Those of the estimator, and [`IdentifyError::NotExcited`] if there are no data for a fit.
pub fn response(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &IdentifySettings,
) -> Result<Frf, IdentifyError> {
    match settings {
        IdentifySettings::Local(local) => {
            local::estimate(signals, band_hz, local)?.with_data(band_hz)
        }
        IdentifySettings::Welch {
            segment_s,
            estimator,
        } => {
            let segment = libm::round(segment_s * signals.rate_hz) as usize;
            let frf = welch::estimate(signals, band_hz, segment, *estimator)?;
            let data = local_model::frf_data::frf_data(signals, band_hz, &settings.local())?;
            Frf { data, ..frf }.with_data(band_hz)
        }
    }
}

//! Identification of a plant in closed loop from reference, command and position (joint input-output method).
//!
//! ```text
//! y = P u + v,    u = C (r - y)         v: noise and disturbance of the position
//! ```
//!
//! The command contains the controller's response to the noise, so that H1 from u to y is biased towards -1/C wherever the
//! noise is strong. The reference is independent of the noise and serves as the instrument (Söderström, Stoica, System
//! Identification, 1989, section 8; joint input-output with a known reference: van den Hof, Automatica 34, 1998):
//!
//! ```text
//! T = Y/R,  S = E/R with E = R - Y       P = (Y/R)/(U/R)       L = (Y/R)/(E/R)
//! ```
//!
//! Each ratio by R is a local model of [`super::local`] of the bins of the whole record. Where the loop gain is high, U has
//! the plant's poles as zeros, which a local model can follow, and the quotient has no peak.
//!
//! **Confidence.** Noise v is S v in the position, and -X v in an input whose response to the reference is X. With g the
//! weights of the models (g_0 = sum g_k Y_k), P_k the ratio of the models at a bin and e the residuals,
//!
//! ```text
//! E|error of P|^2 = S_v sum |g_k(Y) S_k + P_0 g_k(U) X_k|^2/|X_0|^2
//! v_k = e_k(Y) - P_k e_k(U),             E|v_k|^2 = S_v Re(1 - l_k(Y) S_k - l_k(U) T_k)
//! ```
//!
//! where the second line, with l the leverage of a bin, gives the power S_v of the noise from the residuals around the
//! position.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::frf_data::of_spectra;
use super::local::{collect, h1};
use super::model;
use super::record_spectra::RecordSpectra;
use super::spectra::{Place, Spectra};
use super::window::{FittedModel, LocalFit, Window};
use crate::fft::RealFft;
use crate::{EstimatorSettings, Frf, IdentifyError, Signals, SignalsError, band};

/// Reference, command and position of a closed loop: one sample per tick.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSignals {
    /// Command and position.
    pub signals: Signals,
    /// Reference in metres.
    pub reference_m: Vec<f64>,
}

/// The responses of a closed loop.
#[derive(Clone, Debug, PartialEq)]
pub struct JointEstimate {
    /// P, from command (A) to position (m), with its data for a fit.
    pub plant: Frf,
    /// T = P C/(1 + P C), from reference to position.
    pub complementary: Frf,
    /// S = 1/(1 + P C), from reference to error.
    pub sensitivity: Frf,
    /// L = P C, from error to position.
    pub loop_gain: Frf,
}

/// P, T, S and L at the frequencies of `band_hz` that the reference excites. The reference has no noise; the setting
/// `estimator` is not used.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
pub fn estimate(
    loop_signals: &LoopSignals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<JointEstimate, IdentifyError> {
    let signals = &loop_signals.signals;
    settings.check()?;
    signals.check()?;
    check_reference(loop_signals.reference_m.len(), signals.len())?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    estimate_bins(
        &ReferenceResponses::new(loop_signals),
        &bins,
        band_hz,
        settings,
    )
}

/// Checks that the reference has as many samples as the signals.
fn check_reference(reference: usize, signals: usize) -> Result<(), SignalsError> {
    if reference == signals {
        Ok(())
    } else {
        Err(SignalsError::ReferenceLength { reference, signals })
    }
}

fn estimate_bins(
    responses: &ReferenceResponses,
    bins: &RangeInclusive<usize>,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<JointEstimate, IdentifyError> {
    let (position, error) = (&responses.position, &responses.error);
    let positions = settings.positions(bins, band_hz, position.bin_hz());
    let plant = responses.position_over(&responses.command);
    let loop_gain = responses.position_over(error);
    let plant = Frf {
        data: of_spectra(&plant, bins, settings),
        ..collect(h1(&plant, &positions, settings))
    };
    Ok(JointEstimate {
        plant: plant.with_data(band_hz)?,
        complementary: collect(h1(position, &positions, settings)),
        sensitivity: collect(h1(error, &positions, settings)),
        loop_gain: collect(h1(&loop_gain, &positions, settings)),
    })
}

/// The signals of the loop, each as a record with the reference as its input.
struct ReferenceResponses {
    command: RecordSpectra,
    position: RecordSpectra,
    error: RecordSpectra,
}

impl ReferenceResponses {
    fn new(
        LoopSignals {
            signals,
            reference_m,
        }: &LoopSignals,
    ) -> Self {
        let fft = RealFft::new(signals.len());
        let reference = fft.below_nyquist(reference_m.clone());
        let command = fft.below_nyquist(signals.input.clone());
        let position = fft.below_nyquist(signals.output.clone());
        let difference = reference.iter().zip(&position).map(|(r, y)| r - y);
        let error = difference.collect();
        let bin_hz = signals.rate_hz / signals.len() as f64;
        let [command, position, error] = [command, position, error]
            .map(|output| RecordSpectra::new(reference.clone(), output, bin_hz));
        Self {
            command,
            position,
            error,
        }
    }

    fn position_over<'a>(&'a self, input: &'a RecordSpectra) -> Ratio<'a> {
        Ratio {
            input,
            output: &self.position,
        }
    }
}

/// The response from one signal to the position, with the reference as the instrument.
struct Ratio<'a> {
    input: &'a RecordSpectra,
    output: &'a RecordSpectra,
}

impl Spectra for Ratio<'_> {
    fn bin_hz(&self) -> f64 {
        self.output.bin_hz()
    }

    fn last_bin(&self) -> usize {
        self.output.last_bin()
    }

    fn fit(
        &self,
        place: Place,
        settings: &EstimatorSettings,
        max_poles: usize,
    ) -> Option<LocalFit> {
        let input = Side::fit(self.input, place, settings, max_poles)?;
        let output = Side::fit(self.output, place, settings, max_poles)?;
        ratio_fit(&input, &output)
    }

    fn input_cross(&self, bin: usize) -> Complex<f64> {
        self.input.output_cross(bin)
    }

    fn output_cross(&self, bin: usize) -> Complex<f64> {
        self.output.output_cross(bin)
    }

    fn instrument_power(&self, bin: usize) -> f64 {
        self.output.instrument_power(bin)
    }
}

/// The response of one signal to the reference around a position.
struct Side {
    window: Window,
    model: FittedModel,
}

impl Side {
    fn fit(
        spectra: &RecordSpectra,
        place: Place,
        settings: &EstimatorSettings,
        max_poles: usize,
    ) -> Option<Side> {
        let window = spectra.window(place);
        Some(Side {
            model: model::fit(&window, settings, max_poles)?,
            window,
        })
    }

    /// The response to the reference at a bin, by the model.
    fn response(&self, j: usize) -> Complex<f64> {
        let Window {
            root_weight,
            input,
            output,
            ..
        } = &self.window;
        (output[j] * root_weight[j] - self.model.linear.residual[j]) / (input[j] * root_weight[j])
    }
}

/// Contribution of one bin to a ratio, or the sum over bins.
#[derive(Default)]
struct Contribution {
    /// |error of the ratio, times X_0|^2 for noise of power 1, weighted.
    noise_gain: f64,
    /// |v|^2, weighted.
    residual_power: f64,
    /// E|v|^2 for noise of power 1, weighted.
    freedom: f64,
}

/// Output over input by the models of both: see the module.
fn ratio_fit(input: &Side, output: &Side) -> Option<LocalFit> {
    let (denominator, numerator) = (input.model.fit, output.model.fit);
    let response = numerator.response / denominator.response;
    let sum = Contribution::over_bins(input, output, response);
    let noise_gain = sum.noise_gain / denominator.response.norm_sqr();
    let valid = noise_gain.is_finite() && sum.residual_power.is_finite() && sum.freedom > 0.0;
    valid.then_some(LocalFit {
        response,
        noise_gain,
        residual_power: sum.residual_power,
        freedom: sum.freedom,
        ..numerator
    })
}

impl Contribution {
    /// The sum over the bins that have a reference.
    fn over_bins(input: &Side, output: &Side, ratio: Complex<f64>) -> Contribution {
        let reference = &output.window.input;
        let mut sum = Contribution::default();
        for j in (0..reference.len()).filter(|j| reference[*j].norm_sqr() > 0.0) {
            let bin = Contribution::of_bin(input, output, ratio, j);
            sum.noise_gain += bin.noise_gain;
            sum.residual_power += bin.residual_power;
            sum.freedom += bin.freedom;
        }
        sum
    }

    fn of_bin(input: &Side, output: &Side, ratio: Complex<f64>, j: usize) -> Contribution {
        let weight = output.window.root_weight[j] * output.window.root_weight[j];
        let (x, t) = (input.response(j), output.response(j));
        let s = -t + 1.0;
        let (input, output) = (&input.model.linear, &output.model.linear);
        let error = output.gradient[j] * s + ratio * input.gradient[j] * x;
        let residual = output.residual[j] - t / x * input.residual[j];
        let leverage = (s * output.leverage[j] + t * input.leverage[j]).re;
        Contribution {
            noise_gain: weight * error.norm_sqr(),
            residual_power: residual.norm_sqr(),
            freedom: weight * (1.0 - leverage),
        }
    }
}

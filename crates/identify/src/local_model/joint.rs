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
//!
//! **A record of another program** ([`plant()`]) has a reference that enters the loop anywhere: as a set-point, or as an excitation that
//! is added to the command. Then S does not follow from T, but v = Y - P U is the same. A part s v of it is in the output, and
//! -(1 - s) v/P in the input; s is found from the residuals of both models, s = sum e(Y) conj(v)/sum |v|^2. (With s = S the formulas
//! above follow.)
//!
//! The noise may also be as large as a tenth of the reference there. In a single bin the ratio of Y conj(R) to U conj(R) is Y/U, without
//! bias as long as the noise is circular; but weights that contain |U|^2 would make the sum over the bins of a fit that of H1, with its
//! bias. They contain in place of U its prediction from the reference and the bins around, without the bin itself. Data in which the
//! noise of U exceeds a third of the prediction are omitted.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::frf_data::of_spectra;
use super::local::{collect, h1};
use super::model;
use super::noise_floor::MORE_POLES;
use super::record_spectra::RecordSpectra;
use super::spectra::{ExpectedInput, Place, Spectra};
use super::window::{FittedModel, LocalFit, Window};
use crate::fft::RealFft;
use crate::{EstimatorSettings, Frf, IdentifyError, Signals, band};

/// Number of windows in a half-width from which the input of single bins is predicted.
const PREDICTIONS: f64 = 4.0;
/// A bin with a larger leverage is predicted as one with this: the others do not determine it.
const MAX_LEVERAGE: f64 = 0.5;

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
    signals.check_reference_length(&loop_signals.reference_m)?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    estimate_bins(
        &ReferenceResponses::new(loop_signals),
        &bins,
        band_hz,
        settings,
    )
}

/// G = S_yr/S_ur, from input to output, at the frequencies of `band_hz` where the reference r determines the input, with its data for a
/// fit. The signals may have any units. The reference has no noise: it is independent of that of input and output. It may enter the loop
/// anywhere, as a set-point or added to the input, which is the whole signal that acts on the plant. The setting `estimator` is not used.
///
/// # Errors
/// When signals, reference, band or settings allow no estimate: see [`IdentifyError`].
pub fn plant(
    signals: &Signals,
    reference: &[f64],
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Frf, IdentifyError> {
    settings.check()?;
    signals.check()?;
    signals.check_reference(reference)?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let fft = RealFft::new(signals.len());
    let bin_hz = signals.rate_hz / signals.len() as f64;
    let [reference, input, output] = signals
        .without_steps(reference)
        .map(|samples| fft.below_nyquist(samples));
    let [input, output] =
        [input, output].map(|signal| RecordSpectra::new(reference.clone(), signal, bin_hz));
    let ratio = Ratio {
        input: &input,
        output: &output,
        entry: Entry::Anywhere,
    };
    let frf = frf_of(&ratio, &bins, band_hz, settings);
    frf.with_data(band_hz)
        .map_err(|_| IdentifyError::weak_reference(band_hz))
}

/// The response of a ratio with its data for a fit.
fn frf_of(
    ratio: &Ratio<'_>,
    bins: &RangeInclusive<usize>,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Frf {
    let positions = settings.positions(bins, band_hz, ratio.bin_hz());
    Frf {
        data: of_spectra(ratio, bins, settings),
        ..collect(h1(ratio, &positions, settings))
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
    let plant = frf_of(&plant, bins, band_hz, settings);
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
            entry: Entry::SetPoint,
        }
    }
}

/// Where the reference enters the loop.
#[derive(Clone, Copy, PartialEq)]
enum Entry {
    /// As the set-point of u = C (r - y), far above the noise in every bin.
    SetPoint,
    /// Anywhere, and not far above the noise.
    Anywhere,
}

/// The response from one signal to another, with the reference as the instrument.
struct Ratio<'a> {
    input: &'a RecordSpectra,
    output: &'a RecordSpectra,
    entry: Entry,
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
        ratio_fit(&input, &output, self.entry)
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

    fn expected_inputs(
        &self,
        bins: &RangeInclusive<usize>,
        settings: &EstimatorSettings,
    ) -> Vec<ExpectedInput> {
        if self.entry == Entry::Anywhere {
            return predicted_inputs(self.input, bins, settings);
        }
        let crosses = bins.clone().map(|k| self.input_cross(k));
        crosses.map(ExpectedInput::exact).collect()
    }
}

/// The input of each bin as the bins around it predict it.
fn predicted_inputs(
    input: &RecordSpectra,
    bins: &RangeInclusive<usize>,
    settings: &EstimatorSettings,
) -> Vec<ExpectedInput> {
    let (mut inputs, mut first) = (Vec::new(), *bins.start());
    while first <= *bins.end() {
        let half_width = settings.half_width(first as f64, input.bin_hz());
        let count = (half_width / PREDICTIONS).max(1.0) as usize;
        let last = (first + count - 1).min(*bins.end());
        let place = Place {
            position: 0.5 * (first + last) as f64,
            half_width,
        };
        let side = Side::fit(input, place, settings, MORE_POLES);
        let predicted = |bin| side.as_ref()?.predicted(bin);
        inputs.extend((first..=last).map(|bin| predicted(bin).unwrap_or_default()));
        first = last + 1;
    }
    inputs
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

    /// The signal in a bin of the spectrum as the other bins of the window predict it.
    ///
    /// The residual of a bin that is left out of a linear fit is e/(1 - l), with l the leverage of the bin.
    fn predicted(&self, bin: usize) -> Option<ExpectedInput> {
        let j = bin.checked_sub(self.window.first_bin)?;
        let root_weight = *self.window.root_weight.get(j)?;
        let linear = &self.model.linear;
        let leverage = linear.leverage[j].min(MAX_LEVERAGE);
        let left_out = linear.residual[j] / ((1.0 - leverage) * root_weight);
        Some(ExpectedInput {
            cross: (self.window.output[j] - left_out) * self.window.input[j].conj(),
            noise_power: self.model.fit.residual_power / self.model.fit.freedom,
        })
    }

    /// The bins that have a reference.
    fn excited(&self) -> impl Iterator<Item = usize> {
        let reference = self.window.input.iter().enumerate();
        reference
            .filter(|(_, r)| r.norm_sqr() > 0.0)
            .map(|(j, _)| j)
    }
}

/// The noise of both signals in a bin, as ratios of v.
#[derive(Clone, Copy)]
struct NoiseShare {
    output: Complex<f64>,
    /// That of the input with the opposite sign.
    input: Complex<f64>,
}

impl NoiseShare {
    /// Of u = C (r - y) with the responses of input and output to the reference.
    fn of_set_point(x: Complex<f64>, t: Complex<f64>) -> NoiseShare {
        NoiseShare {
            output: -t + 1.0,
            input: x,
        }
    }

    /// With the part of v in the output, and the responses of input and output to the reference.
    fn of_output(part: Complex<f64>, x: Complex<f64>, t: Complex<f64>) -> NoiseShare {
        NoiseShare {
            output: part,
            input: (-part + 1.0) * x / t,
        }
    }
}

/// s = sum e(Y) conj(v)/sum |v|^2, the part of the noise that is in the output; all of it if there is no noise.
fn output_part(input: &Side, output: &Side) -> Complex<f64> {
    let (mut product, mut power) = (Complex::default(), 0.0);
    for j in output.excited() {
        let of_output = output.model.linear.residual[j];
        let ratio = output.response(j) / input.response(j);
        let noise = of_output - ratio * input.model.linear.residual[j];
        product += of_output * noise.conj();
        power += noise.norm_sqr();
    }
    let part = product / power;
    let is_finite = part.re.is_finite() && part.im.is_finite();
    if is_finite { part } else { Complex::from(1.0) }
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
fn ratio_fit(input: &Side, output: &Side, entry: Entry) -> Option<LocalFit> {
    let (denominator, numerator) = (input.model.fit, output.model.fit);
    let response = numerator.response / denominator.response;
    let sum = Contribution::over_bins(input, output, response, entry);
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
    fn over_bins(input: &Side, output: &Side, ratio: Complex<f64>, entry: Entry) -> Contribution {
        let part = output_part(input, output);
        let mut sum = Contribution::default();
        for j in output.excited() {
            let (x, t) = (input.response(j), output.response(j));
            let share = match entry {
                Entry::SetPoint => NoiseShare::of_set_point(x, t),
                Entry::Anywhere => NoiseShare::of_output(part, x, t),
            };
            let bin = Contribution::of_bin(input, output, ratio, share, j);
            sum.noise_gain += bin.noise_gain;
            sum.residual_power += bin.residual_power;
            sum.freedom += bin.freedom;
        }
        sum
    }

    fn of_bin(
        input: &Side,
        output: &Side,
        ratio: Complex<f64>,
        share: NoiseShare,
        j: usize,
    ) -> Contribution {
        let weight = output.window.root_weight[j] * output.window.root_weight[j];
        let (x, t) = (input.response(j), output.response(j));
        let (input, output) = (&input.model.linear, &output.model.linear);
        let error = output.gradient[j] * share.output + ratio * input.gradient[j] * share.input;
        let residual = output.residual[j] - t / x * input.residual[j];
        let in_input = -share.output + 1.0;
        let leverage = (share.output * output.leverage[j] + in_input * input.leverage[j]).re;
        Contribution {
            noise_gain: weight * error.norm_sqr(),
            residual_power: residual.norm_sqr(),
            freedom: weight * (1.0 - leverage),
        }
    }
}

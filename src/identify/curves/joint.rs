//! Identification of a plant under control: reference, command and position together.
//!
//! ```text
//! y = P u + v,    u = C (r - y)         v: what noise and disturbance leave in the position
//! ```
//!
//! The command answers the noise, so that H1 from u to y leans towards -1/C wherever the noise is strong. The reference knows
//! nothing of it, and is the instrument (Söderström, Stoica, System Identification, 1989, section 8; joint input-output with
//! a known reference: van den Hof, Automatica 34, 1998):
//!
//! ```text
//! T = Y/R,  S = E/R with E = R - Y       P = (Y/R)/(U/R)       L = (Y/R)/(E/R)
//! ```
//!
//! each ratio by R a curve of [`super::local`] through the bins of the whole record. Where the loop is tight, U has the plant's
//! poles as zeros, which a curve follows, and what is divided has no peak.
//!
//! **Confidence.** Noise v is S v in the position, and -X v in an input whose response to the reference is X. With g the weights of the
//! curves (g_0 = sum g_k Y_k), P_k the ratio of the curves at a bin and e the residuals,
//!
//! ```text
//! E|error of P|^2 = S_v sum |g_k(Y) S_k + P_0 g_k(U) X_k|^2/|X_0|^2
//! v_k = e_k(Y) - P_k e_k(U),             E|v_k|^2 = S_v Re(1 - l_k(Y) S_k - l_k(U) T_k)
//! ```
//!
//! where the last, with l the share of a bin in its own fit, gives the power S_v of the noise from what is left over around the place.

use nalgebra::Complex;

use super::bins::Bins;
use super::curve::{self, Drawn, Fitted, Window};
use super::frf_data;
use super::local::{collected, forward};
use super::record::Record;
use crate::identify::spectrum::{RealFft, Spectra};
use crate::identify::{EstimatorSettings, Frf, FrfDatum, IdentifyError, Signals, band};

/// Reference, command and position of a loop that was closed: one sample a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopSignals {
    /// Command and position.
    pub signals: Signals,
    /// Reference in metres.
    pub reference_m: Vec<f64>,
}

/// What they show.
#[derive(Clone, Debug, PartialEq)]
pub struct JointEstimate {
    /// P, from command (A) to position (m).
    pub plant: Frf,
    /// The same without smoothing, for a fit.
    pub frf_data: Vec<FrfDatum>,
    /// T = P C/(1 + P C), from reference to position.
    pub complementary: Frf,
    /// S = 1/(1 + P C), from reference to error.
    pub sensitivity: Frf,
    /// L = P C, from error to position.
    pub loop_gain: Frf,
}

/// P, T, S and L at the frequencies of `band_hz` at which the reference moved. The reference has no noise: which signal has, of
/// the settings, does not count.
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
    let (input, output) = (loop_signals.reference_m.len(), signals.len());
    if input != output {
        return Err(IdentifyError::Lengths { input, output });
    }
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let Answers {
        command,
        position,
        error,
    } = Answers::of(loop_signals);
    let places = settings.places(&bins, band_hz, position.bin_hz());
    let (low_hz, high_hz) = band_hz;
    let plant = Instrumental {
        input: &command,
        output: &position,
    };
    let loop_gain = Instrumental {
        input: &error,
        output: &position,
    };
    let joint = JointEstimate {
        plant: collected(forward(&plant, &places, settings)),
        frf_data: frf_data::cut(&plant, &bins, settings),
        complementary: collected(forward(&position, &places, settings)),
        sensitivity: collected(forward(&error, &places, settings)),
        loop_gain: collected(forward(&loop_gain, &places, settings)),
    };
    if joint.frf_data.is_empty() {
        Err(IdentifyError::NotExcited { low_hz, high_hz })
    } else {
        Ok(joint)
    }
}

/// What answers the reference, each a record with the reference as its input.
struct Answers {
    command: Record,
    position: Record,
    error: Record,
}

impl Answers {
    fn of(
        LoopSignals {
            signals,
            reference_m,
        }: &LoopSignals,
    ) -> Answers {
        let fft = RealFft::new(signals.len());
        let of = |samples: &[f64]| {
            let mut spectrum = fft.transform(&mut samples.to_vec());
            spectrum.truncate(band::last_bin(signals.len()) + 1);
            spectrum
        };
        let reference = of(reference_m);
        let by_reference = |output| {
            Record::of(
                Spectra {
                    input: reference.clone(),
                    output,
                },
                signals.rate_hz / signals.len() as f64,
            )
        };
        let position = of(&signals.output_m);
        let error = reference
            .iter()
            .zip(&position)
            .map(|(r, y)| r - y)
            .collect();
        Answers {
            command: by_reference(of(&signals.input_a)),
            position: by_reference(position),
            error: by_reference(error),
        }
    }
}

/// The response from one signal to the position, with the reference as instrument.
struct Instrumental<'a> {
    input: &'a Record,
    output: &'a Record,
}

impl Bins for Instrumental<'_> {
    fn bin_hz(&self) -> f64 {
        self.output.bin_hz()
    }

    fn last_bin(&self) -> usize {
        self.output.last_bin()
    }

    fn fit(&self, place: f64, half_width: f64, settings: &EstimatorSettings) -> Option<Fitted> {
        let side = |record: &Record| {
            let window = record.window(place, half_width);
            Some(Side {
                drawn: curve::fit(&window, settings)?,
                window,
            })
        };
        ratio(&side(self.input)?, &side(self.output)?)
    }

    fn drive(&self, bin: usize) -> Complex<f64> {
        self.input.cross(bin)
    }

    fn cross(&self, bin: usize) -> Complex<f64> {
        self.output.cross(bin)
    }

    fn power(&self, bin: usize) -> f64 {
        self.output.power(bin)
    }
}

/// What answers the reference around a place.
struct Side {
    window: Window,
    drawn: Drawn,
}

impl Side {
    /// The response to the reference at a bin, by the curve.
    fn response(&self, j: usize) -> Complex<f64> {
        let Window {
            root,
            input,
            output,
            ..
        } = &self.window;
        (output[j] * root[j] - self.drawn.squares.residual[j]) / (input[j] * root[j])
    }
}

/// One bin's part in a ratio.
struct Part {
    /// Error of the ratio, times X_0, for noise of 1.
    error: Complex<f64>,
    /// v, weighted.
    left: Complex<f64>,
    /// E|v|^2 for noise of power 1, without its weight.
    freedom: f64,
}

/// Position over input, by the curves of both: see the module.
fn ratio(input: &Side, output: &Side) -> Option<Fitted> {
    let (below, above) = (input.drawn.fitted, output.drawn.fitted);
    let response = above.response / below.response;
    let root = &output.window.root;
    let sum = |of: &dyn Fn(&Part, f64) -> f64| -> f64 {
        let alive = (0..root.len()).filter(|j| output.window.input[*j].norm_sqr() > 0.0);
        alive
            .map(|j| of(&part(input, output, response, j), root[j] * root[j]))
            .sum()
    };
    let fitted = Fitted {
        response,
        gain: sum(&|part, w| w * part.error.norm_sqr()) / below.response.norm_sqr(),
        residual: sum(&|part, _| part.left.norm_sqr()),
        freedom: sum(&|part, w| w * part.freedom),
        ..above
    };
    (fitted.gain.is_finite() && fitted.residual.is_finite() && fitted.freedom > 0.0)
        .then_some(fitted)
}

fn part(input: &Side, output: &Side, ratio: Complex<f64>, j: usize) -> Part {
    let (x, t) = (input.response(j), output.response(j));
    let s = -t + 1.0;
    let (below, above) = (&input.drawn.squares, &output.drawn.squares);
    Part {
        error: above.first[j] * s + ratio * below.first[j] * x,
        left: above.residual[j] - t / x * below.residual[j],
        freedom: 1.0 - (s * above.leverage[j] + t * below.leverage[j]).re,
    }
}

//! The margins of a control law around a measured plant.

use std::f64::consts::TAU;

use nalgebra::Complex;
use serde::Serialize;

use crate::analysis::{FrfError, MeasuredFrf, check_frf, points, roll_off, variance};
use bench_base::units::rad_s;
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_control::measured::{
    LoopPeaks, MeasuredLoop, MeasuredMargins, NyquistCount, OutsideBand, Stability, check_gaps,
    least_damping_ratio,
};
use bench_identify::{Frf, FrfPoint};
use bench_plant::SignalPath;

/// Margins of a measured loop: with 95 % intervals within the band of the FRF, with bounds by the model outside of it.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredLoopMargins {
    /// First and last measured frequency in hertz.
    pub band_hz: [f64; 2],
    /// Nyquist's count.
    #[serde(flatten)]
    pub count: NyquistCount,
    /// Margins. `None` if the loop is not stable, since it has none.
    pub margins: Option<MeasuredMargins>,
    /// Peaks of the closed loop. `None` if the loop is not stable.
    pub peaks: Option<LoopPeaks>,
    /// What lies outside the band.
    pub outside_band: OutsideBand,
}

impl MeasuredLoopMargins {
    /// Whether the measured curve shows a stable loop.
    pub fn is_stable(&self) -> bool {
        self.count.stability == Stability::Stable
    }
}

/// The responses of a loop at the measured frequencies, not smoothed.
#[derive(Clone, Debug)]
pub struct LoopCurves {
    /// L = P C.
    pub loop_gain: Frf,
    /// S = 1/(1 + L).
    pub sensitivity: Frf,
    /// T = L/(1 + L).
    pub complementary: Frf,
    /// C S in amperes per metre, from reference or noise to current.
    pub control: Frf,
    /// P S in metres per ampere, from a disturbance in amperes at the plant's input to the position.
    pub disturbance: Frf,
}

/// The margins of the control law of `model` around the measured plant. `model` is the loop of `config`: its law is used, and its
/// plant outside of the measured band.
///
/// # Errors
/// When the FRF does not belong to `config`, has gaps, or does not contain the crossover or the peak of |S|.
pub fn measured_margins(
    measured: &MeasuredFrf,
    model: &ClosedLoop,
    config: &Config,
) -> Result<MeasuredLoopMargins, FrfError> {
    check_frf(measured, model, config)?;
    let points = points(&measured.frf, &SignalPath::from(config));
    check_gaps(&points, least_damping_ratio(model))?;
    margins_around(measured, model, config)
}

/// The margins around a response that belongs to `config` and has no gaps; `model` is used outside of the measured band.
///
/// # Errors
/// When the response does not contain the crossover or the peak of |S|.
pub(crate) fn margins_around(
    measured: &MeasuredFrf,
    model: &ClosedLoop,
    config: &Config,
) -> Result<MeasuredLoopMargins, FrfError> {
    let frf = &measured.frf;
    let law = |w: f64| model.law_response(w);
    let (first_hz, last_hz) = measured.band_hz();
    let further = model.frequencies(rad_s(first_hz), rad_s(last_hz));
    let points = points(frf, &SignalPath::from(config));
    let measured_loop = MeasuredLoop::new(&points, &law, &further)?;
    let margins = MeasuredMargins::of(&measured_loop);
    let outside_band = OutsideBand::of(&measured_loop, model);
    outside_band.check(&measured_loop, &margins)?;
    let count = NyquistCount::of(&measured_loop, model).ok_or(FrfError::Poles)?;
    let is_stable = count.stability == Stability::Stable;
    Ok(MeasuredLoopMargins {
        band_hz: [first_hz, last_hz],
        count,
        margins: is_stable.then_some(margins),
        peaks: is_stable.then(|| LoopPeaks::of(&measured_loop)),
        outside_band,
    })
}

impl LoopCurves {
    /// The responses of a control law around a measured plant. With C the law, S = 1/(1 + P C) and e the error of P, the errors
    /// are
    ///
    /// ```text
    /// L: C e     S: -C S^2 e     T: C S^2 e     C S: -C^2 S^2 e     P S: S^2 e
    /// ```
    pub fn of(frf: &Frf, model: &ClosedLoop, config: &Config) -> LoopCurves {
        let path = SignalPath::from(config);
        let of = |response: fn(&AtFrequency) -> Complex<f64>, slope: fn(&AtFrequency) -> f64| {
            let mut curve = Frf::default();
            for k in 0..frf.len() {
                let at = AtFrequency::new(frf, k, model, &path);
                curve.push(FrfPoint {
                    frequency_hz: frf.frequency_hz[k],
                    response: response(&at),
                    coherence: frf.coherence[k],
                    variance: at.variance * slope(&at).powi(2),
                    resolution_hz: frf.resolution_hz[k],
                });
            }
            curve
        };
        LoopCurves {
            loop_gain: of(|at| at.plant * at.law, |at| at.law.norm()),
            sensitivity: of(|at| at.s, |at| at.law.norm() * at.s.norm_sqr()),
            complementary: of(
                |at| at.plant * at.law * at.s,
                |at| at.law.norm() * at.s.norm_sqr(),
            ),
            control: of(|at| at.law * at.s, |at| at.law.norm_sqr() * at.s.norm_sqr()),
            disturbance: of(|at| at.plant * at.s, |at| at.s.norm_sqr()),
        }
    }
}

/// Plant, law and sensitivity at a frequency.
struct AtFrequency {
    plant: Complex<f64>,
    law: Complex<f64>,
    s: Complex<f64>,
    /// E|error of the plant|^2.
    variance: f64,
}

impl AtFrequency {
    fn new(frf: &Frf, k: usize, model: &ClosedLoop, path: &SignalPath) -> AtFrequency {
        let omega_rad_s = TAU * frf.frequency_hz[k];
        let factor = roll_off(path, omega_rad_s);
        let plant = frf.response[k] * factor;
        let law = model.law_response(omega_rad_s);
        AtFrequency {
            plant,
            law,
            s: (plant * law + 1.0).inv(),
            variance: variance(frf, k) * factor.norm_sqr(),
        }
    }
}

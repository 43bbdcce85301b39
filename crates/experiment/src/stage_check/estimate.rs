//! The response to a stage check: static compliance and response at the tones, by least squares.
//!
//! ```text
//! y(t) = c + sum (a cos w t + b sin w t) over the tones + sum exp(-z w t) (a cos wd t + b sin wd t) over the modes
//! ```
//!
//! The decays of the modes separate the transient from the steady state. Current and position are fitted alike, so that limits and
//! resolution of the amplifier do not matter. The noise of each result is that of the residual at neighbouring frequencies, because
//! the vibration of the floor is not white.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::shot::Shot;
use bench_excitation::{Excitation, StageCheckSignal};
use bench_identify::Signals;

/// Distances of the neighbours from a tone, in units of one over the measured time: beyond the width of its line.
const NEIGHBOURS: [f64; 4] = [2.0, 3.0, 4.0, 5.0];
/// Frequencies of the noise of the static compliance, in the same unit.
const STATIC_NEIGHBOURS: [f64; 4] = [1.0, 2.0, 3.0, 4.0];

/// A value of the shot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured<T> {
    pub value: T,
    /// Standard deviation of its magnitude, or of its component along any direction.
    pub sigma: f64,
}

/// The response to a stage check.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ShotResponse {
    /// Static compliance in metres per ampere.
    pub compliance: Measured<f64>,
    /// Response at each tone in metres per ampere.
    pub responses: Vec<Measured<Complex<f64>>>,
}

/// The estimates of one signal.
struct Fitted {
    /// The constant minus the mean before the excitation.
    step: f64,
    tones: Vec<Complex<f64>>,
    residual: Vec<f64>,
}

/// Estimates the response; `None` if the record is too short, or the fit has no unique solution.
pub(super) fn estimate(shot: &Shot, signals: &Signals) -> Option<ShotResponse> {
    let signal = StageCheckSignal::new(&shot.settings, 1.0 / signals.rate_hz);
    let quiet = signal.quiet_ticks() as usize;
    let measured = signal.measured_from_tick() as usize..signal.ticks() as usize;
    if signals.len() < measured.end {
        return None;
    }
    let times_s: Vec<f64> = measured
        .clone()
        .map(|tick| signal.time_s(tick as u64))
        .collect();
    let regressors = regressors(shot, &times_s);
    let inverse = (regressors.transpose() * &regressors).try_inverse()?;
    let fitted = |samples: &[f64]| {
        let mean = samples[..quiet].iter().sum::<f64>() / quiet as f64;
        let window = DVector::from_column_slice(&samples[measured.clone()]);
        fit(&regressors, &inverse, &window, mean, shot.responses.len())
    };
    let (current, position) = (fitted(&signals.input), fitted(&signals.output));
    let noise = Noise {
        residual: &position.residual,
        times_s: &times_s,
    };
    let quiet_ratio = times_s.len() as f64 / quiet as f64;
    Some(ShotResponse {
        compliance: Measured {
            value: position.step / current.step,
            sigma: noise.constant(&inverse, quiet_ratio) / current.step.abs(),
        },
        responses: (0..shot.responses.len())
            .map(|k| Measured {
                value: position.tones[k] / current.tones[k],
                sigma: noise.tone(shot.settings.tones[k].frequency_hz, k, &inverse)
                    / current.tones[k].norm(),
            })
            .collect(),
    })
}

/// The columns: one, cosine and sine of each tone, and of each decay.
fn regressors(shot: &Shot, times_s: &[f64]) -> DMatrix<f64> {
    let tones = shot.settings.tones.iter();
    let tones = tones.map(|tone| (TAU * tone.frequency_hz, 0.0));
    let waves: Vec<(f64, f64)> = tones.chain(shot.decays.iter().copied()).collect();
    let begin_s = times_s.first().copied().unwrap_or_default();
    DMatrix::from_fn(times_s.len(), 1 + 2 * waves.len(), |row, column| {
        let Some(index) = column.checked_sub(1) else {
            return 1.0;
        };
        let (rad_s, damping_ratio) = waves[index / 2];
        let decay = libm::exp(-damping_ratio * rad_s * (times_s[row] - begin_s));
        let angle = rad_s * (1.0 - damping_ratio * damping_ratio).max(0.0).sqrt() * times_s[row];
        let (sine, cosine) = libm::sincos(angle);
        decay * if index % 2 == 0 { cosine } else { sine }
    })
}

fn fit(
    regressors: &DMatrix<f64>,
    inverse: &DMatrix<f64>,
    window: &DVector<f64>,
    mean: f64,
    tones: usize,
) -> Fitted {
    let solution = inverse * (regressors.transpose() * window);
    let residual = window - regressors * &solution;
    Fitted {
        step: solution[0] - mean,
        // Re(A exp(j w t)) = Re A cos w t - Im A sin w t.
        tones: (0..tones)
            .map(|k| Complex::new(solution[1 + 2 * k], -solution[2 + 2 * k]))
            .collect(),
        residual: residual.iter().copied().collect(),
    }
}

/// The noise of the position, by the residual of its fit.
struct Noise<'a> {
    residual: &'a [f64],
    times_s: &'a [f64],
}

impl Noise<'_> {
    /// Standard deviation of the constant minus the mean before it. A white residual of variance v has E|D|^2 = 4 v/n, and the mean
    /// of n samples has the variance v/n; the fit increases it by n (X^T X)^-1.
    fn constant(&self, inverse: &DMatrix<f64>, quiet_ratio: f64) -> f64 {
        let samples = self.residual.len() as f64;
        let mean_variance = self.power(STATIC_NEIGHBOURS, 0.0) / 4.0;
        (mean_variance * (samples * inverse[(0, 0)] + quiet_ratio)).sqrt()
    }

    /// Standard deviation of each component of the amplitude of tone `k`: E|D|^2/2 without other columns.
    fn tone(&self, hz: f64, k: usize, inverse: &DMatrix<f64>) -> f64 {
        let samples = self.residual.len() as f64;
        let (cosine, sine) = (1 + 2 * k, 2 + 2 * k);
        let increase = samples / 4.0 * (inverse[(cosine, cosine)] + inverse[(sine, sine)]);
        (self.power(NEIGHBOURS, hz) / 2.0 * increase).sqrt()
    }

    /// Mean of |D|^2, D = 2/n sum r exp(-j w t), at frequencies to both sides of `hz`.
    fn power(&self, neighbours: [f64; 4], hz: f64) -> f64 {
        let span_s = self.times_s.len() as f64 * self.step_s();
        let sides = neighbours
            .iter()
            .flat_map(|k| [hz - k / span_s, hz + k / span_s]);
        let powers: Vec<f64> = sides
            .filter(|hz| *hz > 0.0)
            .map(|hz| self.amplitude(hz).norm_sqr())
            .collect();
        powers.iter().sum::<f64>() / powers.len().max(1) as f64
    }

    fn step_s(&self) -> f64 {
        match self.times_s {
            [first, second, ..] => second - first,
            _ => 0.0,
        }
    }

    fn amplitude(&self, hz: f64) -> Complex<f64> {
        let samples = self.residual.iter().zip(self.times_s);
        let sum: Complex<f64> = samples
            .map(|(r, t)| Complex::from_polar(*r, -TAU * hz * t))
            .sum();
        sum * 2.0 / self.residual.len() as f64
    }
}

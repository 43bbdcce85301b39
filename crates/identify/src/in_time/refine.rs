//! The parameters of greatest likelihood of readings, by scoring (Gauss-Newton steps with the expected information), and the
//! standard deviation of the noise before rounding.
//!
//! ```text
//! b = J' g/s        H = J' I J/s^2        step = H^-1 b           J: derivatives, g: scores, I: information of the readings
//! ```
//!
//! The noise follows from the likelihood at each step. Of rounded readings, as long as the model is wrong, it is that error, many readings are uncertain, and
//! the steps are those of least squares; near the end only readings close to an end of their cell matter.

use nalgebra::{DMatrix, DVector};

use super::equations::Equations;
use super::noise::Noise;
use super::simulated::{Parts, Simulation};
use crate::modal::{ModalParameters, Parameter};
use crate::record_check::Reading;

/// Largest number of steps.
const MAX_STEPS: usize = 15;
/// Dampings of a step relative to the diagonal; the first one with which the likelihood grows is used.
const DAMPINGS: [f64; 4] = [1e-9, 0.1, 3.0, 100.0];
/// A smaller gain of ln P is negligible beside the noise of one parameter, 0.5.
const NEGLIGIBLE_GAIN: f64 = 0.05;
/// The standard deviation lies between these multiples of the step of rounded readings. Above the second one rounding is noise, and the usual fit serves.
const SIGMA_STEPS: (f64, f64) = (5e-4, 1.0);
/// The same as ratios of the range of readings that are not rounded.
const SIGMA_RATIOS: (f64, f64) = (1e-9, 1.0);
/// A noise above this ratio of a step is rather an error of the model: as if there were no steps.
pub(super) const MAX_SIGMA_STEPS: f64 = 0.55;
/// Standard deviations with this factor are compared first.
const FIRST_FACTOR: f64 = 4.0;
/// Accuracy of a standard deviation in a step, and of the last one.
const ROUGH: f64 = 0.4;
pub(super) const FINE: f64 = 0.02;
/// Least information, as a number of readings without rounding, per parameter. Noise is then measured to some ten per cent.
const MIN_INFORMATION: f64 = 5.0;
/// A noise with too little information is increased by this factor.
const SIGMA_RATIO: f64 = 1.3;
/// After as many steps an order that leaves a larger noise than [`MAX_SIGMA_STEPS`] is given up, if no reading is lost.
const HOPELESS_STEPS: usize = 3;

/// Readings of the output to a known input.
#[derive(Clone, Copy)]
pub(super) struct TimeRecord<'a> {
    pub(super) simulation: Simulation<'a>,
    pub(super) readings: &'a [Reading],
    /// The step of the readings; `None` if their noise exceeds it.
    pub(super) step: Option<f64>,
    /// Least and largest standard deviation.
    pub(super) sigma_limits: (f64, f64),
}

/// Constant and slope of the readings that are no response to the input: from the first to the last one the slope changes them by itself.
pub(super) type Drift = [f64; 2];

/// The parameters of greatest likelihood.
#[derive(Clone)]
pub(super) struct Likeliest {
    pub(super) parameters: ModalParameters,
    /// The standard deviation of the noise before rounding.
    pub(super) sigma: f64,
    pub(super) log_probability: f64,
    /// In the order of [`ModalParameters::free`].
    pub(super) covariance: DMatrix<f64>,
    /// The readings that are no response to the input.
    pub(super) drift: Drift,
    /// The output before noise and rounding.
    pub(super) output: Vec<f64>,
    /// The score of each reading.
    pub(super) scores: Vec<f64>,
    /// The information of each reading.
    pub(super) information: Vec<f64>,
}

impl Likeliest {
    /// Sum of the squares of the scores over that of the information: 1 if the model holds.
    pub(super) fn chi2(&self) -> f64 {
        let squares: f64 = self.scores.iter().map(|g| g * g).sum();
        squares / self.information.iter().sum::<f64>()
    }

    /// The expected values of the output with its noise, before rounding.
    pub(super) fn unrounded(&self) -> Vec<f64> {
        let pairs = self.output.iter().zip(&self.scores);
        pairs.map(|(y, score)| y + self.sigma * score).collect()
    }
}

/// A model with its output.
struct Trial {
    parameters: ModalParameters,
    drift: Drift,
    /// The parts of the output.
    parts: Parts,
    output: Vec<f64>,
}

/// A model with the noise of greatest likelihood.
struct Climbed {
    trial: Trial,
    sigma: f64,
}

impl<'a> TimeRecord<'a> {
    pub(super) fn new(
        simulation: Simulation<'a>,
        readings: &'a [Reading],
        step: Option<f64>,
    ) -> TimeRecord<'a> {
        let (ratios, unit) = match step {
            Some(step) => (SIGMA_STEPS, step),
            None => (SIGMA_RATIOS, range(readings).max(f64::MIN_POSITIVE)),
        };
        TimeRecord {
            simulation,
            readings,
            step,
            sigma_limits: (ratios.0 * unit, ratios.1 * unit),
        }
    }

    /// The number of samples that are readings.
    pub(super) fn count(&self) -> usize {
        let readings = self.readings.iter();
        readings
            .filter(|reading| **reading != Reading::Lost)
            .count()
    }

    /// Whether the steps of the readings matter beside a noise, if they have steps.
    pub(super) fn is_near(&self, sigma: f64) -> bool {
        self.step.is_none_or(|step| sigma < MAX_SIGMA_STEPS * step)
    }

    /// Whether a model with this noise may be changed to one that is near. The first modes of an output with lost readings are those of a
    /// response that may be far off.
    pub(super) fn may_come_near(&self, sigma: f64) -> bool {
        self.is_near(sigma) || !self.is_whole()
    }

    /// Whether each sample is a reading with a value.
    pub(super) fn is_whole(&self) -> bool {
        let is_value = |reading: &Reading| matches!(reading, Reading::Value(_));
        self.readings.iter().all(is_value)
    }

    /// The likeliest parameters near `start`; `None` if the readings do not determine them.
    ///
    /// If too few readings are uncertain to measure the noise, it is taken as that with which enough are.
    pub(super) fn likeliest(&self, start: ModalParameters) -> Option<Likeliest> {
        let mut trial = self.trial(start, [0.0; 2], &Parts::default());
        trial.drift = self.mean_drift(&trial.output);
        let from = self.trial(trial.parameters, trial.drift, &trial.parts);
        let (least, largest) = self.sigma_limits;
        let found = self.climbed(from, largest, least);
        let informative = self.informative_sigma(&found);
        if informative <= found.sigma {
            return self.result(found.trial, found.sigma);
        }
        let again = self.climbed(found.trial, informative, informative);
        self.result(again.trial, again.sigma)
    }

    /// Parameters and noise of greatest likelihood from a model on, with at least a given noise.
    fn climbed(&self, from: Trial, first_sigma: f64, least_sigma: f64) -> Climbed {
        let sigma_of = |output: &[f64], from: f64, ratio: f64| {
            self.likeliest_sigma(output, from, ratio).max(least_sigma)
        };
        let mut best = from;
        let mut sigma = sigma_of(&best.output, first_sigma, ROUGH);
        for steps in 0..MAX_STEPS {
            let before = self.log_probability(&best.output, sigma);
            let equations = self.equations(&best, sigma);
            let improved = DAMPINGS.iter().find_map(|damping| {
                let next = self.moved(&best, &equations.step(*damping)?);
                let gain = self.log_probability(&next.output, sigma) - before;
                (gain > 0.0).then_some((next, gain))
            });
            let Some((next, gain)) = improved else {
                break;
            };
            best = next;
            sigma = sigma_of(&best.output, sigma, ROUGH);
            let is_hopeless = steps + 1 >= HOPELESS_STEPS && !self.may_come_near(sigma);
            if is_hopeless || gain < NEGLIGIBLE_GAIN {
                break;
            }
        }
        // A mode may have moved past its neighbours.
        let rising = best.parameters.by_rising_frequency();
        let best = self.trial(rising, best.drift, &best.parts);
        Climbed {
            sigma: sigma_of(&best.output, sigma, FINE),
            trial: best,
        }
    }

    /// The noise from that of a model on with which rounded readings have the least information for its parameters.
    fn informative_sigma(&self, model: &Climbed) -> f64 {
        let least = MIN_INFORMATION * number_of_parameters(&model.trial) as f64;
        let mut sigma = model.sigma;
        while self.step.is_some()
            && self.is_near(sigma)
            && self
                .information(&model.trial.output, sigma)
                .iter()
                .sum::<f64>()
                < least
        {
            sigma *= SIGMA_RATIO;
        }
        sigma
    }

    fn result(&self, best: Trial, sigma: f64) -> Option<Likeliest> {
        let equations = self.equations(&best, sigma);
        let log_probability = self.log_probability(&best.output, sigma);
        let free = best.parameters.free();
        // As the variance of errors that are those of N - p data.
        let number = number_of_parameters(&best) as f64;
        let information: f64 = equations.information.iter().sum();
        if information < MIN_INFORMATION * number {
            return None;
        }
        let inverse = equations.inverse()? * (information / (information - number));
        let factor = |i: usize| match free[i] {
            Parameter::Frequency(k) => best.parameters.modes[k].omega_rad_s,
            Parameter::Damping(k) => best.parameters.modes[k].damping_ratio,
            _ => 1.0,
        };
        let covariance = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            inverse[(i, j)] * factor(i) * factor(j)
        });
        Some(Likeliest {
            log_probability,
            covariance,
            drift: best.drift,
            output: best.output,
            scores: equations.scores,
            information: equations.information,
            parameters: best.parameters,
            sigma,
        })
    }

    /// A model with its output, of which parts may be those of the model before.
    fn trial(&self, parameters: ModalParameters, drift: Drift, before: &Parts) -> Trial {
        let parts = self.simulation.parts(&parameters, before);
        let mut output = parts.sum(&parameters);
        let count = output.len();
        for (k, y) in output.iter_mut().enumerate() {
            *y += drift_at(drift, k, count);
        }
        Trial {
            parameters,
            drift,
            parts,
            output,
        }
    }

    /// The mean difference of the readings from an output.
    fn mean_drift(&self, output: &[f64]) -> Drift {
        let pairs = self.readings.iter().zip(output);
        let difference = |(reading, m): (&Reading, &f64)| match reading {
            Reading::Value(y) => Some(y - m),
            _ => None,
        };
        let differences: Vec<f64> = pairs.filter_map(difference).collect();
        let count = differences.len().max(1) as f64;
        [differences.iter().sum::<f64>() / count, 0.0]
    }

    fn moved(&self, from: &Trial, step: &DVector<f64>) -> Trial {
        let free = from.parameters.free();
        let parameters = from
            .parameters
            .moved(&free, &step.rows(0, free.len()).into_owned());
        let drift = [
            from.drift[0] + step[free.len()],
            from.drift[1] + step[free.len() + 1],
        ];
        self.trial(parameters, drift, &from.parts)
    }

    pub(super) fn log_probability(&self, output: &[f64], sigma: f64) -> f64 {
        let noise = self.noise(sigma);
        let pairs = self.readings.iter().zip(output);
        pairs
            .map(|(reading, y)| noise.log_probability(*reading, *y))
            .sum()
    }

    fn noise(&self, sigma: f64) -> Noise {
        Noise::new(self.step, sigma)
    }

    /// The standard deviation of greatest likelihood near `start`, to about this ratio.
    pub(super) fn likeliest_sigma(&self, output: &[f64], start: f64, ratio: f64) -> f64 {
        let (least, largest) = self.sigma_limits;
        let value = |sigma: f64| (sigma, self.log_probability(output, sigma));
        let mut best = value(start.clamp(least, largest));
        let mut factor = FIRST_FACTOR;
        while factor > 1.0 + ratio {
            let tried = [best.0 / factor, best.0 * factor];
            let inside = tried.map(|sigma| sigma.clamp(least, largest));
            let [below, above] = inside.map(value);
            let better = if below.1 > above.1 { below } else { above };
            if better.1 > best.1 {
                best = better;
            } else {
                factor = factor.sqrt();
            }
        }
        best.0
    }

    fn equations(&self, at: &Trial, sigma: f64) -> Equations {
        let columns = self.columns(at);
        let noise = self.noise(sigma);
        let pairs = self.readings.iter().zip(&at.output);
        let scores: Vec<f64> = pairs
            .map(|(reading, y)| noise.score(*reading, *y))
            .collect();
        let information = self.information(&at.output, sigma);
        Equations::new(&columns, scores, information, sigma)
    }

    /// The derivatives of the readings to the free parameters, with w and zeta by their logarithms, and to both parts of the drift.
    fn columns(&self, at: &Trial) -> Vec<Vec<f64>> {
        let count = self.readings.len();
        let mut columns = self.simulation.derivatives(&at.parameters, &at.parts);
        columns.push(vec![1.0; count]);
        columns.push((0..count).map(|k| ramp(k, count)).collect());
        columns
    }

    /// The information of each reading.
    fn information(&self, output: &[f64], sigma: f64) -> Vec<f64> {
        let noise = self.noise(sigma);
        let pairs = self.readings.iter().zip(output);
        pairs
            .map(|(reading, y)| noise.information(*reading, *y))
            .collect()
    }
}

/// The parameters of a model with its drift.
fn number_of_parameters(model: &Trial) -> usize {
    model.parameters.free().len() + model.drift.len()
}

/// The range of the values of readings.
fn range(readings: &[Reading]) -> f64 {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for reading in readings {
        if let Reading::Value(y) = reading {
            (low, high) = (low.min(*y), high.max(*y));
        }
    }
    (high - low).max(0.0)
}

/// A drift at a sample of the record or after it, of which the record has `count`.
pub(super) fn drift_at(drift: Drift, k: usize, count: usize) -> f64 {
    drift[0] + drift[1] * ramp(k, count)
}

/// From -1/2 at the first to 1/2 at the last sample.
fn ramp(k: usize, count: usize) -> f64 {
    k as f64 / (count.max(2) - 1) as f64 - 0.5
}

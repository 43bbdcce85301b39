//! Input and output sampled by two clocks: the delay of the output grows with time.
//!
//! Sample k of the output, recorded with the time k T, was measured at k T (1 + e). A sweep excites each frequency at a time of its
//! own, t(f), so that the recorded response turns away from the true one:
//!
//! ```text
//! H_recorded(f) = H(f) exp(j w e t(f)),         t(f) = Re sum U_t conj(U) / sum |U|^2,   U_t the spectrum of t u(t)
//! ```
//!
//! Modes and a constant delay do not describe that. e is found as the ratio with which they do: by a scan, in a band so low that the
//! scan has few steps, and then in wider bands with smaller steps. The output is then resampled at the times of its own clock.
//!
//! An excitation without an order in time, as noise or a multisine, has no t(f), and nothing is found. In closed loop U is the reference.

use nalgebra::Complex;

use crate::external_signals::ExternalSignals;
use crate::fft::RealFft;
use crate::frf::with_relative_error;
use crate::modal::{
    self, CoarseFit, MeasurementChain, ModalFit, ModalParameters, Nearest, Residues,
};
use crate::observation::describes;
use crate::profile::{self, NEGLIGIBLE_SIGMAS, is_progress};
use crate::resampling::Readings;
use crate::{Estimate, FrfDatum, Signals};

/// Two clocks differ by at most this ratio: quartz has 1e-4, the timers of computers less than 1e-3.
const MAX_RATIO: f64 = 2e-3;
/// The first scan is of the data up to this angle per ratio in radians.
const FIRST_LIMIT_RAD: f64 = 3e4;
/// Steps of the next scans to either side. The best one of a scan is right to about a step, each of which is four of the next.
const NEXT_STEPS: i32 = 5;
/// The angle in radians by which the response turns in a step, from the lowest to the highest frequency.
const STEP_RAD: f64 = 1.5;
/// By how much the angle of a scan exceeds that of the one before.
const WIDER: f64 = 4.0;
/// Largest number of data and of modes in a scan.
const SCANNED_DATA: usize = 160;
const SCANNED_MODES: usize = 4;
/// Errors over the response with which the ratio is refined, one after the other.
const RELATIVE_ERRORS: [f64; 2] = [0.03, 0.003];
/// Largest number of data, and of modes, with which a ratio is found before all data are used.
const FITTED_DATA: usize = 400;
const FITTED_MODES: usize = 8;
/// A scan of fewer data has too few to tell modes from an angle.
const MIN_DATA: usize = 40;
/// Bins to either side of a frequency over which its time is a mean.
const HALF_WIDTH_BINS: usize = 8;
/// In a sweep the spread of the times at a frequency is at most this ratio of their whole range, for half of the frequencies.
const SWEEP_SPREAD: f64 = 0.1;
/// Angle in radians of the first step of the parabolas.
const FIRST_STEP_RAD: f64 = 0.1;
/// A ratio of fewer standard deviations is noise.
const CERTAIN_SIGMAS: f64 = 5.0;
/// A difference is confirmed if less than this part of it is found again in the corrected record. Without a difference all of it would be,
/// with one nothing but noise.
const MAX_REST: f64 = 0.5;
/// Largest number of corrections of a record.
const MAX_CORRECTIONS: usize = 6;

/// The difference between the clocks of input and output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockSkew {
    /// e: the true time between two samples of the output over the recorded one, less 1.
    pub ratio: Estimate,
    /// Duration of the record in seconds.
    pub duration_s: f64,
}

impl ClockSkew {
    /// The ratio with which modes describe a response between two frequencies; `None` without a sweep, or if none is significant.
    pub(super) fn find(
        record: ExternalSignals<'_>,
        band_hz: (f64, f64),
        chain: &MeasurementChain,
    ) -> Option<ClockSkew> {
        let excited = record.excited();
        let turned = |record: ExternalSignals<'_>| {
            let data = record.response(band_hz).ok()?.data;
            TurnedData::new(&excited, &data, chain)
        };
        let mut skew = ClockSkew {
            ratio: turned(record)?.thinned(FITTED_DATA).near()?,
            duration_s: excited.len() as f64 / excited.rate_hz,
        };
        // The turn of a datum is an approximation: the plant responds for a while after t(f). Of a small rest the error is small.
        let mut before: Option<ModalFit> = None;
        for _ in 0..MAX_CORRECTIONS {
            let corrected = skew.corrected(record.signals);
            let turned = turned(record.with_signals(&corrected))?;
            let part = turned.thinned(FITTED_DATA);
            let Some(fit) = part.few_modes() else {
                // Modes in the place of the rest of the turn are not determined.
                skew.ratio = after(skew.ratio, part.rest_of_large_modes()?);
                before = None;
                continue;
            };
            let is_stuck = |before: &ModalFit| !describes(&fit) && !is_progress(before, &fit);
            if before.as_ref().is_some_and(is_stuck) {
                return None;
            }
            let used = if describes(&fit) { turned } else { part };
            let rest = used.refined(&fit.parameters, 0.0)?;
            skew.ratio = after(skew.ratio, rest);
            let is_found = describes(&fit) && rest.value.abs() < NEGLIGIBLE_SIGMAS * rest.sigma;
            before = Some(fit);
            if is_found {
                break;
            }
        }
        let is_described = before.as_ref().is_some_and(describes);
        let is_certain = skew.ratio.value.abs() > CERTAIN_SIGMAS * skew.ratio.sigma;
        (is_described && is_certain).then_some(skew)
    }

    /// The record with the output at the times of the input, up to the last reading of the output: after it, resampling would repeat that
    /// reading with its noise, which is taken for a spike.
    pub(super) fn corrected(&self, signals: &Signals) -> Signals {
        let period_s = 1.0 / signals.rate_hz;
        let last = signals.len().saturating_sub(1) as f64 * (1.0 + self.ratio.value);
        let count = signals.len().min(last as usize + 1);
        let mut readings = Readings::default();
        for (k, output) in signals.output.iter().enumerate() {
            readings.push(k as f64 * period_s * (1.0 + self.ratio.value), *output);
        }
        Signals {
            rate_hz: signals.rate_hz,
            input: signals.input[..count].to_vec(),
            output: readings.at_regular_times(0.0, period_s, count),
        }
    }

    /// Whether the modes of a corrected record agree with the difference: with them, most of it is no longer there. (Modes of another
    /// number than those with which the ratio was found may describe the response by another ratio.)
    pub(super) fn is_confirmed(
        &self,
        fit: &ModalFit,
        corrected: ExternalSignals<'_>,
        data: &[FrfDatum],
        chain: &MeasurementChain,
    ) -> bool {
        let turned = TurnedData::new(&corrected.excited(), data, chain);
        let rest = turned.and_then(|turned| {
            let part = turned.thinned(FITTED_DATA);
            part.refined(&fit.parameters, 0.0)
        });
        rest.is_some_and(|rest| rest.value.abs() < MAX_REST * self.ratio.value.abs())
    }

    /// The fit of a corrected record with the error of the ratio in its covariance.
    pub(super) fn widened(
        &self,
        fit: ModalFit,
        record: ExternalSignals<'_>,
        data: &[FrfDatum],
        chain: &MeasurementChain,
    ) -> ModalFit {
        let Some(turned) = TurnedData::new(&record.excited(), data, chain) else {
            return fit;
        };
        let rest = Estimate {
            value: 0.0,
            sigma: self.ratio.sigma,
        };
        let merging = fit.parameters.clone();
        profile::with_error(fit, rest, |ratio, modes| {
            turned.nearest(ratio, modes, &merging)
        })
    }

    /// The change of the delay of the output from begin to end of the record, in seconds.
    pub fn growth_s(&self) -> f64 {
        -self.ratio.value * self.duration_s
    }

    /// e in parts per million: positive if the clock of the output is slower, so that its samples come early.
    pub fn ppm(&self) -> Estimate {
        Estimate {
            value: 1e6 * self.ratio.value,
            sigma: 1e6 * self.ratio.sigma,
        }
    }

    /// What was found, and what was done.
    pub fn description(&self) -> String {
        let ppm = self.ppm();
        format!(
            "the delay of the output changes by {:.3} ms over {:.1} s, as with two clocks that differ by {:.1} ± {:.1} ppm; the output is resampled with that correction (better: sample input and output with one clock)",
            1e3 * self.growth_s(),
            self.duration_s,
            ppm.value.abs(),
            ppm.half_width_95()
        )
    }
}

/// The ratio of a record, of which a rest was found after a correction.
fn after(corrected: Estimate, rest: Estimate) -> Estimate {
    Estimate {
        value: (1.0 + corrected.value) * (1.0 + rest.value) - 1.0,
        sigma: rest.sigma,
    }
}

/// The response of a sweep with the time of each datum.
struct TurnedData<'a> {
    data: Vec<FrfDatum>,
    /// t(f) of each datum in seconds.
    time_s: Vec<f64>,
    chain: &'a MeasurementChain,
}

impl<'a> TurnedData<'a> {
    /// The data of a record whose input excites it.
    fn new(
        signals: &Signals,
        data: &[FrfDatum],
        chain: &'a MeasurementChain,
    ) -> Option<TurnedData<'a>> {
        let arrivals = arrivals(signals, data);
        is_sweep(&arrivals).then(|| TurnedData {
            data: data.to_vec(),
            time_s: arrivals.iter().map(|arrival| arrival.time_s).collect(),
            chain,
        })
    }

    /// w (t - t of the first datum) in radians: the angle of each datum per ratio.
    fn angle_rad(&self, index: usize) -> f64 {
        self.data[index].omega_rad_s() * (self.time_s[index] - self.time_s[0])
    }

    /// The largest angle per ratio.
    fn span_rad(&self) -> f64 {
        let angles = (0..self.data.len()).map(|index| self.angle_rad(index).abs());
        angles.fold(0.0, f64::max)
    }

    /// The data up to the first one whose angle per ratio exceeds a limit.
    fn up_to(&self, limit_rad: f64) -> TurnedData<'a> {
        let is_below = |index: &usize| self.angle_rad(*index).abs() <= limit_rad;
        let count = (0..self.data.len()).take_while(is_below).count();
        TurnedData {
            data: self.data[..count].to_vec(),
            time_s: self.time_s[..count].to_vec(),
            chain: self.chain,
        }
    }

    /// At most this number of the data, evenly.
    fn thinned(&self, count: usize) -> TurnedData<'a> {
        let every = self.data.len().div_ceil(count).max(1);
        TurnedData {
            data: self.data.iter().step_by(every).copied().collect(),
            time_s: self.time_s.iter().step_by(every).copied().collect(),
            chain: self.chain,
        }
    }

    /// The data turned back by a ratio.
    fn turned_back(&self, ratio: f64) -> Vec<FrfDatum> {
        let turned = self.data.iter().zip(&self.time_s).map(|(datum, time_s)| {
            let angle_rad = -datum.omega_rad_s() * ratio * time_s;
            FrfDatum {
                response: datum.response * Complex::from_polar(1.0, angle_rad),
                ..*datum
            }
        });
        turned.collect()
    }

    /// The ratio with which modes describe the data best, to about a step of the widest band.
    fn scan(&self) -> Option<f64> {
        let mut limit_rad = self.span_rad().min(FIRST_LIMIT_RAD);
        let part = self.up_to(limit_rad).thinned(SCANNED_DATA);
        let steps = (MAX_RATIO * limit_rad / STEP_RAD).ceil();
        let mut best = part.best_of(0.0, MAX_RATIO / steps, steps as i32)?;
        while limit_rad < self.span_rad() {
            limit_rad *= WIDER;
            let part = self.up_to(limit_rad).thinned(SCANNED_DATA);
            best = part.best_of(best, STEP_RAD / limit_rad, NEXT_STEPS)?;
        }
        Some(best)
    }

    /// The best ratio of those a number of steps to either side.
    fn best_of(&self, middle: f64, step: f64, steps: i32) -> Option<f64> {
        if self.data.len() < MIN_DATA {
            return None;
        }
        let ratios = (-steps..=steps).map(|k| middle + f64::from(k) * step);
        let costs = ratios.filter_map(|ratio| Some((self.coarse_modes(ratio)?.cost, ratio)));
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(best.1)
    }

    /// A few modes of the data turned back, and how well they describe them.
    fn coarse_modes(&self, ratio: f64) -> Option<CoarseFit> {
        modal::coarse_fit(&self.turned_back(ratio), self.chain, SCANNED_MODES).ok()
    }

    /// The data with an error in proportion to the response beside their noise.
    fn with_relative_error(&self, relative_error: f64) -> TurnedData<'a> {
        TurnedData {
            data: with_relative_error(&self.data, relative_error),
            time_s: self.time_s.clone(),
            chain: self.chain,
        }
    }

    /// About the ratio with which modes describe the data best.
    fn near(&self) -> Option<Estimate> {
        let mut ratio = Estimate {
            value: self.scan()?,
            sigma: 0.0,
        };
        // Small modes count only when the angle is so exact that they do not take the place of a part of it.
        for relative_error in RELATIVE_ERRORS {
            let modes = self.coarse_modes(ratio.value)?.parameters;
            let inexact = self.with_relative_error(relative_error);
            ratio = inexact.refined(&modes, ratio.value).unwrap_or(ratio);
        }
        Some(ratio)
    }

    /// A few modes of the data as they are.
    fn few_modes(&self) -> Option<ModalFit> {
        modal::fit_few(&self.data, self.chain, &Residues::Real, FITTED_MODES).ok()
    }

    /// The ratio near zero with which modes describe the data best but for the smaller errors of [`RELATIVE_ERRORS`]: modes that are
    /// larger than the rest of the turn.
    fn rest_of_large_modes(&self) -> Option<Estimate> {
        let [.., relative_error] = RELATIVE_ERRORS;
        let inexact = self.with_relative_error(relative_error);
        inexact.refined(&inexact.few_modes()?.parameters, 0.0)
    }

    /// The ratio of least chi^2 near one.
    fn refined(&self, modes: &ModalParameters, near: f64) -> Option<Estimate> {
        let start = profile::Start {
            modes,
            value: near,
            step: FIRST_STEP_RAD / self.span_rad(),
            limits: (-MAX_RATIO, MAX_RATIO),
        };
        let best = profile::best(&start, |ratio, near| self.nearest(ratio, near, modes))?;
        Some(best.value)
    }

    /// The modes of least chi^2 with a ratio, near given ones. The data are merged as other modes allow.
    fn nearest(&self, ratio: f64, near: &ModalParameters, merging: &ModalParameters) -> Nearest {
        let data = modal::merged(&self.turned_back(ratio), merging);
        modal::nearest(near, &data, self.chain)
    }
}

/// When a frequency is excited.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    time_s: f64,
    /// Standard deviation of the times.
    spread_s: f64,
}

/// The times at which the frequencies of the data are excited.
fn arrivals(signals: &Signals, data: &[FrfDatum]) -> Vec<Arrival> {
    let fft = RealFft::new(signals.len());
    let input = fft.below_nyquist(signals.input.clone());
    let timed = signals.input.iter().enumerate();
    let timed = timed.map(|(k, u)| k as f64 / signals.rate_hz * u);
    let timed = fft.below_nyquist(timed.collect());
    let bin_hz = signals.rate_hz / signals.len() as f64;
    let arrival = |datum: &FrfDatum| {
        let bin = (datum.frequency_hz / bin_hz).round() as usize;
        let low = bin.saturating_sub(HALF_WIDTH_BINS).max(1);
        let bins = low..(bin + HALF_WIDTH_BINS + 1).min(input.len()).max(low);
        Arrival::of(&input[bins.clone()], &timed[bins])
    };
    data.iter().map(arrival).collect()
}

impl Arrival {
    fn of(input: &[Complex<f64>], timed: &[Complex<f64>]) -> Arrival {
        let (mut power, mut first, mut second) = (0.0, 0.0, 0.0);
        for (u, timed) in input.iter().zip(timed) {
            power += u.norm_sqr();
            first += (timed * u.conj()).re;
            second += timed.norm_sqr();
        }
        let time_s = first / power;
        Arrival {
            time_s,
            spread_s: (second / power - time_s * time_s).max(0.0).sqrt(),
        }
    }
}

/// Whether each frequency is excited at a time of its own.
fn is_sweep(arrivals: &[Arrival]) -> bool {
    let times = arrivals.iter().map(|arrival| arrival.time_s);
    let latest_s = times.clone().fold(f64::NEG_INFINITY, f64::max);
    let earliest_s = times.fold(f64::INFINITY, f64::min);
    let limit_s = SWEEP_SPREAD * (latest_s - earliest_s);
    let narrow = arrivals.iter().filter(|arrival| arrival.spread_s < limit_s);
    2 * narrow.count() > arrivals.len()
}

#[cfg(test)]
mod tests;

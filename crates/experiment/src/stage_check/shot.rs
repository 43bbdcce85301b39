//! Step and tones of a stage check, from the certificate and the loop.
//!
//! One tone is at the lowest crossover of |L| by the measured response. The other one is where the signs of the residues show: at the
//! frequency with |L| of at least 0.1 at which the phase would change most, in standard deviations, if the residues of all modes above
//! the first one had the other sign (the two sign sequences of the thesis, `+-+` and `++-`). Where they hardly change it, the tone is
//! at the point of L nearest to -1. Both are frequencies of the certificate, so that nothing is interpolated.

use std::f64::consts::TAU;

use nalgebra::Complex;

use crate::certificate::{CertifiedMode, LoadedCertificate};
use bench_config::Config;
use bench_control::ClosedLoop;
use bench_excitation::{StageCheckSettings, Tone};
use bench_identify::Frf;

/// Static travel of the step as a ratio of the soft limit.
const STEP_RATIO: f64 = 0.01;
/// Amplitude of the motion of a tone as a ratio of the soft limit.
const TONE_RATIO: f64 = 0.003;
/// Largest current of step and tones each, as a ratio of the permitted one.
const CURRENT_RATIO: f64 = 0.1;
/// Zero current, ramp and measurement in seconds, for a first mode above [`USUAL_HZ`].
const TIMES_S: [f64; 3] = [0.2, 0.2, 0.8];
/// A slower first mode stretches the times: the ramp has four of its periods.
const USUAL_HZ: f64 = 20.0;
/// Longest stretch.
const MAX_STRETCH: f64 = 10.0;
/// Relative repeatability of the frequencies of modes, from the chirp to the check.
const FREQUENCY_DRIFT: f64 = 1e-3;
/// Repeatability of a phase in radians, apart from that.
const PHASE_REPEATABILITY_RAD: f64 = 0.01;
/// The second tone is not placed where the phase is less repeatable, in radians.
const MAX_SIGMA_RAD: f64 = 0.3;
/// Smallest |L| at the second tone: below it, an error of the phase hardly moves L towards -1.
const LEAST_GAIN: f64 = 0.1;
/// Least change of the phase by other signs, in standard deviations, for which the second tone is placed by them.
const LEAST_CHANGE: f64 = 10.0;
/// Static compliance is taken from the response below this ratio of the first mode, where the other modes and the damping change
/// it by less than 1e-3 after the correction for the first mode.
const STATIC_BAND: f64 = 0.2;

/// What a stage check excites, and what its response must be by the certificate.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Shot {
    /// The signal.
    pub settings: StageCheckSettings,
    /// Static compliance in metres per ampere.
    pub(super) compliance: Expected<f64>,
    /// Response at each tone in metres per ampere.
    pub(super) responses: Vec<Expected<Complex<f64>>>,
    /// Frequency (rad/s) and damping ratio of the modes whose decay is part of the response.
    pub(super) decays: Vec<(f64, f64)>,
}

/// A value of the certificate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Expected<T> {
    pub value: T,
    /// Standard deviation of its magnitude.
    pub sigma: f64,
    /// Standard deviation of its phase in radians from the chirp to the check, without noise.
    pub repeatability_rad: f64,
}

impl Shot {
    /// The shot for a loop with this certificate; `None` if the certificate has no static response, as that of a free body, or the
    /// loop no crossover in its band.
    pub fn of(loaded: &LoadedCertificate, model: &ClosedLoop, config: &Config) -> Option<Shot> {
        let frf = &loaded.frf;
        let modes = modes(loaded)?;
        let (first_rad_s, _) = *modes.first()?;
        let compliance = compliance(frf, first_rad_s / TAU)?;
        let age_sigma_s = age_sigma_s(config);
        let places = Places {
            frf,
            model,
            modes: &loaded.certificate.modes,
            age_sigma_s,
        };
        let places = places.tones()?;
        let [quiet_s, ramp_s, measure_s] = times_s(first_rad_s / TAU);
        let highest_rad_s = places
            .map(|k| TAU * frf.frequency_hz[k])
            .into_iter()
            .fold(0.0, f64::max);
        let settings = StageCheckSettings {
            quiet_s,
            ramp_s,
            measure_s,
            step_a: amplitude_a(STEP_RATIO, compliance.value.abs(), config),
            tones: places.map(|k| tone(frf, k, config)).to_vec(),
        };
        Some(Shot {
            decays: decays(&modes, 2.0 * highest_rad_s, measure_s),
            settings,
            compliance,
            responses: places.map(|k| response(frf, k, age_sigma_s)).to_vec(),
        })
    }
}

impl Shot {
    /// Bound of the free vibration in metres when the current of the shot ends: see [`rest`](super::rest).
    pub(super) fn vibration_m(&self) -> f64 {
        let step_m = self.compliance.value.abs() * self.settings.step_a;
        let first_rad_s = self.decays.first().map_or(f64::INFINITY, |mode| mode.0);
        let pairs = self.settings.tones.iter().zip(&self.responses);
        let tones_m = pairs.map(|(tone, response)| {
            let speed_ratio = (TAU * tone.frequency_hz / first_rad_s).max(1.0);
            response.value.norm() * tone.amplitude_a * speed_ratio
        });
        step_m + tones_m.sum::<f64>()
    }
}

fn times_s(first_hz: f64) -> [f64; 3] {
    let stretch = (USUAL_HZ / first_hz).clamp(1.0, MAX_STRETCH);
    TIMES_S.map(|time_s| stretch * time_s)
}

/// Frequency in rad/s and damping ratio of the modes; `None` if one of them is a free body.
fn modes(loaded: &LoadedCertificate) -> Option<Vec<(f64, f64)>> {
    let modes = loaded.certificate.modes.iter();
    let modes = modes.map(|mode| (TAU * mode.frequency_hz, mode.damping_ratio));
    modes.map(|mode| (mode.0 > 0.0).then_some(mode)).collect()
}

/// The modes up to a frequency whose decays can be distinguished within a time: two of them differ by half a period of the beat.
fn decays(modes: &[(f64, f64)], to_rad_s: f64, measure_s: f64) -> Vec<(f64, f64)> {
    let mut chosen: Vec<(f64, f64)> = Vec::new();
    for mode in modes.iter().filter(|(rad_s, _)| *rad_s <= to_rad_s) {
        let is_distinct = chosen
            .last()
            .is_none_or(|last| mode.0 - last.0 > 0.5 * TAU / measure_s);
        if is_distinct {
            chosen.push(*mode);
        }
    }
    chosen
}

/// Mean of Re H (1 - (f/f1)^2) over the lowest frequencies, weighted with their variance. Neighbouring estimates of a response are
/// not independent, so the standard deviation is that of the best one.
fn compliance(frf: &Frf, first_hz: f64) -> Option<Expected<f64>> {
    let low = (0..frf.len()).take_while(|k| frf.frequency_hz[*k] <= STATIC_BAND * first_hz);
    let (mut sum, mut weights, mut least) = (0.0, 0.0, f64::INFINITY);
    for k in low {
        let ratio = frf.frequency_hz[k] / first_hz;
        let weight = frf.magnitude_sigma[k].powi(-2).min(1e30);
        sum += weight * frf.response[k].re * (1.0 - ratio * ratio);
        weights += weight;
        least = frf.magnitude_sigma[k].min(least);
    }
    (weights > 0.0).then(|| Expected {
        value: sum / weights,
        sigma: least,
        repeatability_rad: 0.0,
    })
}

/// The age of a reading of a probe with its own clock is known to within a period of the probe: evenly distributed, T/sqrt(12).
fn age_sigma_s(config: &Config) -> f64 {
    let period_s = config.probe.rate_hz.map_or(0.0, |rate_hz| 1.0 / rate_hz);
    period_s / 12.0f64.sqrt()
}

/// Where tones may be placed: the loop at the frequencies of the certificate.
struct Places<'a> {
    frf: &'a Frf,
    model: &'a ClosedLoop,
    modes: &'a [CertifiedMode],
    age_sigma_s: f64,
}

impl Places<'_> {
    /// Indices of the two tones; `None` without a crossover.
    fn tones(&self) -> Option<[usize; 2]> {
        let is_falling = |k: &usize| self.gain(*k - 1).norm() > 1.0 && self.gain(*k).norm() <= 1.0;
        let crossover = (1..self.frf.len()).find(is_falling)?;
        let second = self.of_signs().or_else(|| self.nearest_to_minus_one())?;
        Some([crossover, second])
    }

    /// L.
    fn gain(&self, k: usize) -> Complex<f64> {
        self.frf.response[k] * self.model.law_response(TAU * self.frf.frequency_hz[k])
    }

    /// The index at which other signs change the phase most, if they change it enough.
    fn of_signs(&self) -> Option<usize> {
        let changes = self.repeatable();
        let changes = changes.filter(|k| self.gain(*k).norm() >= LEAST_GAIN);
        let changes = changes.map(|k| (k, self.change_by_signs_rad(k) / self.sigma_rad(k)));
        let largest = changes.max_by(|a, b| a.1.total_cmp(&b.1));
        largest
            .filter(|(_, change)| *change >= LEAST_CHANGE)
            .map(|(k, _)| k)
    }

    fn nearest_to_minus_one(&self) -> Option<usize> {
        let distance = |k: &usize| (self.gain(*k) + 1.0).norm();
        let places = self.repeatable();
        places.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// The indices with a repeatable phase.
    fn repeatable(&self) -> impl Iterator<Item = usize> + '_ {
        let inner = 1..self.frf.len().saturating_sub(1);
        inner.filter(|k| self.sigma_rad(*k) <= MAX_SIGMA_RAD)
    }

    fn sigma_rad(&self, k: usize) -> f64 {
        let expected = response(self.frf, k, self.age_sigma_s);
        let noise_rad = expected.sigma / expected.value.norm();
        noise_rad.hypot(expected.repeatability_rad)
    }

    /// |arg H'/H| of the modal model: H' has the other sign of the residues above the first mode.
    fn change_by_signs_rad(&self, k: usize) -> f64 {
        let s = Complex::new(0.0, TAU * self.frf.frequency_hz[k]);
        let mut terms = self.modes.iter().map(|mode| term(mode, s));
        let first = terms.next().unwrap_or_default();
        let others: Complex<f64> = terms.sum();
        ((first - others) / (first + others)).arg().abs()
    }
}

/// r/(s^2 + 2 zeta w s + w^2).
fn term(mode: &CertifiedMode, s: Complex<f64>) -> Complex<f64> {
    let w = TAU * mode.frequency_hz;
    (s * s + s * (2.0 * mode.damping_ratio * w) + w * w).inv() * mode.residue
}

/// d ln H / d ln f, from the neighbours.
fn slope(frf: &Frf, k: usize) -> Complex<f64> {
    let (below, above) = (k.saturating_sub(1), (k + 1).min(frf.len() - 1));
    let change = (frf.response[above] / frf.response[below]).ln();
    change / (frf.frequency_hz[above] / frf.frequency_hz[below]).ln()
}

fn tone(frf: &Frf, k: usize, config: &Config) -> Tone {
    Tone {
        frequency_hz: frf.frequency_hz[k],
        amplitude_a: amplitude_a(TONE_RATIO, frf.response[k].norm(), config),
    }
}

/// The current for a motion of this ratio of the soft limit, limited to a small ratio of the permitted current.
fn amplitude_a(travel_ratio: f64, metres_per_ampere: f64, config: &Config) -> f64 {
    let wanted_a = travel_ratio * config.interlock.soft_limit_m / metres_per_ampere;
    let continuous_a = config.motor.continuous_current_a();
    wanted_a.min(CURRENT_RATIO * continuous_a.min(config.amplifier.current_limit_a))
}

/// The response at a tone. Its phase is repeatable to within the drift of the modes, the unknown age of a reading, and 0.01 rad.
fn response(frf: &Frf, k: usize, age_sigma_s: f64) -> Expected<Complex<f64>> {
    let drift_rad = FREQUENCY_DRIFT * slope(frf, k).im;
    let age_rad = TAU * frf.frequency_hz[k] * age_sigma_s;
    Expected {
        value: frf.response[k],
        sigma: frf.magnitude_sigma[k],
        repeatability_rad: PHASE_REPEATABILITY_RAD.hypot(drift_rad).hypot(age_rad),
    }
}

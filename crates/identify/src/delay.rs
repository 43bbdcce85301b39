//! The excess delay of a measured response F over its model M: F = M exp(-j w tau).
//!
//! The phase of F/M falls by w tau. A coarse search over tau resolves the turns; then tau is fitted to the phases by
//! weighted least squares. Outliers are excluded: a mode at another frequency than the model's, or one that the model does
//! not have, changes the phase around it by half a turn without being a delay.

use nalgebra::Complex;

use super::{Estimate, Frf};

/// Delays up to this size in seconds, of either sign, are considered.
const MAX_DELAY_S: f64 = 0.05;
/// Smallest standard deviation of a phase, as the model is not more accurate.
const MIN_PHASE_SIGMA_RAD: f64 = 0.005;
/// Phases with a larger standard deviation are not used.
const MAX_PHASE_SIGMA_RAD: f64 = 0.5;
/// Phases that deviate by more than this multiple of the median deviation are outliers.
const OUTLIER_RATIO: f64 = 4.0;
/// A fit needs this many frequencies.
const MIN_FREQUENCIES: usize = 10;
/// Fits, each followed by a new selection of the outliers.
const FITS: usize = 4;

/// The delay tau in seconds of `measured` beyond `model`, both at the frequencies of `measured` up to `max_hz`; positive
/// where the measurement lags the model. `None` where too few phases are known well enough.
///
/// The standard deviation follows from the scatter of the phases about the fit.
pub fn excess_delay(measured: &Frf, model: &[Complex<f64>], max_hz: f64) -> Option<Estimate> {
    let all = phases(measured, model, max_hz);
    if all.len() < MIN_FREQUENCIES {
        return None;
    }
    let mut tau_s = coarse(&all)?;
    let mut used = all.clone();
    for _ in 0..FITS {
        tau_s += correction(&used, tau_s)?;
        used = without_outliers(&all, tau_s);
    }
    (used.len() >= MIN_FREQUENCIES).then(|| Estimate {
        value: tau_s,
        sigma: sigma(&used, tau_s),
    })
}

/// The ratio F/M at one frequency.
#[derive(Clone, Copy, Debug)]
struct Phase {
    omega_rad_s: f64,
    /// F/M, of magnitude 1.
    ratio: Complex<f64>,
    weight: f64,
}

impl Phase {
    /// The phase in radians that remains after a delay of `tau_s`.
    fn residual(&self, tau_s: f64) -> f64 {
        (self.ratio * Complex::from_polar(1.0, self.omega_rad_s * tau_s)).arg()
    }
}

fn phases(measured: &Frf, model: &[Complex<f64>], max_hz: f64) -> Vec<Phase> {
    let count = model.len().min(measured.len());
    (0..count)
        .filter(|k| measured.frequency_hz[*k] <= max_hz)
        .filter_map(|k| phase(measured, k, model[k]))
        .collect()
}

fn phase(measured: &Frf, k: usize, model: Complex<f64>) -> Option<Phase> {
    let ratio = measured.response[k] / model;
    let sigma_rad = measured.phase_sigma_rad[k].max(MIN_PHASE_SIGMA_RAD);
    let omega_rad_s = 2.0 * std::f64::consts::PI * measured.frequency_hz[k];
    let known = ratio.norm().is_normal() && sigma_rad < MAX_PHASE_SIGMA_RAD;
    known.then(|| Phase {
        omega_rad_s,
        ratio: ratio / ratio.norm(),
        weight: 1.0 / (sigma_rad * sigma_rad),
    })
}

/// The delay with the smallest residuals, on a grid of an eighth of the period of the highest frequency.
fn coarse(phases: &[Phase]) -> Option<f64> {
    let max_rad_s = phases.iter().map(|p| p.omega_rad_s).fold(0.0, f64::max);
    let step_s = std::f64::consts::PI / (4.0 * max_rad_s);
    let steps = (MAX_DELAY_S / step_s).ceil() as i64;
    let candidates = (-steps..=steps).map(|step| step as f64 * step_s);
    let aligned = candidates.map(|tau_s| (alignment(phases, tau_s), tau_s));
    let best = aligned.max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some(best.1)
}

/// The weighted sum of the cosines of the residual phases: largest where the delay explains the phases.
fn alignment(phases: &[Phase], tau_s: f64) -> f64 {
    phases
        .iter()
        .map(|phase| phase.weight * phase.residual(tau_s).cos())
        .sum()
}

/// The change of tau by weighted least squares.
fn correction(phases: &[Phase], tau_s: f64) -> Option<f64> {
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for phase in phases {
        let weighted = phase.weight * phase.omega_rad_s;
        numerator -= weighted * phase.residual(tau_s);
        denominator += weighted * phase.omega_rad_s;
    }
    (denominator > 0.0).then(|| numerator / denominator)
}

fn without_outliers(phases: &[Phase], tau_s: f64) -> Vec<Phase> {
    let mut deviations: Vec<f64> = phases.iter().map(|p| p.residual(tau_s).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    let median = deviations.get(deviations.len() / 2).copied().unwrap_or(0.0);
    let limit = OUTLIER_RATIO * median.max(MIN_PHASE_SIGMA_RAD);
    phases
        .iter()
        .copied()
        .filter(|p| p.residual(tau_s).abs() <= limit)
        .collect()
}

/// Standard deviation of tau by the scatter of the phases.
fn sigma(phases: &[Phase], tau_s: f64) -> f64 {
    let (mut weight, mut square) = (0.0, 0.0);
    for phase in phases {
        weight += phase.weight * phase.omega_rad_s * phase.omega_rad_s;
        square += phase.weight * phase.residual(tau_s) * phase.residual(tau_s);
    }
    let scatter = square / phases.len().saturating_sub(1).max(1) as f64;
    (scatter / weight).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrfPoint;

    fn mode(omega_rad_s: f64, at_rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega_rad_s);
        (s * s + s * 0.02 * at_rad_s + at_rad_s * at_rad_s).inv()
    }

    /// A measured response that lags its model by `tau_s`, with noise, and with a mode at 900 rad/s that the model has at
    /// 920 rad/s.
    fn case(tau_s: f64, noise: f64) -> (Frf, Vec<Complex<f64>>) {
        let (mut frf, mut model, mut seed) = (Frf::default(), Vec::new(), 1u64);
        let mut random = || {
            seed = seed
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for k in 1..400 {
            let w = 3.0 * f64::from(k);
            let m = mode(w, 180.0) + mode(w, 920.0) * 0.2;
            let f = (mode(w, 180.0) + mode(w, 900.0) * 0.2) * Complex::from_polar(1.0, -w * tau_s);
            let error = Complex::new(random(), random()) * noise * f.norm();
            model.push(m);
            let variance = (noise * f.norm()).powi(2) / 6.0;
            let frequency_hz = w / (2.0 * std::f64::consts::PI);
            frf.push(FrfPoint {
                frequency_hz,
                response: f + error,
                coherence: 1.0,
                variance,
                resolution_hz: 0.1,
            });
        }
        (frf, model)
    }

    #[test]
    fn finds_delay_of_either_sign_despite_displaced_mode() {
        for tau_s in [0.0, 1.37e-4, -2.5e-4, 3.1e-3, 0.021] {
            let (frf, model) = case(tau_s, 0.02);
            let delay = excess_delay(&frf, &model, 200.0).unwrap();
            // 300 phases of 0.006 rad at 600 rad/s on average: 0.6 us. The displaced mode adds a few us.
            assert!(
                (delay.value - tau_s).abs() < 1e-5,
                "{} for {tau_s}",
                delay.value
            );
            assert!((1e-7..1e-5).contains(&delay.sigma), "{}", delay.sigma);
        }
    }

    #[test]
    fn too_few_frequencies_give_no_delay() {
        let (frf, model) = case(1e-3, 0.01);
        assert_eq!(excess_delay(&frf, &model, 3.0), None);
        assert_eq!(excess_delay(&Frf::default(), &[], 100.0), None);
    }
}

//! How much later than the model a measured response answers: F = M exp(-j w tau).
//!
//! The phase of F/M falls by w tau. A coarse search over tau finds the turn, then the phases are fitted by weighted least
//! squares, without those that lie far off: a mode that the model has elsewhere, or not at all, turns the phase around it by
//! half a turn, and is no delay.

use nalgebra::Complex;

use super::Frf;

/// Delays up to this size in seconds, of either sign, are looked for.
const LARGEST_S: f64 = 0.05;
/// No phase counts as better known than this: the model is not.
const BEST_PHASE_RAD: f64 = 0.005;
/// Phases further off than so many median deviations are left out.
const FAR_OFF: f64 = 4.0;
/// Frequencies without which there is no fit.
const FEWEST: usize = 10;

/// A delay beyond the model's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExcessDelay {
    /// tau in seconds: positive where the measurement lags the model.
    pub seconds: f64,
    /// Standard deviation of tau in seconds, by the scatter of the phases about the fit.
    pub sigma_s: f64,
}

/// The delay of `measured` beyond `model`, both at the frequencies of `measured` up to `highest_hz`; `None` where too few
/// of them say anything.
pub fn beyond(measured: &Frf, model: &[Complex<f64>], highest_hz: f64) -> Option<ExcessDelay> {
    let points: Vec<Point> = points(measured, model, highest_hz);
    if points.len() < FEWEST {
        return None;
    }
    let mut tau_s = coarse(&points)?;
    let mut kept = points.clone();
    for _ in 0..4 {
        tau_s += fit(&kept, tau_s)?;
        kept = near(&points, tau_s);
    }
    let (weight, square) = kept.iter().fold((0.0, 0.0), |(weight, square), p| {
        (
            weight + p.weight * p.omega_rad_s * p.omega_rad_s,
            square + p.weight * p.off(tau_s) * p.off(tau_s),
        )
    });
    let scatter = square / (kept.len().saturating_sub(1).max(1)) as f64;
    (kept.len() >= FEWEST).then(|| ExcessDelay {
        seconds: tau_s,
        sigma_s: (scatter / weight).sqrt(),
    })
}

#[derive(Clone, Copy, Debug)]
struct Point {
    omega_rad_s: f64,
    /// F/M, of size 1.
    turn: Complex<f64>,
    weight: f64,
}

impl Point {
    /// The phase that a delay of `tau_s` leaves, in radians.
    fn off(&self, tau_s: f64) -> f64 {
        (self.turn * Complex::from_polar(1.0, self.omega_rad_s * tau_s)).arg()
    }
}

fn points(measured: &Frf, model: &[Complex<f64>], highest_hz: f64) -> Vec<Point> {
    let of = |(index, model): (usize, &Complex<f64>)| {
        let ratio = measured.response[index] / model;
        let sigma_rad = measured.phase_sigma_rad[index].max(BEST_PHASE_RAD);
        let omega_rad_s = 2.0 * std::f64::consts::PI * measured.frequency_hz[index];
        let good = ratio.norm().is_normal()
            && sigma_rad < 0.5
            && measured.frequency_hz[index] <= highest_hz;
        good.then(|| Point {
            omega_rad_s,
            turn: ratio / ratio.norm(),
            weight: 1.0 / (sigma_rad * sigma_rad),
        })
    };
    model
        .iter()
        .enumerate()
        .take(measured.len())
        .filter_map(of)
        .collect()
}

/// The delay that leaves the phases most in line, on a grid of an eighth of the fastest turn.
fn coarse(points: &[Point]) -> Option<f64> {
    let fastest = points.iter().map(|p| p.omega_rad_s).fold(0.0, f64::max);
    let step_s = std::f64::consts::PI / (4.0 * fastest);
    let steps = (LARGEST_S / step_s).ceil() as i64;
    let in_line = |tau_s: f64| {
        points
            .iter()
            .map(|p| p.weight * p.off(tau_s).cos())
            .sum::<f64>()
    };
    let candidates = (-steps..=steps).map(|step| step as f64 * step_s);
    candidates.max_by(|a, b| in_line(*a).total_cmp(&in_line(*b)))
}

/// The change of tau that fits best.
fn fit(points: &[Point], tau_s: f64) -> Option<f64> {
    let (top, bottom) = points.iter().fold((0.0, 0.0), |(top, bottom), p| {
        let weighted = p.weight * p.omega_rad_s;
        (
            top - weighted * p.off(tau_s),
            bottom + weighted * p.omega_rad_s,
        )
    });
    (bottom > 0.0).then(|| top / bottom)
}

fn near(points: &[Point], tau_s: f64) -> Vec<Point> {
    let mut sizes: Vec<f64> = points.iter().map(|p| p.off(tau_s).abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let limit = FAR_OFF
        * sizes
            .get(sizes.len() / 2)
            .copied()
            .unwrap_or(0.0)
            .max(BEST_PHASE_RAD);
    points
        .iter()
        .copied()
        .filter(|p| p.off(tau_s).abs() <= limit)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::FrfPoint;

    fn mode(omega_rad_s: f64, at_rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega_rad_s);
        (s * s + s * 0.02 * at_rad_s + at_rad_s * at_rad_s).inv()
    }

    /// A measured response that lags its model by `tau_s`, with noise and a mode at 900 rad/s that the model has at 920.
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
    fn a_delay_is_found_whatever_its_sign_and_in_spite_of_a_mode_that_lies_elsewhere() {
        for tau_s in [0.0, 1.37e-4, -2.5e-4, 3.1e-3, 0.021] {
            let (frf, model) = case(tau_s, 0.02);
            let delay = beyond(&frf, &model, 200.0).unwrap();
            // 300 phases of 0.006 rad at 600 rad/s in the mean: 0.6 us; the mode that lies elsewhere pulls by a few more.
            assert!(
                (delay.seconds - tau_s).abs() < 1e-5,
                "{} for {tau_s}",
                delay.seconds
            );
            assert!((1e-7..1e-5).contains(&delay.sigma_s), "{}", delay.sigma_s);
        }
    }

    #[test]
    fn too_few_frequencies_say_nothing() {
        let (frf, model) = case(1e-3, 0.01);
        assert_eq!(beyond(&frf, &model, 3.0), None);
        assert_eq!(beyond(&Frf::default(), &[], 100.0), None);
    }
}

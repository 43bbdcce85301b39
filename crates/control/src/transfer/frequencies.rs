//! Frequencies at which two responses are compared.

use nalgebra::Complex;

use super::domain::Domain;
use super::roots::{Factors, Roots};

/// The lowest frequency over the slowest pole. Below it the controller is a constant or integrators.
const BELOW_SLOWEST: f64 = 0.1;
/// The highest frequency of a continuous system over its fastest root.
const ABOVE_FASTEST: f64 = 1e3;
const POINTS_PER_DECADE: f64 = 40.0;
/// Limits in rad/s, so that a root near the ends of the range of doubles gives a finite number of points.
const LOWEST: f64 = 1e-100;
const HIGHEST: f64 = 1e100;
/// Distances from a root in units of its damping. None is 0: at an undamped root the response is 0 or infinite.
const AROUND: [f64; 8] = [-10.0, -3.0, -1.0, -0.3, 0.3, 1.0, 3.0, 10.0];

/// Rising frequencies in rad/s: an even logarithmic grid from a tenth of the slowest pole to half the servo rate (to a thousand times
/// the fastest root of a continuous system), and points around each root. Without poles other than integrators the zeros decide.
pub(super) fn frequencies(factors: &Factors, domain: Domain) -> Vec<f64> {
    let poles = places(&factors.poles, domain);
    let zeros = places(&factors.zeros, domain);
    let roots: Vec<Complex<f64>> = zeros.iter().chain(&poles).copied().collect();
    let slowest = if poles.is_empty() {
        slowest(&zeros)
    } else {
        slowest(&poles)
    };
    let fastest = roots.iter().map(|root| root.norm()).fold(0.0, f64::max);
    let (low, high) = limits(slowest, fastest, domain);
    let (low, high) = (low.clamp(LOWEST, HIGHEST), high.clamp(LOWEST, HIGHEST));
    let mut frequencies = even(low, high);
    frequencies.extend(roots.iter().flat_map(|root| around(*root)));
    frequencies.retain(|w| (low..=high).contains(w));
    frequencies.sort_by(f64::total_cmp);
    frequencies
}

/// The roots in rad/s, without integrators.
fn places(roots: &Roots, domain: Domain) -> Vec<Complex<f64>> {
    let places = roots.all().filter_map(|root| domain.rad_s(root));
    places.collect()
}

/// The smallest magnitude; 1 rad/s without roots.
fn slowest(roots: &[Complex<f64>]) -> f64 {
    let sizes = roots.iter().map(|root| root.norm());
    sizes.min_by(f64::total_cmp).unwrap_or(1.0)
}

fn limits(slowest: f64, fastest: f64, domain: Domain) -> (f64, f64) {
    let low = BELOW_SLOWEST * slowest;
    match domain {
        Domain::Continuous => (low, ABOVE_FASTEST * fastest.max(slowest)),
        Domain::Discrete { rate_hz } => {
            let half = std::f64::consts::PI * rate_hz;
            (low.min(BELOW_SLOWEST * half), half)
        }
    }
}

fn even(low: f64, high: f64) -> Vec<f64> {
    let decades = libm::log10(high / low);
    let count = libm::ceil(decades * POINTS_PER_DECADE).max(1.0) as usize;
    let frequency = |i: usize| low * libm::pow(10.0, decades * i as f64 / count as f64);
    (0..=count).map(frequency).collect()
}

/// Frequencies around a root in rad/s.
fn around(root: Complex<f64>) -> impl Iterator<Item = f64> {
    let damping_ratio = (root.re / root.norm()).abs().max(1e-3);
    let omega_rad_s = root.norm();
    AROUND
        .into_iter()
        .map(move |x| omega_rad_s * (1.0 + x * damping_ratio))
}

#[cfg(test)]
mod tests {
    use super::*;
    fn factors(poles: &[f64]) -> Factors {
        Factors {
            zeros: Roots::default(),
            poles: Roots {
                real: poles.to_vec(),
                pairs: Vec::new(),
            },
            gain: 1.0,
        }
    }

    #[test]
    fn grid_goes_from_below_the_slowest_pole_to_above_the_fastest_root() {
        let found = frequencies(&factors(&[-2.0, -500.0, 0.0]), Domain::Continuous);
        assert!((found[0] - 0.2).abs() < 1e-15);
        assert!((found[found.len() - 1] / 5e5 - 1.0).abs() < 1e-12);
        assert!(found.windows(2).all(|pair| pair[0] <= pair[1]));
    }

    #[test]
    fn grid_of_a_discrete_system_ends_at_half_the_rate() {
        // A pole at 50 rad/s and an integrator at 1 kHz.
        let domain = Domain::Discrete { rate_hz: 1000.0 };
        let found = frequencies(&factors(&[1.0, f64::exp(-0.05)]), domain);
        assert!((found[0] - 5.0).abs() < 1e-9, "{}", found[0]);
        let half = 1000.0 * std::f64::consts::PI;
        assert!((found[found.len() - 1] / half - 1.0).abs() < 1e-12);
    }

    #[test]
    fn roots_at_the_ends_of_the_range_of_doubles_give_a_finite_grid() {
        for poles in [&[-1e-308, -1e308][..], &[-f64::MIN_POSITIVE], &[0.0], &[]] {
            for domain in [Domain::Continuous, Domain::Discrete { rate_hz: 1e308 }] {
                let found = frequencies(&factors(poles), domain);
                assert!((1..20_000).contains(&found.len()), "{poles:?}");
                assert!(found.iter().all(|w| w.is_finite()), "{poles:?}");
            }
        }
    }
}

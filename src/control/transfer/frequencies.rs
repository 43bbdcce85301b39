//! Frequencies at which two responses are compared.

use nalgebra::Complex;

use super::domain::Domain;
use super::roots::Factors;

/// Below the slowest and above the fastest root, as a ratio.
const BEYOND: f64 = 1e3;
const POINTS_PER_DECADE: f64 = 40.0;
/// Tustin's rule puts zeros at z = -1, half the servo rate, where the response is 0 and has no relative difference.
const BELOW_NYQUIST: f64 = 0.99;
/// Limits in rad/s, so that a root near the ends of the range of doubles gives a finite number of points.
const LOWEST: f64 = 1e-100;
const HIGHEST: f64 = 1e100;
/// Distances from a root in units of its damping. None is 0: at an undamped root the response is 0 or infinite.
const AROUND: [f64; 8] = [-10.0, -3.0, -1.0, -0.3, 0.3, 1.0, 3.0, 10.0];

/// Rising frequencies in rad/s: an even logarithmic grid from below the slowest root to above the fastest one (to half the servo
/// rate of a discrete system), and points around each root.
pub(super) fn frequencies(factors: &Factors, domain: Domain) -> Vec<f64> {
    let roots = factors.zeros.all().chain(factors.poles.all());
    let roots: Vec<Complex<f64>> = roots.filter_map(|root| domain.rad_s(root)).collect();
    let sizes = roots.iter().map(|root| root.norm());
    let (low, high) = sizes.fold((f64::INFINITY, 0.0), |(low, high), size| {
        (f64::min(low, size), f64::max(high, size))
    });
    let (low, high) = if roots.is_empty() {
        (1.0, 1.0)
    } else {
        (low, high)
    };
    let (low, high) = limits(low, high, domain);
    let (low, high) = (low.clamp(LOWEST, HIGHEST), high.clamp(LOWEST, HIGHEST));
    let mut frequencies = even(low, high);
    frequencies.extend(roots.iter().flat_map(|root| around(*root)));
    frequencies.retain(|w| (low..=high).contains(w));
    frequencies.sort_by(f64::total_cmp);
    frequencies
}

fn limits(slowest: f64, fastest: f64, domain: Domain) -> (f64, f64) {
    match domain {
        Domain::Continuous => (slowest / BEYOND, fastest * BEYOND),
        Domain::Discrete { rate_hz } => {
            let highest = BELOW_NYQUIST * std::f64::consts::PI * rate_hz;
            (slowest.min(highest) / BEYOND, highest)
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
    use crate::control::transfer::Roots;

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
    fn grid_goes_from_below_the_slowest_to_above_the_fastest_root() {
        let found = frequencies(&factors(&[-2.0, -500.0, 0.0]), Domain::Continuous);
        assert!((found[0] - 2e-3).abs() < 1e-15);
        assert!((found[found.len() - 1] / 5e5 - 1.0).abs() < 1e-12);
        assert!(found.windows(2).all(|pair| pair[0] <= pair[1]));
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

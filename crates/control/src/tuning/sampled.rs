//! A plant as complex numbers on a grid of frequencies.

use nalgebra::Complex;

use super::disturbance::Variances;
use super::plant::DesignPlant;
use super::unmodelled::UnmodelledBound;
use crate::margins::grid;

/// A plant as complex numbers at some frequencies.
#[derive(Clone, Debug, Default)]
pub struct SampledPlant {
    /// Name of the plant.
    pub name: String,
    /// Whether the plant is an operating point itself, and not a variation.
    pub is_nominal: bool,
    /// Frequencies in rad/s, rising.
    pub omega_rad_s: Vec<f64>,
    /// j (2/T) tan(w T/2): where a section, discretised by Tustin's rule, has its continuous response.
    pub warped: Vec<Complex<f64>>,
    /// P(exp(j w T)) in m/A.
    pub response: Vec<Complex<f64>>,
    /// Largest magnitude in m/A of what the plant lacks: modes of unknown phase, and its uncertainty.
    pub unmodelled: Vec<f64>,
    /// Variance in m^2 of the disturbance and of the noise around each frequency; empty if the goal does not need them.
    pub variances: Vec<Variances>,
}

/// Spacing of a frequency grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spacing {
    /// For the search: some hundred points.
    Search,
    /// For the verification: some thousand points.
    Fine,
}

/// A plant at one frequency.
#[derive(Clone, Copy, Debug)]
struct Point {
    omega_rad_s: f64,
    warped: Complex<f64>,
    response: Complex<f64>,
    unmodelled: f64,
}

/// Upper end of the fine grid as a ratio of half the rate.
const HIGHEST: f64 = 1.0 - 1e-9;

impl SampledPlant {
    /// Samples of a plant at frequencies that follow its modes and `more` pairs of frequency (rad/s) and damping ratio.
    pub fn of(
        plant: &DesignPlant,
        bound: &UnmodelledBound,
        spacing: Spacing,
        more: &[(f64, f64)],
    ) -> SampledPlant {
        let mut features = plant.sampled_features();
        features.extend_from_slice(more);
        let nyquist_rad_s = std::f64::consts::PI / plant.plant.period_s();
        let range = (lowest_rad_s(plant), nyquist_rad_s * (1.0 - 1e-6));
        let omega_rad_s = match spacing {
            Spacing::Search => coarse_grid(range, &features, &bound.edges()),
            Spacing::Fine => {
                features.extend(bound.edges());
                grid(range.0, HIGHEST * nyquist_rad_s, &features)
            }
        };
        SampledPlant::at(plant, bound, omega_rad_s)
    }

    /// The plant with more points, without its variances.
    pub fn with_points(
        self,
        plant: &DesignPlant,
        bound: &UnmodelledBound,
        more_rad_s: Vec<f64>,
    ) -> SampledPlant {
        let more = SampledPlant::at(plant, bound, more_rad_s);
        let mut points: Vec<Point> = self.points().chain(more.points()).collect();
        points.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        points.dedup_by(|a, b| a.omega_rad_s == b.omega_rad_s);
        SampledPlant {
            omega_rad_s: points.iter().map(|point| point.omega_rad_s).collect(),
            warped: points.iter().map(|point| point.warped).collect(),
            response: points.iter().map(|point| point.response).collect(),
            unmodelled: points.iter().map(|point| point.unmodelled).collect(),
            variances: Vec::new(),
            ..self
        }
    }

    fn points(&self) -> impl Iterator<Item = Point> {
        (0..self.omega_rad_s.len()).map(|i| Point {
            omega_rad_s: self.omega_rad_s[i],
            warped: self.warped[i],
            response: self.response[i],
            unmodelled: self.unmodelled[i],
        })
    }

    /// Samples of a plant at some frequencies.
    pub fn at(plant: &DesignPlant, bound: &UnmodelledBound, omega_rad_s: Vec<f64>) -> SampledPlant {
        let period_s = plant.plant.period_s();
        let at = omega_rad_s.iter();
        SampledPlant {
            name: plant.name.clone(),
            is_nominal: plant.is_nominal,
            warped: at.clone().map(|w| warped(*w, period_s)).collect(),
            response: at.clone().map(|w| plant.plant.response(*w)).collect(),
            unmodelled: at
                .map(|w| bound.at(*w) + plant.uncertainty.at(*w))
                .collect(),
            variances: Vec::new(),
            omega_rad_s,
        }
    }
}

/// s = j (2/T) tan(w T/2).
pub fn warped(omega_rad_s: f64, period_s: f64) -> Complex<f64> {
    Complex::new(
        0.0,
        2.0 / period_s * libm::tan(omega_rad_s * period_s / 2.0),
    )
}

/// The lowest frequency of the grids: a small part of that of the first mode.
fn lowest_rad_s(plant: &DesignPlant) -> f64 {
    let first = plant.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
    let first_rad_s = first.map_or(1.0, |mode| mode.omega_rad_s);
    let nyquist_rad_s = std::f64::consts::PI / plant.plant.period_s();
    4e-3 * first_rad_s.min(nyquist_rad_s)
}

/// A logarithmic grid of 90 points per decade, with points w (1 + zeta sinh x) around each feature, and three points around each
/// edge of the bound.
fn coarse_grid((low, high): (f64, f64), features: &[(f64, f64)], edges: &[(f64, f64)]) -> Vec<f64> {
    const PER_DECADE: f64 = 90.0;
    let decades = libm::log10(high / low);
    let count = libm::ceil(decades * PER_DECADE) as usize;
    let even = (0..=count).map(|i| low * libm::pow(10.0, decades * i as f64 / count as f64));
    let mut grid: Vec<f64> = even.collect();
    grid.extend(features.iter().flat_map(|f| around(*f, 14, 0.35)));
    grid.extend(edges.iter().flat_map(|f| around(*f, 1, 1.0)));
    grid.retain(|w| (low..=high).contains(w));
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}

fn around((w, zeta): (f64, f64), count: i32, step: f64) -> impl Iterator<Item = f64> {
    (-count..=count).map(move |i| w * (1.0 + zeta.max(1e-6) * libm::sinh(f64::from(i) * step)))
}

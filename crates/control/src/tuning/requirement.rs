//! What a design must fulfil: the goal, the limits, and their slack at each frequency of each plant.
//!
//! With L = P C, U the bound of what P lacks, and g the smallest distance of L from -1,
//!
//! ```text
//!  g(w) = |1 + L| - |C| U
//!
//!  modulus margin       g/m - 1 >= 0               at all frequencies
//!  gain, phase margin   (|L + x| - |C| U)/r - 1 >= 0  at all frequencies: disc of margin_disc.rs
//!  sensitivity          g s - 1 >= 0               at given frequencies: |S| <= s
//!  control sensitivity  g c/|C| - 1 >= 0           at all frequencies: |K S| <= c
//!  current              ln(c/sigma_i) >= 0         sigma_i: standard deviation of the current
//!  goal disturbance     ln(g w/(sqrt(2) ws)) >= 0  for w <= ws: |S| <= w/(sqrt(2) ws)
//!  goal bandwidth       ln(g/sqrt(2)) >= 0         for w <= wb: |S| <= 1/sqrt(2)
//! ```
//!
//! The margins and the limit of |K S| hold for all plants; goal, current and limits of |S| for the operating points themselves, not
//! for their variations. Each slack is relative, so that a slack of -0.01 misses its limit by 1 %.

use nalgebra::Complex;
use serde::Serialize;

use super::cascade::Cascade;
use super::margin_disc::MarginDisc;
use super::sampled::SampledPlant;
use super::variance::{current_sigma_a, current_sigma_gradient, sigma_gradient, sigma_m};

/// What a design maximises or minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// The largest slope bandwidth ws, |S(jw)| <= w/(sqrt(2) ws) for all w <= ws: rejection of slow disturbances.
    Disturbance,
    /// The largest sensitivity bandwidth wb, |S(jw)| <= 1/sqrt(2) for all w <= wb.
    Bandwidth,
    /// The smallest standard deviation of the error.
    Rms,
}

/// An upper limit of |S| at one frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SensitivityLimit {
    /// The limit.
    pub magnitude: f64,
    /// The frequency in rad/s.
    pub omega_rad_s: f64,
}

/// Goal and limits of a design.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Requirements {
    /// What is maximised.
    pub goal: Goal,
    /// Least distance of L from -1, at all frequencies of all plants.
    pub modulus_margin: f64,
    /// Upper limits of |S|.
    pub max_sensitivity: Vec<SensitivityLimit>,
    /// Upper limit of |K S| in A/m.
    pub max_control_sensitivity_a_per_m: Option<f64>,
    /// The disc of a gain margin and a phase margin, at all frequencies of all plants.
    pub margin_disc: Option<MarginDisc>,
    /// Upper limit of the standard deviation of the current in A, under disturbance and noise.
    pub max_current_rms_a: Option<f64>,
}

/// A kind of requirement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The modulus margin.
    ModulusMargin,
    /// The disc of a gain margin and a phase margin.
    MarginDisc,
    /// An upper limit of |S|.
    Sensitivity,
    /// The upper limit of |K S|.
    ControlSensitivity,
    /// The upper limit of the standard deviation of the current.
    CurrentRms,
    /// The goal.
    Goal,
}

impl std::fmt::Display for Kind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Kind::ModulusMargin => "modulus margin",
            Kind::MarginDisc => "gain and phase margin",
            Kind::Sensitivity => "limit of |S|",
            Kind::ControlSensitivity => "limit of |KS|",
            Kind::CurrentRms => "limit of the rms current",
            Kind::Goal => "goal",
        })
    }
}

/// The slack of one requirement at one frequency of one plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slack {
    /// What is required.
    pub kind: Kind,
    /// Index of the plant.
    pub plant: usize,
    /// Index of the frequency; 0 of a requirement on the whole spectrum.
    pub point: usize,
    /// Positive if it is fulfilled; relative to the limit.
    pub value: f64,
}

/// L, C and their distance to -1 at one frequency.
struct Loop {
    controller: Complex<f64>,
    /// 1 + L.
    difference: Complex<f64>,
    /// g.
    distance: f64,
}

impl Loop {
    fn of(plant: &SampledPlant, point: usize, cascade: &Cascade) -> Loop {
        let controller = cascade.response(plant.warped[point]);
        let difference = plant.response[point] * controller + 1.0;
        Loop {
            controller,
            difference,
            distance: difference.norm() - controller.norm() * plant.unmodelled[point],
        }
    }

    /// |L + x| - |C| U.
    fn distance_from(&self, centre: f64, unmodelled: f64) -> f64 {
        (self.difference - 1.0 + centre).norm() - self.controller.norm() * unmodelled
    }

    /// The derivatives of |L + x| - |C| U, given those of ln C: Re(conj(L + x)/|L + x| L dlnC) - |C| U Re dlnC.
    fn distance_gradient(&self, centre: f64, unmodelled: f64, log: &[Complex<f64>]) -> Vec<f64> {
        let difference = self.difference - 1.0 + centre;
        let direction = difference.conj() / difference.norm().max(f64::MIN_POSITIVE);
        let weight = direction * (self.difference - 1.0) - self.controller.norm() * unmodelled;
        log.iter().map(|d| (weight * d).re).collect()
    }
}

/// A small positive number in place of a distance that is not positive, for logarithms.
const LEAST_DISTANCE: f64 = 1e-3;

impl Requirements {
    /// A goal and a modulus margin, without other limits.
    pub fn new(goal: Goal, modulus_margin: f64) -> Requirements {
        Requirements {
            goal,
            modulus_margin,
            max_sensitivity: Vec::new(),
            max_control_sensitivity_a_per_m: None,
            margin_disc: None,
            max_current_rms_a: None,
        }
    }

    /// The slack of all requirements for a target of the goal: ws or wb in rad/s, or the standard deviation in metres.
    pub fn slacks(&self, plants: &[SampledPlant], cascade: &Cascade, target: f64) -> Vec<Slack> {
        let mut slacks = Vec::new();
        for (index, plant) in plants.iter().enumerate() {
            self.add_slacks(index, plant, cascade, target, &mut slacks);
        }
        slacks
    }

    fn add_slacks(
        &self,
        index: usize,
        plant: &SampledPlant,
        cascade: &Cascade,
        target: f64,
        slacks: &mut Vec<Slack>,
    ) {
        let loops: Vec<Loop> = (0..plant.omega_rad_s.len())
            .map(|point| Loop::of(plant, point, cascade))
            .collect();
        let mut add = |kind, point, value: Option<f64>| {
            slacks.extend(value.map(|value| Slack {
                kind,
                plant: index,
                point,
                value,
            }));
        };
        for (point, at) in loops.iter().enumerate() {
            let w = plant.omega_rad_s[point];
            add(
                Kind::ModulusMargin,
                point,
                Some(at.distance / self.modulus_margin - 1.0),
            );
            let disc = self.margin_disc.map(|disc| {
                at.distance_from(disc.centre, plant.unmodelled[point]) / disc.radius - 1.0
            });
            add(Kind::MarginDisc, point, disc);
            add(Kind::ControlSensitivity, point, self.control_slack(at));
            if plant.is_nominal {
                add(Kind::Goal, point, self.goal_slack(at, w, target));
            }
        }
        if !plant.is_nominal {
            return;
        }
        for limit in &self.max_sensitivity {
            let point = nearest(&plant.omega_rad_s, limit.omega_rad_s);
            let slack = loops[point].distance * limit.magnitude - 1.0;
            add(Kind::Sensitivity, point, Some(slack));
        }
        if let Some(limit_a) = self.max_current_rms_a {
            let slack = libm::log(limit_a / current_sigma_a(plant, cascade));
            add(Kind::CurrentRms, 0, Some(slack));
        }
        if self.goal == Goal::Rms {
            let sigma_m = sigma_m(plant, cascade);
            add(Kind::Goal, 0, Some(libm::log(target / sigma_m)));
        }
    }

    fn control_slack(&self, at: &Loop) -> Option<f64> {
        let limit = self.max_control_sensitivity_a_per_m?;
        Some(at.distance * limit / at.controller.norm() - 1.0)
    }

    fn goal_slack(&self, at: &Loop, omega_rad_s: f64, target: f64) -> Option<f64> {
        if self.goal == Goal::Rms || omega_rad_s > target {
            return None;
        }
        let required = self.required_distance(omega_rad_s, target);
        // Below the least distance the logarithm is continued by its tangent.
        let ratio = at.distance / LEAST_DISTANCE;
        let logarithm = if ratio > 1.0 {
            libm::log(ratio)
        } else {
            ratio - 1.0
        };
        Some(logarithm + libm::log(LEAST_DISTANCE / required))
    }

    /// The least distance of L from -1 that the goal requires below its target.
    fn required_distance(&self, omega_rad_s: f64, target: f64) -> f64 {
        match self.goal {
            Goal::Disturbance => std::f64::consts::SQRT_2 * target / omega_rad_s,
            Goal::Bandwidth | Goal::Rms => std::f64::consts::SQRT_2,
        }
    }

    /// The derivatives of a slack with respect to the parameters of the cascade.
    pub fn gradient(&self, plants: &[SampledPlant], cascade: &Cascade, slack: &Slack) -> Vec<f64> {
        let plant = &plants[slack.plant];
        if slack.kind == Kind::Goal && self.goal == Goal::Rms {
            return sigma_gradient(plant, cascade);
        }
        if slack.kind == Kind::CurrentRms {
            return current_sigma_gradient(plant, cascade);
        }
        let at = Loop::of(plant, slack.point, cascade);
        let log = cascade.log_gradient(plant.warped[slack.point]);
        let unmodelled = plant.unmodelled[slack.point];
        if let (Kind::MarginDisc, Some(disc)) = (slack.kind, self.margin_disc) {
            let gradient = at.distance_gradient(disc.centre, unmodelled, &log);
            return scaled(gradient, 1.0 / disc.radius);
        }
        let gradient = at.distance_gradient(1.0, unmodelled, &log);
        match slack.kind {
            Kind::ModulusMargin => scaled(gradient, 1.0 / self.modulus_margin),
            Kind::Sensitivity => {
                let w = plant.omega_rad_s[slack.point];
                scaled(gradient, self.sensitivity_limit(&plant.omega_rad_s, w))
            }
            // The disc and the current are answered above.
            Kind::Goal | Kind::MarginDisc | Kind::CurrentRms => {
                scaled(gradient, 1.0 / at.distance.max(LEAST_DISTANCE))
            }
            Kind::ControlSensitivity => {
                let ratio =
                    self.max_control_sensitivity_a_per_m.unwrap_or(0.0) / at.controller.norm();
                let terms = gradient.iter().zip(&log);
                terms
                    .map(|(d, c)| ratio * (d - at.distance * c.re))
                    .collect()
            }
        }
    }

    /// The smallest limit of |S| whose nearest grid point is `omega_rad_s`.
    fn sensitivity_limit(&self, grid: &[f64], omega_rad_s: f64) -> f64 {
        let here = self
            .max_sensitivity
            .iter()
            .filter(|limit| grid[nearest(grid, limit.omega_rad_s)] == omega_rad_s);
        here.map(|limit| limit.magnitude)
            .fold(f64::INFINITY, f64::min)
    }

    /// The same requirements with the limits of |S| times a factor.
    pub fn relaxed(&self, factor: f64) -> Requirements {
        let limits = self.max_sensitivity.iter();
        let relaxed = limits.map(|limit| SensitivityLimit {
            magnitude: limit.magnitude * factor,
            ..*limit
        });
        Requirements {
            max_sensitivity: relaxed.collect(),
            ..self.clone()
        }
    }

    /// The smallest factor of the limits of |S| with which a cascade fulfils them, at least 1.
    pub fn relaxation(&self, plants: &[SampledPlant], cascade: &Cascade) -> f64 {
        let mut factor: f64 = 1.0;
        for plant in plants.iter().filter(|plant| plant.is_nominal) {
            for limit in &self.max_sensitivity {
                let point = nearest(&plant.omega_rad_s, limit.omega_rad_s);
                let distance = Loop::of(plant, point, cascade).distance;
                factor = factor.max(1.0 / (distance.max(LEAST_DISTANCE) * limit.magnitude));
            }
        }
        factor
    }

    /// The largest factor of |S| that a requirement limits to 1 at a frequency of a grid.
    pub fn sensitivity_weight(&self, grid: &[f64], point: usize, target: f64) -> f64 {
        let w = grid[point];
        let goal = if w <= target {
            self.required_distance(w, target)
        } else {
            0.0
        };
        let limits = self.max_sensitivity.iter();
        let here = limits.filter(|limit| nearest(grid, limit.omega_rad_s) == point);
        let weights = here.map(|limit| 1.0 / limit.magnitude);
        weights.fold(self.modulus_margin.max(goal), f64::max)
    }

    /// Whether the variances of disturbance and noise are needed.
    pub fn needs_variances(&self) -> bool {
        self.goal == Goal::Rms || self.max_current_rms_a.is_some()
    }

    /// A target that every loop attains.
    pub fn easiest_target(&self) -> f64 {
        match self.goal {
            Goal::Rms => f64::MAX,
            Goal::Disturbance | Goal::Bandwidth => 0.0,
        }
    }

    /// A target that is harder by a relative stride.
    pub fn harder(&self, target: f64, stride: f64) -> f64 {
        match self.goal {
            Goal::Rms => target * libm::exp(-stride),
            Goal::Disturbance | Goal::Bandwidth => target * libm::exp(stride),
        }
    }

    /// The value of the goal that a cascade attains at all operating points, whatever its margins are.
    pub fn attained(&self, plants: &[SampledPlant], cascade: &Cascade) -> f64 {
        let nominal = plants.iter().filter(|plant| plant.is_nominal);
        let values = nominal.map(|plant| self.attained_at(plant, cascade));
        match self.goal {
            Goal::Rms => values.fold(0.0, f64::max),
            Goal::Disturbance | Goal::Bandwidth => values.fold(f64::INFINITY, f64::min),
        }
    }

    fn attained_at(&self, plant: &SampledPlant, cascade: &Cascade) -> f64 {
        let points = 0..plant.omega_rad_s.len();
        let distances = points.map(|point| Loop::of(plant, point, cascade).distance);
        match self.goal {
            Goal::Disturbance => slope_bandwidth_rad_s(&plant.omega_rad_s, distances),
            Goal::Bandwidth => sensitivity_bandwidth_rad_s(&plant.omega_rad_s, distances),
            Goal::Rms => sigma_m(plant, cascade),
        }
    }
}

fn scaled(gradient: Vec<f64>, factor: f64) -> Vec<f64> {
    gradient.into_iter().map(|d| d * factor).collect()
}

fn nearest(grid: &[f64], omega_rad_s: f64) -> usize {
    let after = grid
        .partition_point(|w| *w < omega_rad_s)
        .min(grid.len() - 1);
    let before = after.saturating_sub(1);
    if omega_rad_s - grid[before] < grid[after] - omega_rad_s {
        before
    } else {
        after
    }
}

/// The largest ws with |S| <= w/(sqrt(2) ws) for all w <= ws, from the distances of L from -1 over rising frequencies:
/// F(w) = w |1 + L|/sqrt(2) is at least ws for all w <= ws. Interpolated where F falls below w.
pub fn slope_bandwidth_rad_s(omega_rad_s: &[f64], distances: impl Iterator<Item = f64>) -> f64 {
    let mut attained = f64::INFINITY;
    let mut before: Option<(f64, f64)> = None;
    for (w, distance) in omega_rad_s.iter().copied().zip(distances) {
        if w >= attained {
            break;
        }
        let figure = w * distance.max(0.0) / std::f64::consts::SQRT_2;
        if figure < w {
            // Below the first frequency L is K/s, and F nearly constant.
            let crossing = before.map_or(figure, |(w0, e0)| w0 + (w - w0) * e0 / (e0 + w - figure));
            return attained.min(crossing);
        }
        attained = attained.min(figure);
        before = Some((w, figure - w));
    }
    attained
}

/// The lowest frequency at which |S| rises through 1/sqrt(2), from the distances of L from -1 over rising frequencies; interpolated.
pub fn sensitivity_bandwidth_rad_s(
    omega_rad_s: &[f64],
    distances: impl Iterator<Item = f64>,
) -> f64 {
    let excess = distances.map(|distance| distance - std::f64::consts::SQRT_2);
    let mut before: Option<(f64, f64)> = None;
    for (w, e) in omega_rad_s.iter().copied().zip(excess) {
        match before {
            Some((w0, e0)) if e < 0.0 => return w0 + (w - w0) * e0 / (e0 - e),
            None if e < 0.0 => return w,
            _ => before = Some((w, e)),
        }
    }
    before.map_or(0.0, |(w, _)| w)
}

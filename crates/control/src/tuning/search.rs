//! The global search: cascades of rising order, each grown from the best ones of the order before.
//!
//! A biquad with equal zeros and poles does not change a controller. So a cascade of higher order begins where the best one of lower
//! order ends, with such a biquad at a random frequency, and only improves. The best few of each order are kept.

use rand_core::Rng;
use rand_pcg::Pcg64;

use super::cascade::Cascade;
use super::descent::{Candidate, Problem};
use super::requirement::Goal;
use bench_base::progress::Progress;

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Cascades that are kept of each order.
    pub kept: usize,
    /// Cascades that are grown from each of them.
    pub grown: usize,
    /// Linear programmes for each.
    pub steps: usize,
    /// Linear programmes for the final improvement.
    pub final_steps: usize,
}

impl Default for Effort {
    fn default() -> Effort {
        Effort {
            kept: 3,
            grown: 5,
            steps: 80,
            final_steps: 250,
        }
    }
}

impl Effort {
    /// Half of the cascades.
    fn half(&self) -> Effort {
        Effort {
            kept: (2 * self.kept).div_ceil(3),
            grown: (3 * self.grown).div_ceil(4),
            ..*self
        }
    }
}

/// The best cascades of an order, the best first: searched with the plants of `problem`, finally improved with those of `whole`.
///
/// There are two starts with half of the effort each, since one alone can end in a local optimum that is 10 % lower. For the goals
/// [`Goal::Bandwidth`] and [`Goal::Rms`] the second one has the goal [`Goal::Disturbance`]: such a loop has much rejection at low
/// frequency, which can be exchanged for bandwidth or for less error elsewhere.
pub fn search(
    problem: &Problem,
    whole: &Problem,
    order: usize,
    effort: &Effort,
    seed: u64,
    progress: &Progress,
) -> Vec<Candidate> {
    let guide = problem.with_goal(Goal::Disturbance);
    let mut kept = Vec::new();
    for (problem, stream) in [problem, &guide].into_iter().zip(STREAMS) {
        let random = Pcg64::new(u128::from(seed), stream);
        kept.extend(grow(problem, order, &effort.half(), random, progress));
    }
    progress.begin("improvement", kept.len() as u64);
    let improved = kept.iter().map(|candidate| {
        let improved = whole.improve(&candidate.cascade, effort.final_steps);
        progress.advance(1);
        improved
    });
    best(problem, improved.collect(), kept.len())
}

/// Streams of random numbers of the two starts.
const STREAMS: [u128; 2] = [0x7455_6e65, 0x7455_6e66];

/// The best cascades of an order, grown from lower orders.
fn grow(
    problem: &Problem,
    order: usize,
    effort: &Effort,
    mut random: Pcg64,
    progress: &Progress,
) -> Vec<Candidate> {
    let rounds = (order.max(1) - 1) / 2;
    progress.begin("search", (1 + rounds * effort.kept * effort.grown) as u64);
    let mut kept = vec![problem.improve(&first(problem, order), effort.steps)];
    progress.advance(1);
    for _ in 0..rounds {
        let mut grown = Vec::new();
        for candidate in &kept {
            for _ in 0..effort.grown {
                let cascade = with_neutral_biquad(problem, &candidate.cascade, &mut random);
                grown.push(problem.improve(&cascade, effort.steps));
                progress.advance(1);
            }
        }
        kept = best(problem, grown, effort.kept);
    }
    kept
}

/// An integrator with |L| far below 1 at all frequencies, and a neutral lead if the order is even.
fn first(problem: &Problem, order: usize) -> Cascade {
    let unit = Cascade::integrator(1.0);
    let cascade = match order % 2 {
        0 => {
            let neutral = (problem.limits.lowest_rad_s * problem.limits.pole_rad_s).sqrt();
            unit.with_zero_pole(neutral, neutral)
        }
        _ => unit,
    };
    let loop_gains = problem.plants.iter().flat_map(|plant| {
        let points = 0..plant.omega_rad_s.len();
        points
            .filter(|i| *i == 0 || is_peak(&plant.response, *i))
            .map(|i| (plant.response[i] * cascade.response(plant.warped[i])).norm() * weight(i))
    });
    cascade
        .clone()
        .scaled(FIRST_GAIN / loop_gains.fold(0.0, f64::max))
}

/// |L| at the resonances of the first cascade.
const FIRST_GAIN: f64 = 0.4;

/// The lowest frequency of a grid is far below the resonances, where |L| may be above 1 but not much.
fn weight(point: usize) -> f64 {
    if point == 0 { 0.1 } else { 1.0 }
}

fn is_peak(response: &[nalgebra::Complex<f64>], i: usize) -> bool {
    let magnitude = |i: usize| response[i].norm();
    let is_inside = i > 0 && i + 1 < response.len();
    is_inside && magnitude(i) > magnitude(i - 1) && magnitude(i) > magnitude(i + 1)
}

/// The cascade with a biquad that has equal zeros and poles at a random frequency.
fn with_neutral_biquad(problem: &Problem, cascade: &Cascade, random: &mut Pcg64) -> Cascade {
    let limits = &problem.limits;
    let omega_rad_s = if uniform(random) < NEAR_MODES {
        near_mode_rad_s(problem, random)
    } else {
        let low = 20.0 * limits.lowest_rad_s;
        low * libm::pow(limits.pole_rad_s / low, uniform(random))
    };
    let least = limits.pole_damping_ratio;
    let damping_ratio = least * libm::pow(1.0 / least, uniform(random));
    let pair = (omega_rad_s, damping_ratio);
    cascade.clone().with_biquad(pair, pair)
}

/// Part of the biquads that begin near a mode.
const NEAR_MODES: f64 = 0.6;

/// The frequency of a mode, or one up to 5 % beside it.
fn near_mode_rad_s(problem: &Problem, random: &mut Pcg64) -> f64 {
    let modes = &problem.modes_rad_s;
    let index = (uniform(random) * modes.len() as f64) as usize;
    let mode = modes.get(index).copied();
    let factor = 1.0 + 0.05 * (2.0 * uniform(random) - 1.0);
    mode.map_or(problem.limits.pole_rad_s, |w| {
        w.min(problem.limits.pole_rad_s)
    }) * factor
}

/// A number from 0 to 1.
fn uniform(random: &mut Pcg64) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// The best candidates, without those whose target another one attains to 0.01 %.
fn best(problem: &Problem, mut candidates: Vec<Candidate>, count: usize) -> Vec<Candidate> {
    candidates.sort_by(|a, b| merit(problem, b).total_cmp(&merit(problem, a)));
    candidates.dedup_by(|a, b| (merit(problem, a) - merit(problem, b)).abs() < 1e-4);
    candidates.truncate(count);
    candidates
}

/// ln of the target, larger for a better one; a candidate that misses a limit comes after all that do not.
fn merit(problem: &Problem, candidate: &Candidate) -> f64 {
    match (candidate.target, problem.requirements.goal) {
        (Some(target), Goal::Rms) => -libm::log(target),
        (Some(target), Goal::Disturbance | Goal::Bandwidth) => libm::log(target),
        (None, _) => candidate.slack - 1e3,
    }
}

//! The verification of a design on a fine grid, and its improvement with the frequencies that the search missed.

use super::binding::{Binding, tightest, valleys};
use super::bound::excluded_plant;
use super::cascade::Cascade;
use super::descent::{Candidate, Problem};
use super::design::{Design, DesignTask, RESERVE};
use super::error::{Conflict, TuneError};
use super::figures::{closed_poles, figures, fine_samples};
use super::plant::DesignPlant;
use super::requirement::{Goal, Kind};
use super::sampled::SampledPlant;
use crate::features;
use bench_base::units::hz;

/// Rounds of verification and improvement of each candidate.
const ROUNDS: usize = 10;
/// In each round the reserve grows by what a limit is missed by, but at most by this ratio: a deep valley between the frequencies of
/// the grid is mended by its new frequency, and not by the reserve.
const MOST_GROWTH: f64 = 2e-3;
/// A goal that is missed by less between the frequencies of the grid is not mended: what is attained counts.
const GOAL_TOLERANCE: f64 = 2e-3;
/// Slack up to which a requirement binds.
const BINDING: f64 = 0.01;

/// Where a design misses its requirements.
struct Missed {
    /// Frequencies in rad/s for each plant.
    frequencies_rad_s: Vec<Vec<f64>>,
    /// By how much the worst limit is missed, relative to it; 0 if only the goal is missed.
    worst_ratio: f64,
}

impl DesignTask {
    /// Where a limit is missed on the fine grid, or the goal by more than [`GOAL_TOLERANCE`].
    fn missed(&self, cascade: &Cascade, target: f64) -> Missed {
        let fine = fine_samples(&self.plants, &self.bound, &self.disturbance, cascade);
        let slacks = self.requirements.slacks(&fine, cascade, target);
        let mut missed = Missed {
            frequencies_rad_s: vec![Vec::new(); fine.len()],
            worst_ratio: 0.0,
        };
        for slack in valleys(&slacks) {
            let tolerance = match slack.kind {
                Kind::Goal => GOAL_TOLERANCE,
                _ => 0.0,
            };
            if slack.value < -tolerance {
                let omega_rad_s = fine[slack.plant].omega_rad_s[slack.point];
                missed.frequencies_rad_s[slack.plant].push(omega_rad_s);
                if slack.kind != Kind::Goal {
                    missed.worst_ratio = missed.worst_ratio.max(-slack.value);
                }
            }
        }
        missed
    }

    /// The candidate after rounds of verification on a fine grid, and of improvement with the frequencies where it misses a limit.
    pub(super) fn mended(
        &self,
        mut problem: Problem,
        mut candidate: Candidate,
    ) -> Result<Design, TuneError> {
        let mut reserve_ratio = RESERVE;
        for _ in 0..ROUNDS {
            let target = candidate
                .target
                .ok_or_else(|| self.conflict(&problem, &candidate))?;
            if let Some(unstable) = self.unstable(&candidate.cascade.clone().rounded()) {
                self.add_points(&mut problem, &unstable);
                let start = stable(&problem, candidate.cascade);
                candidate = problem.improve(&start, self.effort.final_steps);
                continue;
            }
            let missed = self.missed(&candidate.cascade.clone().rounded(), target);
            if missed.frequencies_rad_s.iter().all(Vec::is_empty) {
                break;
            }
            reserve_ratio += missed.worst_ratio.min(MOST_GROWTH);
            self.add_points(&mut problem, &missed.frequencies_rad_s);
            problem.requirements.modulus_margin = self.margin_with_reserve(reserve_ratio);
            candidate = problem.mend(&candidate.cascade, target, self.effort.final_steps);
        }
        match candidate.target {
            Some(_) => self.verified(candidate.cascade),
            None => Err(self.conflict(&problem, &candidate)),
        }
    }

    /// Frequencies in rad/s for each plant around its unstable poles; `None` if the loop with every plant is stable. The search counts
    /// the turns of the Nyquist curve on its grid, which leaves out a resonance that it does not resolve.
    fn unstable(&self, cascade: &Cascade) -> Option<Vec<Vec<f64>>> {
        let around = self.plants.iter().map(|plant| {
            let period_s = plant.plant.period_s();
            unstable_pairs(plant, cascade)
                .into_iter()
                .flat_map(around_pole)
                .filter(|w| *w > 0.0 && w * period_s < std::f64::consts::PI)
                .collect()
        });
        let around: Vec<Vec<f64>> = around.collect();
        let is_unstable = around.iter().any(|w| !w.is_empty());
        is_unstable.then_some(around)
    }

    /// The design that keeps the modulus margin and attains more.
    pub(super) fn better(
        &self,
        one: Result<Design, TuneError>,
        other: Result<Design, TuneError>,
    ) -> Result<Design, TuneError> {
        let (first, second) = match (one, other) {
            (Ok(first), Ok(second)) => (first, second),
            (Ok(design), Err(_)) | (Err(_), Ok(design)) => return Ok(design),
            (Err(error), Err(_)) => return Err(error),
        };
        let rank = |design: &Design| {
            let keeps = design
                .misses_margin(self.requirements.modulus_margin)
                .is_none();
            let attained = match self.requirements.goal {
                Goal::Rms => -design.attained,
                Goal::Disturbance | Goal::Bandwidth => design.attained,
            };
            (keeps, attained)
        };
        if rank(&second) > rank(&first) {
            Ok(second)
        } else {
            Ok(first)
        }
    }

    fn add_points(&self, problem: &mut Problem, missed: &[Vec<f64>]) {
        for (index, added) in missed.iter().enumerate().filter(|(_, w)| !w.is_empty()) {
            let mut grid = problem.plants[index].omega_rad_s.clone();
            grid.extend_from_slice(added);
            grid.sort_by(f64::total_cmp);
            grid.dedup();
            let plant = &self.plants[index];
            let sampled = SampledPlant::at(plant, &self.bound, grid);
            problem.plants[index] = self.completed(sampled, plant);
        }
    }

    fn verified(&self, cascade: Cascade) -> Result<Design, TuneError> {
        let cascade = cascade.rounded();
        let fine = fine_samples(&self.plants, &self.bound, &self.disturbance, &cascade);
        let attained = self.requirements.attained(&fine, &cascade);
        let figures = figures(&self.plants, &fine, &cascade);
        if let Some(unstable) = figures.iter().find(|figures| !figures.stable) {
            let plant = self
                .plants
                .iter()
                .find(|plant| plant.name == unstable.plant);
            let pairs = plant.map(|plant| unstable_pairs(plant, &cascade));
            let pole = pairs.and_then(|pairs| pairs.first().copied());
            return Err(TuneError::Unstable {
                plant: unstable.plant.clone(),
                pole_hz: pole.map_or(f64::NAN, |(w, _)| hz(w)),
                order: self.order,
            });
        }
        let slacks = self.requirements.slacks(&fine, &cascade, attained);
        Ok(Design {
            attained,
            binding: tightest(&slacks, &fine, BINDING),
            figures,
            cascade,
        })
    }

    /// The two requirements that exclude each other at the best candidate.
    fn conflict(&self, problem: &Problem, candidate: &Candidate) -> TuneError {
        let easiest = self.requirements.easiest_target();
        let cascade = &candidate.cascade;
        let slacks = self.requirements.slacks(&problem.plants, cascade, easiest);
        let mut tight = tightest(&slacks, &problem.plants, f64::INFINITY).into_iter();
        let first = tight.next();
        let differs = |other: &Binding| first.as_ref().is_some_and(|first| first.differs(other));
        let second = tight.find(differs);
        let sampled = self.sampled_operating_points();
        let pairs: Vec<_> = sampled.iter().map(|(plant, at)| (*plant, at)).collect();
        TuneError::Conflict(Box::new(Conflict {
            order: self.order,
            first,
            second,
            excluded_plant: excluded_plant(&pairs, &self.bends_rad_s(), &self.requirements),
        }))
    }
}

/// Centre in rad/s and relative width of the poles outside the unit circle.
fn unstable_pairs(plant: &DesignPlant, cascade: &Cascade) -> Vec<(f64, f64)> {
    let poles = closed_poles(plant, cascade).unwrap_or_default().into_iter();
    let outside = poles.filter(|z| z.norm() >= 1.0);
    let pairs = outside.filter_map(|z| features::of_root(z, plant.plant.period_s()));
    pairs.collect()
}

/// Frequencies in rad/s around a pole, from a hundredth of its width to three times its width beside it.
fn around_pole((w, zeta): (f64, f64)) -> impl Iterator<Item = f64> {
    let width = (zeta * w).max(1e-6 * w);
    (-8..=8).map(move |i| w + width * libm::sinh(f64::from(i) / 4.0))
}

/// A cascade with the same zeros and poles and so small a gain that the loop with every plant is stable.
fn stable(problem: &Problem, mut cascade: Cascade) -> Cascade {
    const HALVINGS: usize = 60;
    for _ in 0..HALVINGS {
        if problem.is_stable(&cascade) {
            break;
        }
        cascade = cascade.scaled(0.5);
    }
    cascade
}

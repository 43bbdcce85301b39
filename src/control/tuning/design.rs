//! A complete design: search, verification on a fine grid, and improvement with the frequencies that the search missed.

use super::binding::{Binding, tightest, valleys};
use super::bound::{ConvexBound, convex_bound};
use super::cascade::{Cascade, ParameterLimits};
use super::descent::{Candidate, Problem};
use super::disturbance::Disturbance;
use super::error::{Conflict, TuneError};
use super::figures::{PlantFigures, figures, fine_samples, with_variances};
use super::plant::DesignPlant;
use super::requirement::{Goal, Kind, Requirements, Slack};
use super::sampled::{SampledPlant, Spacing};
use super::search::{Effort, search};
use super::unmodelled::UnmodelledBound;
use crate::util::progress::Progress;

/// Everything that determines a design.
#[derive(Clone, Debug)]
pub struct DesignTask {
    /// All plants for which the controller must fulfil the requirements.
    pub plants: Vec<DesignPlant>,
    /// Bound of what the plants lack.
    pub bound: UnmodelledBound,
    /// Disturbance and noise.
    pub disturbance: Disturbance,
    /// Goal and limits.
    pub requirements: Requirements,
    /// Limits of zeros and poles.
    pub limits: ParameterLimits,
    /// Number of poles of the controller.
    pub order: usize,
    /// How much is tried.
    pub effort: Effort,
    /// Seed of the search.
    pub seed: u64,
}

/// A controller with its verification.
#[derive(Clone, Debug)]
pub struct Design {
    /// The controller.
    pub cascade: Cascade,
    /// ws or wb in rad/s, or the standard deviation in metres, at all plants.
    pub attained: f64,
    /// The figures of each plant.
    pub figures: Vec<PlantFigures>,
    /// Requirements that allow no improvement, the tightest first.
    pub binding: Vec<Binding>,
}

impl Design {
    /// The plant with the smallest modulus margin, if it is below `least`: the search ended before it fulfilled the limit between the
    /// frequencies of its grid.
    pub fn misses_margin(&self, least: f64) -> Option<&PlantFigures> {
        let margin = |figures: &&PlantFigures| figures.modulus_margin;
        let smallest = self
            .figures
            .iter()
            .min_by(|a, b| margin(a).total_cmp(&margin(b)));
        smallest.filter(|figures| {
            // A margin that is not a number misses the limit.
            let fulfils = figures.modulus_margin >= least;
            !fulfils
        })
    }
}

/// The search designs for a modulus margin that is larger by this ratio, so that rounding and the grid cost nothing.
const RESERVE: f64 = 1e-3;
/// Factor of the reserve from one round of verification to the next: the valleys between the frequencies of the grid become
/// flatter with each round, and the reserve deeper.
const RESERVE_GROWTH: f64 = 1.5;
/// Rounds of verification and improvement in which a missed limit is mended.
const ROUNDS: usize = 10;
/// Of these, rounds in which a missed goal is mended too. Later only the goal that is attained counts.
const GOAL_ROUNDS: usize = 4;
/// Slack up to which a requirement binds.
const BINDING: f64 = 0.01;

/// Designs a controller.
///
/// # Errors
/// No controller of this order that the search found fulfils all limits.
pub fn design(task: &DesignTask, progress: &Progress) -> Result<Design, TuneError> {
    let mut problem = task.problem();
    let (order, effort, seed) = (task.order, &task.effort, task.seed);
    let extremes = task.with_extreme_plants(&problem);
    let mut candidate = search(&extremes, &problem, order, effort, seed, progress);
    progress.begin("verification", 0);
    for round in 0..ROUNDS {
        let target = candidate
            .target
            .ok_or_else(|| task.conflict(&problem, &candidate))?;
        let mends_goal = round < GOAL_ROUNDS;
        let missed = task.missed(&candidate.cascade.clone().rounded(), target, mends_goal);
        if missed.iter().all(Vec::is_empty) {
            break;
        }
        task.add_points(&mut problem, &missed);
        problem.requirements.modulus_margin = task.margin_with_reserve(round + 1);
        candidate = problem.improve(&candidate.cascade, task.effort.final_steps / 2);
    }
    match candidate.target {
        Some(_) => task.verified(candidate.cascade),
        None => Err(task.conflict(&problem, &candidate)),
    }
}

/// The figures of a controller with other plants than those of its design, at the same signal path and with the same disturbances.
pub fn evaluate(task: &DesignTask, cascade: &Cascade, plants: &[DesignPlant]) -> Vec<PlantFigures> {
    let fine = fine_samples(plants, &task.bound, &task.disturbance, cascade);
    figures(plants, &fine, cascade)
}

/// The bound of the goal that no linear controller passes, over the operating points of a task.
pub fn bound_of(task: &DesignTask, attained: f64) -> Option<ConvexBound> {
    let nominal = task.plants.iter().filter(|plant| plant.is_nominal);
    let sampled: Vec<(&DesignPlant, SampledPlant)> = nominal
        .map(|plant| {
            (
                plant,
                SampledPlant::of(plant, &task.bound, Spacing::Search, &[]),
            )
        })
        .collect();
    let pairs: Vec<_> = sampled
        .iter()
        .map(|(plant, sampled)| (*plant, sampled))
        .collect();
    let bends = task.bound.edges().into_iter().map(|(w, _)| w);
    let bends_rad_s: Vec<f64> = bends.collect();
    convex_bound(&pairs, &bends_rad_s, &task.requirements, attained)
}

impl DesignTask {
    fn problem(&self) -> Problem {
        let features = self.disturbance_features();
        let plants = self.plants.iter().map(|plant| {
            let sampled = SampledPlant::of(plant, &self.bound, Spacing::Search, &features);
            self.completed(sampled, plant)
        });
        Problem {
            plants: plants.collect(),
            requirements: Requirements {
                modulus_margin: self.margin_with_reserve(0),
                ..self.requirements.clone()
            },
            limits: self.limits,
            modes_rad_s: self.modes_rad_s(),
        }
    }

    /// The modulus margin for which a round of verification designs.
    fn margin_with_reserve(&self, round: usize) -> f64 {
        let reserve = RESERVE * libm::pow(RESERVE_GROWTH, round as f64);
        self.requirements.modulus_margin * (1.0 + reserve)
    }

    /// The problem with the variations of the first and of the last operating point only, and all operating points themselves.
    fn with_extreme_plants(&self, whole: &Problem) -> Problem {
        let is_nominal = self.plants.iter().map(|plant| plant.is_nominal);
        let last = is_nominal.filter(|nominal| *nominal).count();
        let mut point = 0;
        let plants = whole.plants.iter().filter(|plant| {
            point += usize::from(plant.is_nominal);
            plant.is_nominal || point == 1 || point == last
        });
        Problem {
            plants: plants.cloned().collect(),
            ..whole.clone()
        }
    }

    /// Frequencies in rad/s of the modes of the operating points, and of those that the model lacks.
    fn modes_rad_s(&self) -> Vec<f64> {
        let last = self.plants.iter().rfind(|plant| plant.is_nominal);
        let modelled = last.map(DesignPlant::features);
        let features = modelled.unwrap_or_default().into_iter();
        features.chain(self.bound.edges()).map(|(w, _)| w).collect()
    }

    fn disturbance_features(&self) -> Vec<(f64, f64)> {
        match self.requirements.goal {
            Goal::Rms => self.disturbance.features(),
            Goal::Disturbance | Goal::Bandwidth => Vec::new(),
        }
    }

    /// The sampled plant with what the goal needs.
    fn completed(&self, sampled: SampledPlant, plant: &DesignPlant) -> SampledPlant {
        match self.requirements.goal {
            Goal::Rms => with_variances(sampled, plant, &self.disturbance),
            Goal::Disturbance | Goal::Bandwidth => sampled,
        }
    }

    /// For each plant the frequencies in rad/s of the fine grid where a limit is missed, or also the goal.
    fn missed(&self, cascade: &Cascade, target: f64, with_goal: bool) -> Vec<Vec<f64>> {
        let fine = fine_samples(&self.plants, &self.bound, &self.disturbance, cascade);
        let slacks = self.requirements.slacks(&fine, cascade, target);
        let counts = |slack: &&Slack| with_goal || slack.kind != Kind::Goal;
        let mut missed = vec![Vec::new(); fine.len()];
        for slack in valleys(&slacks)
            .filter(|slack| slack.value < 0.0)
            .filter(counts)
        {
            missed[slack.plant].push(fine[slack.plant].omega_rad_s[slack.point]);
        }
        missed
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
            return Err(TuneError::Unstable {
                plant: unstable.plant.clone(),
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
        TuneError::Conflict(Box::new(Conflict {
            order: self.order,
            first,
            second,
        }))
    }
}

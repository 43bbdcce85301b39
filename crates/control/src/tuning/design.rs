//! A complete design: the search, and the verification of its best results.

use super::binding::Binding;
use super::bound::{ConvexBound, convex_bound};
use super::cascade::{Cascade, ParameterLimits};
use super::descent::Problem;
use super::disturbance::Disturbance;
use super::error::TuneError;
use super::figures::{PlantFigures, figures, fine_samples, with_variances};
use super::plant::DesignPlant;
use super::requirement::Requirements;
use super::sampled::{SampledPlant, Spacing};
use super::search::{Effort, search};
use super::unmodelled::UnmodelledBound;
use bench_base::progress::Progress;

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
pub(super) const RESERVE: f64 = 1e-3;
/// Candidates of the search that are verified.
const VERIFIED: usize = 2;

/// Designs a controller.
///
/// # Errors
/// No controller of this order that the search found fulfils all limits.
pub fn design(task: &DesignTask, progress: &Progress) -> Result<Design, TuneError> {
    task.check_start()?;
    let problem = task.problem();
    let (order, effort, seed) = (task.order, &task.effort, task.seed);
    let extremes = task.with_extreme_plants(&problem);
    let mut candidates = search(&extremes, &problem, order, effort, seed, progress);
    let further = candidates.split_off(VERIFIED.min(candidates.len()));
    progress.begin("verification", candidates.len() as u64);
    let designs = candidates.into_iter().map(|candidate| {
        let design = task.mended(problem.clone(), candidate);
        progress.advance(1);
        design
    });
    let best = designs.reduce(|best, other| task.better(best, other));
    let mut best = best.unwrap_or(Err(TuneError::NoPlant));
    // The others are tried if those are unstable between the frequencies of the search.
    for candidate in further {
        if !matches!(best, Err(TuneError::Unstable { .. })) {
            break;
        }
        best = task.mended(problem.clone(), candidate);
    }
    best
}

/// The figures of a controller with other plants than those of its design, at the same signal path and with the same disturbances.
pub fn evaluate(task: &DesignTask, cascade: &Cascade, plants: &[DesignPlant]) -> Vec<PlantFigures> {
    let fine = fine_samples(plants, &task.bound, &task.disturbance, cascade);
    figures(plants, &fine, cascade)
}

/// The bound of the goal that no linear controller passes, over the operating points of a task.
pub fn bound_of(task: &DesignTask, attained: f64) -> Option<ConvexBound> {
    let sampled = task.sampled_operating_points();
    let pairs: Vec<_> = sampled.iter().map(|(plant, at)| (*plant, at)).collect();
    convex_bound(&pairs, &task.bends_rad_s(), &task.requirements, attained)
}

impl DesignTask {
    /// Whether a weak integrator stabilises every plant, as the first controller of the search does.
    fn check_start(&self) -> Result<(), TuneError> {
        for plant in &self.plants {
            let name = || plant.name.clone();
            if plant.modes.iter().any(|mode| mode.omega_rad_s <= 0.0) {
                return Err(TuneError::NoSpring { plant: name() });
            }
            let compliance_m_per_a = plant.plant.response(0.0).re;
            // A compliance that is not a number is not positive.
            let is_positive = compliance_m_per_a > 0.0;
            if !is_positive {
                return Err(TuneError::NegativeCompliance {
                    plant: name(),
                    compliance_m_per_a,
                });
            }
        }
        Ok(())
    }

    fn problem(&self) -> Problem {
        let features = self.disturbance_features();
        let plants = self.plants.iter().map(|plant| {
            let sampled = SampledPlant::of(plant, &self.bound, Spacing::Search, &features);
            self.completed(sampled, plant)
        });
        Problem {
            plants: plants.collect(),
            requirements: Requirements {
                modulus_margin: self.margin_with_reserve(RESERVE),
                ..self.requirements.clone()
            },
            limits: self.limits,
            modes_rad_s: self.modes_rad_s(),
        }
    }

    /// The modulus margin for which the search designs, larger by a reserve.
    pub(super) fn margin_with_reserve(&self, reserve_ratio: f64) -> f64 {
        self.requirements.modulus_margin * (1.0 + reserve_ratio)
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
        let modelled = last.map(DesignPlant::sampled_features);
        let features = modelled.unwrap_or_default().into_iter();
        features.chain(self.bound.edges()).map(|(w, _)| w).collect()
    }

    fn disturbance_features(&self) -> Vec<(f64, f64)> {
        if self.requirements.needs_variances() {
            self.disturbance.features()
        } else {
            Vec::new()
        }
    }

    /// The sampled plant with what the requirements need.
    pub(super) fn completed(&self, sampled: SampledPlant, plant: &DesignPlant) -> SampledPlant {
        if self.requirements.needs_variances() {
            with_variances(sampled, plant, &self.disturbance)
        } else {
            sampled
        }
    }

    /// The operating points on the grid of the search.
    pub(super) fn sampled_operating_points(&self) -> Vec<(&DesignPlant, SampledPlant)> {
        let nominal = self.plants.iter().filter(|plant| plant.is_nominal);
        let sampled = nominal.map(|plant| {
            let at = SampledPlant::of(plant, &self.bound, Spacing::Search, &[]);
            (plant, at)
        });
        sampled.collect()
    }

    /// Frequencies in rad/s where the bound of the unmodelled modes bends.
    pub(super) fn bends_rad_s(&self) -> Vec<f64> {
        self.bound.edges().into_iter().map(|(w, _)| w).collect()
    }
}

//! Local improvement of a cascade by sequential linear programming with a trust region.
//!
//! ```text
//!  improve: raise the target of the goal by a stride while `ascend` finds a cascade that fulfils all requirements
//!     ascend: linearise all slacks -> linear programme in a box (subproblem) -> accept if the smallest slack rises and every
//!             plant remains stable; widen or narrow the box by the ratio of the actual to the predicted rise
//! ```

use super::cascade::{Cascade, ParameterLimits};
use super::nyquist::is_stable;
use super::requirement::{Goal, Requirements, Slack};
use super::sampled::SampledPlant;
use super::subproblem::{Row, best_step};

/// The plants, the requirements and the limits of the parameters.
#[derive(Clone, Debug)]
pub struct Problem {
    /// Plants on the grid of the search.
    pub plants: Vec<SampledPlant>,
    /// Goal and limits.
    pub requirements: Requirements,
    /// Limits of the parameters.
    pub limits: ParameterLimits,
    /// Frequencies in rad/s of modes, modelled or not, near which a controller is likely to need zeros and poles.
    pub modes_rad_s: Vec<f64>,
}

/// A cascade and the target of the goal for which it fulfils all requirements.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The controller.
    pub cascade: Cascade,
    /// ws or wb in rad/s, or the standard deviation in metres; `None` if a limit is missed.
    pub target: Option<f64>,
    /// The smallest slack of the limits, without the goal.
    pub slack: f64,
}

/// Widest and narrowest half-width of the trust region, in logarithms of the parameters.
const WIDEST: f64 = 0.6;
const NARROWEST: f64 = 1e-5;
/// First, largest and smallest relative change of the target.
const STRIDES: (f64, f64, f64) = (0.2, 0.5, 5e-4);
/// Relative concessions of the target while a missed limit is regained.
const CONCESSIONS: [f64; 3] = [0.003, 0.01, 0.04];
/// A rise of the slack that is too small to continue.
const LEAST_RISE: f64 = 1e-6;
/// Slacks that are larger than the smallest one by this are not linearised; the trust region takes account of them.
const REACH: f64 = 1.0;
/// Steps after which the rise is compared with what is missing.
const PATIENCE: usize = 6;

impl Problem {
    /// Improves a stable cascade in at most `steps` linear programmes: first until it fulfils the limits, then towards the goal.
    pub fn improve(&self, start: &Cascade, steps: usize) -> Candidate {
        let start = start.clone().within(&self.limits);
        let (cascade, relaxation, used) = self.fulfil_limits(start, steps);
        if relaxation > 1.0 {
            return Candidate {
                cascade,
                target: None,
                slack: 1.0 / relaxation - 1.0,
            };
        }
        let mut walk = Walk::new(self, steps - used);
        let first = walk.ascend(cascade, self.requirements.easiest_target());
        if first.slack < 0.0 {
            return Candidate {
                cascade: first.cascade,
                target: None,
                slack: first.slack,
            };
        }
        let target = self.requirements.attained(&self.plants, &first.cascade);
        let (cascade, target) = walk.raise(first.cascade, target);
        Candidate {
            cascade,
            target: Some(target),
            slack: 0.0,
        }
    }

    /// Improves a cascade that attains a target, but misses a limit by a little: the target is kept as far as possible while the
    /// limit is regained, since a cascade that gives it up may end at a lower one.
    pub fn mend(&self, start: &Cascade, target: f64, steps: usize) -> Candidate {
        for concession in CONCESSIONS {
            let mut walk = Walk::new(self, steps);
            let eased = self.requirements.harder(target, -concession);
            let ascent = walk.ascend(start.clone(), eased);
            if ascent.slack >= 0.0 {
                let (cascade, target) = walk.raise(ascent.cascade, eased);
                return Candidate {
                    cascade,
                    target: Some(target),
                    slack: 0.0,
                };
            }
        }
        self.improve(start, steps)
    }

    /// Tightens the limits of |S| from those that the cascade fulfils to the required ones. Gives the factor of the limits that remains,
    /// 1 if all are fulfilled, and the linear programmes used.
    fn fulfil_limits(&self, start: Cascade, steps: usize) -> (Cascade, f64, usize) {
        let mut relaxation = self.requirements.relaxation(&self.plants, &start);
        let (mut cascade, mut steps_left, mut stride) = (start, steps, STRIDES.0);
        while relaxation > 1.0 && stride > 1e-2 && steps_left > 0 {
            let next = (relaxation * libm::exp(-stride)).max(1.0);
            let relaxed = Problem {
                requirements: self.requirements.relaxed(next),
                ..self.clone()
            };
            let mut walk = Walk::new(&relaxed, steps_left);
            let ascent = walk.ascend(cascade.clone(), relaxed.requirements.easiest_target());
            steps_left = walk.steps;
            if ascent.slack >= 0.0 {
                (cascade, relaxation) = (ascent.cascade, next);
            } else {
                stride *= 0.4;
            }
        }
        (cascade, relaxation, steps - steps_left)
    }

    fn slacks(&self, cascade: &Cascade, target: f64) -> Vec<Slack> {
        let mut slacks = self.requirements.slacks(&self.plants, cascade, target);
        slacks.sort_by_key(|slack| (slack.kind, slack.plant, slack.point));
        slacks
    }

    /// The same problem with another goal.
    pub fn with_goal(&self, goal: Goal) -> Problem {
        Problem {
            requirements: Requirements {
                goal,
                ..self.requirements.clone()
            },
            ..self.clone()
        }
    }

    /// Whether the loop with every plant is stable.
    pub fn is_stable(&self, cascade: &Cascade) -> bool {
        self.plants.iter().all(|plant| is_stable(plant, cascade))
    }

    /// The slacks that can become the smallest one, linearised.
    fn rows(&self, cascade: &Cascade, slacks: &[Slack]) -> Vec<Row> {
        let limit = least(slacks) + REACH;
        let near = slacks.iter().filter(|slack| slack.value < limit);
        near.map(|slack| Row {
            value: slack.value,
            gradient: self.requirements.gradient(&self.plants, cascade, slack),
        })
        .collect()
    }

    /// The box around a cascade, within the limits of the parameters.
    fn range(&self, cascade: &Cascade, radius: f64) -> Vec<(f64, f64)> {
        let bounds = cascade.bounds(&self.limits);
        let values = cascade.parameters().iter().zip(bounds);
        values
            .map(|(value, (low, high))| {
                let down = (low - value).clamp(-radius, 0.0);
                (down, (high - value).clamp(0.0, radius))
            })
            .collect()
    }
}

fn least(slacks: &[Slack]) -> f64 {
    let values = slacks.iter().map(|slack| slack.value);
    // A slack that is not a number must not be overlooked.
    values.fold(f64::INFINITY, |least, value| {
        if value.is_nan() {
            f64::NEG_INFINITY
        } else {
            least.min(value)
        }
    })
}

/// A cascade with its smallest slack.
struct Ascent {
    cascade: Cascade,
    slack: f64,
}

/// The state of an improvement.
struct Walk<'a> {
    problem: &'a Problem,
    /// Half-width of the trust region.
    radius: f64,
    /// Linear programmes that are left.
    steps: usize,
}

impl Walk<'_> {
    fn new(problem: &Problem, steps: usize) -> Walk<'_> {
        Walk {
            problem,
            radius: 0.3,
            steps,
        }
    }

    /// Raises the target from one that the cascade attains, until no stride succeeds.
    fn raise(&mut self, start: Cascade, target: f64) -> (Cascade, f64) {
        let (mut best, mut attained) = (start.clone(), target);
        let (mut stride, longest, shortest) = STRIDES;
        let mut from = start;
        while stride > shortest && self.steps > 0 {
            self.radius = self.radius.clamp(0.02, WIDEST);
            let next = self.problem.requirements.harder(attained, stride);
            // Zero and infinity do not become harder.
            if next == attained || !next.is_finite() {
                break;
            }
            let ascent = self.ascend(from, next);
            from = ascent.cascade;
            if ascent.slack >= 0.0 {
                best = from.clone();
                attained = next;
                stride = (1.6 * stride).min(longest);
            } else {
                stride *= 0.4;
            }
        }
        (best, attained)
    }

    /// Raises the smallest slack until it is positive, or rises too slowly.
    fn ascend(&mut self, start: Cascade, target: f64) -> Ascent {
        let mut slacks = self.problem.slacks(&start, target);
        let mut at = Ascent {
            slack: least(&slacks),
            cascade: start,
        };
        let mut history = vec![at.slack];
        while at.slack < 0.0 && self.steps > 0 && self.radius > NARROWEST {
            self.steps -= 1;
            let rows = self.problem.rows(&at.cascade, &slacks);
            let range = self.problem.range(&at.cascade, self.radius);
            let Some(step) = best_step(&rows, &range) else {
                self.radius *= 0.3;
                continue;
            };
            let expected = step.predicted - at.slack;
            if expected < LEAST_RISE {
                break;
            }
            let parameters = at.cascade.parameters().iter().zip(&step.change);
            let cascade = at
                .cascade
                .with_parameters(parameters.map(|(p, d)| p + d).collect());
            let tried = self.problem.slacks(&cascade, target);
            let slack = least(&tried);
            let ratio = (slack - at.slack) / expected;
            let accepted = ratio > 0.05 && self.problem.is_stable(&cascade);
            self.adapt(ratio, accepted);
            if accepted {
                slacks = tried;
                at = Ascent { cascade, slack };
                history.push(slack);
                if is_too_slow(&history) {
                    break;
                }
            }
        }
        at
    }

    /// Widens or narrows the trust region.
    fn adapt(&mut self, ratio: f64, accepted: bool) {
        let factor = match accepted {
            true if ratio > 0.75 => 1.8,
            true if ratio > 0.3 => 1.0,
            true => 0.6,
            false => 0.35,
        };
        self.radius = (self.radius * factor).min(WIDEST);
    }
}

/// Whether the last steps have closed less than a twentieth of the gap.
fn is_too_slow(history: &[f64]) -> bool {
    let last = history.len() - 1;
    let Some(before) = last.checked_sub(PATIENCE) else {
        return false;
    };
    history[last] - history[before] < -0.05 * history[last]
}

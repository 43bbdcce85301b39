//! The initial asymmetry of the stage, in addition to the intended one (section 5.2.2 found -2 %).
//!
//! The offset d shifts the asymmetry: a point with the intended asymmetry D has the actual asymmetry D + d. Of n
//! verdicts, k disagree with the model at D + d. Each verdict is wrong with the same unknown probability p:
//!
//! ```text
//!  log L(d) = max over p of k ln p + (n - k) ln(1 - p),   1/(2n) <= p <= 1/2
//! ```
//!
//! k changes only where a border crosses a point: L is constant between these offsets, and each interval between them is
//! evaluated. The best offset is the middle of the widest interval with the highest L. The confidence interval contains all
//! offsets with 2 (log L max - log L) up to 3.84, the 95 % quantile of chi-squared with one degree of freedom.

use super::region::Region;

/// 95 % quantile of chi-squared with one degree of freedom.
pub const CHI2_95: f64 = 3.841_458_820_694_124;

/// A decided verdict at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judgement {
    /// Index of the operating point in the region.
    pub row: usize,
    /// The intended asymmetry.
    pub asymmetry: f64,
    /// Whether CNMP zeros were detected; otherwise they were excluded.
    pub detected: bool,
}

/// An interval of offsets with constant likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LikelihoodStep {
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
    /// Number of verdicts that disagree with the model there.
    pub contradicted: usize,
    /// log L, natural.
    pub log_likelihood: f64,
}

/// The estimated offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Offset {
    /// The middle of the interval with the highest likelihood.
    pub best: f64,
    /// The 95 % confidence interval.
    pub interval: [f64; 2],
    /// The range that was searched; a confidence interval that ends there is not bounded there.
    pub searched: [f64; 2],
    /// Number of verdicts.
    pub decided: usize,
    /// Number of verdicts that disagree with the model at the best offset.
    pub contradicted: usize,
    /// The likelihood, by rising offset.
    pub steps: Vec<LikelihoodStep>,
}

/// The number of verdicts that disagree with the model at an offset.
pub fn disagreeing(region: &Region, judgements: &[Judgement], offset: f64) -> usize {
    let wrong = judgements
        .iter()
        .filter(|one| disagrees(region, one, offset));
    wrong.count()
}

fn disagrees(region: &Region, judgement: &Judgement, offset: f64) -> bool {
    region.contains(judgement.row, judgement.asymmetry + offset) != judgement.detected
}

/// The offset that agrees best with the verdicts. `None` if there is no verdict, or if the region was not searched beyond all
/// of them.
pub fn estimate_offset(region: &Region, judgements: &[Judgement]) -> Option<Offset> {
    let searched = searched(region, judgements);
    if judgements.is_empty() || searched[0] >= searched[1] {
        return None;
    }
    let steps = steps(region, judgements, searched);
    let likelihoods = steps.iter().map(|step| step.log_likelihood);
    let highest = likelihoods.fold(f64::NEG_INFINITY, f64::max);
    let best = widest(steps.iter().filter(|step| step.log_likelihood == highest))?;
    Some(Offset {
        best: 0.5 * (best.from + best.to),
        interval: confidence_interval(&steps, highest)?,
        searched,
        decided: judgements.len(),
        contradicted: best.contradicted,
        steps: steps.clone(),
    })
}

/// From the first to the last step within the 95 % quantile of the `highest` likelihood.
fn confidence_interval(steps: &[LikelihoodStep], highest: f64) -> Option<[f64; 2]> {
    let is_within = |step: &&LikelihoodStep| 2.0 * (highest - step.log_likelihood) <= CHI2_95;
    let first = steps.iter().find(is_within)?;
    let last = steps.iter().rfind(is_within)?;
    Some([first.from, last.to])
}

/// The offsets at which all verdicts are within the region that was searched.
fn searched(region: &Region, judgements: &[Judgement]) -> [f64; 2] {
    let asymmetries = || judgements.iter().map(|one| one.asymmetry);
    let low = asymmetries().fold(f64::INFINITY, f64::min);
    let high = asymmetries().fold(f64::NEG_INFINITY, f64::max);
    [region.searched[0] - low, region.searched[1] - high]
}

fn widest<'a>(steps: impl Iterator<Item = &'a LikelihoodStep>) -> Option<&'a LikelihoodStep> {
    steps.max_by(|a, b| (a.to - a.from).total_cmp(&(b.to - b.from)))
}

/// The likelihood between any two offsets at which a verdict begins or ceases to disagree.
fn steps(region: &Region, judgements: &[Judgement], [low, high]: [f64; 2]) -> Vec<LikelihoodStep> {
    let crossings = crossings(region, judgements, [low, high]);
    let wrong = judgements.iter().map(|one| disagrees(region, one, low));
    let mut wrong: Vec<bool> = wrong.collect();
    let (mut from, mut steps) = (low, Vec::new());
    let ends = crossings.iter().map(|(at, index)| (*at, Some(*index)));
    for (to, index) in ends.chain([(high, None)]) {
        if to > from {
            steps.push(step(from, to, &wrong));
            from = to;
        }
        if let Some(index) = index {
            wrong[index] = !wrong[index];
        }
    }
    steps
}

/// The offsets at which a border crosses a point, rising, with the index of the point.
fn crossings(
    region: &Region,
    judgements: &[Judgement],
    [low, high]: [f64; 2],
) -> Vec<(f64, usize)> {
    let mut crossings = Vec::new();
    for (index, one) in judgements.iter().enumerate() {
        let offsets = region.borders(one.row).map(|border| border - one.asymmetry);
        let within = offsets.filter(|at| *at > low && *at < high);
        crossings.extend(within.map(|at| (at, index)));
    }
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    crossings
}

fn step(from: f64, to: f64, wrong: &[bool]) -> LikelihoodStep {
    let contradicted = wrong.iter().filter(|wrong| **wrong).count();
    LikelihoodStep {
        from,
        to,
        contradicted,
        log_likelihood: log_likelihood(contradicted, wrong.len()),
    }
}

fn log_likelihood(contradicted: usize, decided: usize) -> f64 {
    let (k, n) = (contradicted as f64, decided as f64);
    let p = (k / n).clamp(0.5 / n, 0.5);
    k * libm::log(p) + (n - k) * libm::log(1.0 - p)
}

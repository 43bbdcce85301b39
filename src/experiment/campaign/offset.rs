//! The asymmetry that the stage has beside what was put on: by manufacture (section 5.2.2 found -2 %).
//!
//! With an offset d the model says at a point of intended asymmetry D what it says at D + d. Of n verdicts, k contradict it.
//! Each is wrong with the same unknown probability p:
//!
//! ```text
//!  log L(d) = max over p of k ln p + (n - k) ln(1 - p),   1/(2n) <= p <= 1/2
//! ```
//!
//! k changes only where a border crosses a point, so L is constant between these offsets, all of which are looked at. The best
//! is the middle of the widest stretch with the highest L; the interval takes in all offsets with 2 (log L max - log L) up to
//! 3.84, the 95 % quantile of chi-squared with one degree of freedom.

use super::Region;

/// 95 % quantile of chi-squared with one degree of freedom.
pub(super) const CHI2_95: f64 = 3.841_458_820_694_124;

/// What was said at a point: yes or no.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// Index of the operating point in the region.
    pub row: usize,
    /// The intended asymmetry.
    pub asymmetry: f64,
    /// Whether CNMP zeros were detected, not excluded.
    pub detected: bool,
}

/// Offsets between which the likelihood is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// From this offset.
    pub from: f64,
    /// To this one.
    pub to: f64,
    /// Verdicts that the model contradicts there.
    pub contradicted: usize,
    /// log L, natural.
    pub log_likelihood: f64,
}

/// The offset that fits best.
#[derive(Clone, Debug, PartialEq)]
pub struct Offset {
    /// The middle of the likeliest stretch.
    pub best: f64,
    /// The interval of 95 %.
    pub interval: [f64; 2],
    /// Between which offsets it was looked for; an interval that ends there is not bounded there.
    pub searched: [f64; 2],
    /// Verdicts.
    pub decided: usize,
    /// Those that the model contradicts at the best offset.
    pub contradicted: usize,
    /// The whole likelihood, by rising offset.
    pub steps: Vec<Step>,
}

/// How many verdicts the model contradicts with an offset.
pub fn contradicted(region: &Region, said: &[Said], offset: f64) -> usize {
    said.iter()
        .filter(|one| is_contradicted(region, one, offset))
        .count()
}

fn is_contradicted(region: &Region, one: &Said, offset: f64) -> bool {
    region.contains(one.row, one.asymmetry + offset) != one.detected
}

/// The offset that fits verdicts best; none without a verdict, or where the region was not looked at beyond all of them.
pub fn offset(region: &Region, said: &[Said]) -> Option<Offset> {
    let asymmetries = || said.iter().map(|one| one.asymmetry);
    let least = region.searched[0] - asymmetries().fold(f64::INFINITY, f64::min);
    let most = region.searched[1] - asymmetries().fold(f64::NEG_INFINITY, f64::max);
    if said.is_empty() || least >= most {
        return None;
    }
    let steps = steps(region, said, [least, most]);
    let highest = steps
        .iter()
        .map(|step| step.log_likelihood)
        .fold(f64::NEG_INFINITY, f64::max);
    let width = |step: &Step| step.to - step.from;
    let widest = steps
        .iter()
        .filter(|step| step.log_likelihood == highest)
        .max_by(|a, b| width(a).total_cmp(&width(b)))?;
    let likely = || {
        steps
            .iter()
            .filter(|step| 2.0 * (highest - step.log_likelihood) <= CHI2_95)
    };
    Some(Offset {
        best: 0.5 * (widest.from + widest.to),
        interval: [likely().next()?.from, likely().next_back()?.to],
        searched: [least, most],
        decided: said.len(),
        contradicted: widest.contradicted,
        steps: steps.clone(),
    })
}

/// The likelihood between any two offsets at which a verdict's contradiction comes or goes.
fn steps(region: &Region, said: &[Said], [least, most]: [f64; 2]) -> Vec<Step> {
    let crossing = |(index, one): (usize, &Said)| {
        let at = one.asymmetry;
        region
            .borders(one.row)
            .map(move |border| (border - at, index))
            .collect::<Vec<_>>()
    };
    let mut crossings: Vec<(f64, usize)> = said.iter().enumerate().flat_map(crossing).collect();
    crossings.retain(|(at, _)| *at > least && *at < most);
    crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut wrong: Vec<bool> = said
        .iter()
        .map(|one| is_contradicted(region, one, least))
        .collect();
    let (mut from, mut steps) = (least, Vec::new());
    for (to, index) in crossings
        .into_iter()
        .map(|(at, index)| (at, Some(index)))
        .chain([(most, None)])
    {
        if to > from {
            let contradicted = wrong.iter().filter(|wrong| **wrong).count();
            steps.push(Step {
                from,
                to,
                contradicted,
                log_likelihood: log_likelihood(contradicted, said.len()),
            });
            from = to;
        }
        if let Some(index) = index {
            wrong[index] = !wrong[index];
        }
    }
    steps
}

fn log_likelihood(contradicted: usize, decided: usize) -> f64 {
    let (k, n) = (contradicted as f64, decided as f64);
    let p = (k / n).clamp(0.5 / n, 0.5);
    k * libm::log(p) + (n - k) * libm::log(1.0 - p)
}

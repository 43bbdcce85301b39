//! The answer of a study.

use serde::Serialize;

use super::effects::{Cell, Effects, Share};
use super::{Block, Failure, Results, Shard, Varied};
use bench_base::numeric::wilson_interval;

/// Failures that are reported one by one; the others are counted.
const EXAMPLES: usize = 5;
/// Interactions that are reported, the strongest first.
const INTERACTIONS: usize = 10;
/// A difference is significant above this multiple of its standard deviation, an interaction above this multiple of
/// its noise.
const SIGNIFICANT_SIGMAS: f64 = 4.0;

/// The answer of a study, or of one shard of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// `plant.model`.
    pub model: &'static str,
    /// The nominal operating point, of a model that has one.
    pub operating_point_m: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of completed draws.
    pub draws: u64,
    /// `I/N` of a shard, `null` of the whole study.
    pub shard: Option<String>,
    /// The varied settings.
    pub varied: Vec<Varied>,
    /// The draws that the probabilities exclude.
    pub not_analysed: NotAnalysed,
    /// CNMP pairs without damping.
    pub cnmp_pairs: Counted,
    /// The same with damping, if they were counted.
    pub damped_cnmp_pairs: Option<Counted>,
}

/// Draws that could not be analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotAnalysed {
    /// Their number.
    pub draws: u64,
    /// The first few.
    pub examples: Vec<Failure>,
}

/// The probability of each number of pairs, and the settings that decide whether there are any.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counted {
    /// From no pair to the largest number found, at least three.
    pub probabilities: Vec<Probability>,
    /// Probability of one pair or more.
    pub any: Probability,
    /// Sum of the shares that the settings explain alone; `null` with too few draws.
    pub share_alone: Option<f64>,
    /// Sum of the shares of interactions of two settings. The remainder belongs to three or more settings together.
    pub share_of_interactions: Option<f64>,
    /// Each setting, the strongest first.
    pub settings: Vec<Effect>,
    /// The strongest significant interactions.
    pub interactions: Vec<Interaction>,
}

/// The probability of a number of pairs among the draws that were analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probability {
    /// Number of pairs; absent for one or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<u32>,
    /// Number of draws with so many pairs.
    pub draws: u64,
    /// Its ratio to all analysed draws.
    pub probability: f64,
    /// Lower end of the 95 % confidence interval (Wilson).
    pub low: f64,
    /// Upper end of it.
    pub high: f64,
}

/// The effect of a setting on whether there are pairs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The setting.
    pub key: String,
    /// The share of the variance of "has pairs" that it explains alone; `null` with too few draws.
    pub share: Option<f64>,
    /// Standard deviation of the share if there were no effect.
    pub share_noise: Option<f64>,
    /// `+` if pairs are significantly more likely in the upper third of the setting than in the lower third, `-` if
    /// significantly less likely, `0` otherwise.
    pub direction: char,
    /// The probability of pairs in the lower, the middle and the upper third.
    pub probability_by_third: [Option<f64>; 3],
}

/// The share that two settings explain beyond their own: second-order Sobol index.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Interaction {
    /// The two settings.
    pub keys: [String; 2],
    /// The share of the variance of "has pairs".
    pub share: f64,
    /// Its standard deviation if there were no effect.
    pub share_noise: f64,
    /// The probability of pairs where both settings lie on the same side of their medians.
    pub probability_same_side: Option<f64>,
    /// The probability of pairs where they lie on opposite sides.
    pub probability_opposite_sides: Option<f64>,
}

impl Answer {
    /// The answer of the draws that are done.
    pub fn of(results: &Results) -> Answer {
        let plan = &results.plan;
        let failures: Vec<&Failure> = results.blocks().flat_map(|block| &block.failures).collect();
        Answer {
            model: plan.plant.model(),
            operating_point_m: plan.plant.operating_point_m(),
            seed: plan.seed,
            draws: results.done(),
            shard: (results.shard != Shard::WHOLE).then(|| results.shard.to_string()),
            varied: plan.varied.clone(),
            not_analysed: NotAnalysed {
                draws: failures.len() as u64,
                examples: failures.into_iter().take(EXAMPLES).cloned().collect(),
            },
            cnmp_pairs: Counted::of(results, |block| &block.cnmp_pairs),
            damped_cnmp_pairs: plan
                .damped
                .then(|| Counted::of(results, |block| &block.damped_cnmp_pairs)),
        }
    }
}

/// The analysed draws by their number of pairs, and by the ranks of their settings.
struct Tally {
    counts: Vec<u64>,
    effects: Effects,
}

impl Tally {
    fn of(results: &Results, pairs_of: fn(&Block) -> &Vec<Option<u32>>) -> Tally {
        let mut tally = Tally {
            // 0, 1, 2 and 3 pairs are always reported.
            counts: vec![0; 4],
            effects: Effects::new(results.plan.varied.len(), results.done()),
        };
        for block in results.blocks() {
            let drawn = results.plan.from_draw(block.first);
            for (pairs, drawn) in pairs_of(block).iter().zip(drawn) {
                if let Some(pairs) = *pairs {
                    tally.add(pairs as usize, &drawn.ranks);
                }
            }
        }
        tally
    }

    fn add(&mut self, pairs: usize, ranks: &[f64]) {
        let length = self.counts.len().max(pairs + 1);
        self.counts.resize(length, 0);
        self.counts[pairs] += 1;
        self.effects.add(ranks, pairs > 0);
    }
}

impl Counted {
    fn of(results: &Results, pairs_of: fn(&Block) -> &Vec<Option<u32>>) -> Counted {
        let Tally { counts, effects } = Tally::of(results, pairs_of);
        let (all, varied): (u64, _) = (counts.iter().sum(), &results.plan.varied);
        let probabilities = (0..).zip(&counts);
        let alone = (0..varied.len()).map(|index| Some(effects.single(index)?.value));
        let together = effects.interactions().map(|(_, share)| Some(share?.value));
        Counted {
            probabilities: probabilities
                .map(|(pairs, &draws)| Probability::new(Some(pairs), draws, all))
                .collect(),
            any: Probability::new(None, all - counts[0], all),
            share_alone: alone.sum(),
            share_of_interactions: together.sum(),
            settings: settings(varied, &effects),
            interactions: interactions(varied, &effects),
        }
    }
}

impl Probability {
    fn new(pairs: Option<u32>, draws: u64, all: u64) -> Probability {
        let [low, high] = wilson_interval(draws, all);
        Probability {
            pairs,
            draws,
            probability: match all {
                0 => 0.0,
                _ => draws as f64 / all as f64,
            },
            low,
            high,
        }
    }
}

/// The effect of each setting, the strongest first.
fn settings(varied: &[Varied], effects: &Effects) -> Vec<Effect> {
    let mut settings: Vec<Effect> = varied
        .iter()
        .enumerate()
        .map(|(index, one)| effect(&one.key, index, effects))
        .collect();
    let share = |effect: &Effect| effect.share.unwrap_or(0.0);
    settings.sort_by(|a, b| share(b).total_cmp(&share(a)));
    settings
}

fn effect(key: &str, index: usize, effects: &Effects) -> Effect {
    let (share, thirds) = (effects.single(index), effects.thirds(index));
    Effect {
        key: key.into(),
        share: share.map(|share| share.value),
        share_noise: share.map(|share| share.noise),
        direction: share.map_or('0', |_| direction(&thirds)),
        probability_by_third: thirds.map(finite),
    }
}

fn direction([low, _, high]: &[Cell; 3]) -> char {
    let difference = high.probability() - low.probability();
    let sigma = high.sigma().hypot(low.sigma());
    let is_significant = difference.abs() > SIGNIFICANT_SIGMAS * sigma;
    if !is_significant {
        '0'
    } else if difference > 0.0 {
        '+'
    } else {
        '-'
    }
}

/// The significant interactions, the strongest first.
fn interactions(varied: &[Varied], effects: &Effects) -> Vec<Interaction> {
    let shares = effects.interactions();
    let known = shares.filter_map(|(pair, share)| Some((pair, share?)));
    let mut strongest: Vec<([usize; 2], Share)> = known
        .filter(|(_, share)| share.value > SIGNIFICANT_SIGMAS * share.noise)
        .collect();
    strongest.sort_by(|a, b| b.1.value.total_cmp(&a.1.value));
    strongest.truncate(INTERACTIONS);
    strongest
        .into_iter()
        .map(|(pair, share)| interaction(varied, pair, share, effects))
        .collect()
}

fn interaction(
    varied: &[Varied],
    pair: [usize; 2],
    share: Share,
    effects: &Effects,
) -> Interaction {
    let [same, opposite] = effects.halves(pair).map(finite);
    Interaction {
        keys: pair.map(|index| varied[index].key.clone()),
        share: share.value,
        share_noise: share.noise,
        probability_same_side: same,
        probability_opposite_sides: opposite,
    }
}

fn finite(cell: Cell) -> Option<f64> {
    (cell.all > 0).then(|| cell.probability())
}

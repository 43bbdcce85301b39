//! The answer of a study.

use serde::Serialize;

use super::effects::{Cell, Effects, Share};
use super::{Block, Failure, Results, Shard, Varied};
use crate::util::numeric::wilson_interval;

/// Failures that are reported one by one; the others are counted.
const EXAMPLES: usize = 5;
/// Interactions that are reported, the strongest first.
const INTERACTIONS: usize = 10;
/// A difference counts above so many of its standard deviations, an interaction above so many of its noise.
const SIGNIFICANT: f64 = 4.0;

/// The answer of a study, or of one shard of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Answer {
    /// `plant.model`.
    pub model: &'static str,
    /// The nominal operating point, of a model that has one.
    pub operating_point_m: Option<f64>,
    /// Of the random numbers.
    pub seed: u64,
    /// How many draws were done.
    pub draws: u64,
    /// `I/N` of a part, `null` of the whole.
    pub shard: Option<String>,
    /// The varied settings.
    pub varied: Vec<Varied>,
    /// The draws that are not in the probabilities.
    pub not_analysed: NotAnalysed,
    /// CNMP pairs without damping.
    pub cnmp_pairs: Counted,
    /// The same with damping, if they were counted.
    pub damped_cnmp_pairs: Option<Counted>,
}

/// Draws that could not be analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NotAnalysed {
    /// How many.
    pub draws: u64,
    /// The first of them.
    pub examples: Vec<Failure>,
}

/// How likely each number of pairs is, and what decides whether there are any.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Counted {
    /// From no pair to the most that were found, three at least.
    pub probabilities: Vec<Probability>,
    /// One pair or more.
    pub any: Probability,
    /// The sum of what the settings explain alone; `null` of too few draws.
    pub share_alone: Option<f64>,
    /// The sum of what interactions explain beyond that. The rest takes three settings or more together.
    pub share_of_interactions: Option<f64>,
    /// Each setting, the strongest first.
    pub settings: Vec<Effect>,
    /// The strongest significant interactions.
    pub interactions: Vec<Interaction>,
}

/// The probability of a number of pairs among the draws that were analysed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Probability {
    /// How many pairs; nothing for one or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pairs: Option<u32>,
    /// How many draws had them.
    pub draws: u64,
    /// Their ratio.
    pub probability: f64,
    /// Its 95 % interval by Wilson, from here
    pub low: f64,
    /// to here.
    pub high: f64,
}

/// The effect of a setting on whether there are pairs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Effect {
    /// The setting.
    pub key: String,
    /// The share of the variance of "has pairs" that it explains alone; `null` of too few draws.
    pub share: Option<f64>,
    /// The share's standard deviation if there were no effect.
    pub share_noise: Option<f64>,
    /// `+` if pairs are more likely in the upper third of the setting than in the lower one by more than chance, `-` if less,
    /// `0` if neither.
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
    /// The probability of pairs where both lie on the same side of their medians,
    pub probability_same_side: Option<f64>,
    /// and where they lie on opposite sides.
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
            cnmp_pairs: counted(results, |block| &block.cnmp_pairs),
            damped_cnmp_pairs: plan
                .damped
                .then(|| counted(results, |block| &block.damped_cnmp_pairs)),
        }
    }
}

fn counted(results: &Results, of: fn(&Block) -> &Vec<Option<u32>>) -> Counted {
    let mut effects = Effects::new(results.plan.varied.len(), results.done());
    // 0, 1, 2 and 3 pairs are always reported.
    let mut counts = vec![0; 4];
    for block in results.blocks() {
        for (pairs, drawn) in of(block).iter().zip(results.plan.from_draw(block.first)) {
            let Some(pairs) = *pairs else { continue };
            counts.resize(counts.len().max(pairs as usize + 1), 0);
            counts[pairs as usize] += 1;
            effects.add(&drawn.ranks, pairs > 0);
        }
    }
    let all: u64 = counts.iter().sum();
    let varied = &results.plan.varied;
    let probabilities = (0..).zip(&counts);
    let alone = (0..varied.len()).map(|index| Some(effects.single(index)?.value));
    let together = effects.interactions().map(|(_, share)| Some(share?.value));
    Counted {
        probabilities: probabilities
            .map(|(pairs, &yes)| probability(Some(pairs), yes, all))
            .collect(),
        any: probability(None, all - counts[0], all),
        share_alone: alone.sum(),
        share_of_interactions: together.sum(),
        settings: settings(varied, &effects),
        interactions: interactions(varied, &effects),
    }
}

fn probability(pairs: Option<u32>, yes: u64, all: u64) -> Probability {
    let [low, high] = wilson_interval(yes, all);
    Probability {
        pairs,
        draws: yes,
        probability: match all {
            0 => 0.0,
            _ => yes as f64 / all as f64,
        },
        low,
        high,
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
    match difference.abs() > SIGNIFICANT * sigma {
        true if difference > 0.0 => '+',
        true => '-',
        false => '0',
    }
}

/// The significant interactions, the strongest first.
fn interactions(varied: &[Varied], effects: &Effects) -> Vec<Interaction> {
    let shares = effects.interactions();
    let known = shares.filter_map(|(pair, share)| Some((pair, share?)));
    let mut strongest: Vec<([usize; 2], Share)> = known
        .filter(|(_, share)| share.value > SIGNIFICANT * share.noise)
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

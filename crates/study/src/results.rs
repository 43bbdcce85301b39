//! Counts of the draws.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::counter::Count;
use super::{Plan, Shard};

/// Draws of a block: the unit of work of a thread, and the most that it loses when it is killed.
pub(super) const BLOCK: u64 = 500;

/// A draw that could not be analysed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Its number, from 0.
    pub draw: u64,
    /// The reason.
    pub why: String,
}

/// The counts of consecutive draws; `None` where a draw could not be analysed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Block {
    /// The number of its first draw.
    pub first: u64,
    /// CNMP pairs without damping.
    pub cnmp_pairs: Vec<Option<u32>>,
    /// The same with damping; empty if not counted.
    pub damped_cnmp_pairs: Vec<Option<u32>>,
    /// The reasons for missing counts.
    pub failures: Vec<Failure>,
}

impl Block {
    pub(super) fn new(first: u64) -> Block {
        Block {
            first,
            cnmp_pairs: Vec::new(),
            damped_cnmp_pairs: Vec::new(),
            failures: Vec::new(),
        }
    }

    /// Adds the count of the next draw.
    pub(super) fn push(&mut self, counted: Result<Count, String>, damped: bool) {
        if damped {
            self.damped_cnmp_pairs
                .push(counted.as_ref().ok().and_then(|count| count.damped_pairs));
        }
        let draw = self.first + self.cnmp_pairs.len() as u64;
        self.cnmp_pairs
            .push(counted.as_ref().ok().map(|count| count.pairs));
        self.failures
            .extend(counted.err().map(|why| Failure { draw, why }));
    }

    /// Whether this block has a count for each of the `wanted` draws.
    fn fits(&self, plan: &Plan, wanted: &Range<u64>) -> bool {
        let length = (wanted.end - wanted.start) as usize;
        let damped = if plan.damped { length } else { 0 };
        self.cnmp_pairs.len() == length && self.damped_cnmp_pairs.len() == damped
    }
}

/// The completed blocks of a shard.
#[derive(Clone, Debug, PartialEq)]
pub struct Results {
    /// The study.
    pub plan: Plan,
    /// The part of it.
    pub shard: Shard,
    blocks: BTreeMap<u64, Block>,
}

impl Results {
    /// No block completed.
    pub fn none(plan: Plan, shard: Shard) -> Results {
        Results {
            plan,
            shard,
            blocks: BTreeMap::new(),
        }
    }

    /// The ranges of draws that are the shard's blocks.
    fn ranges(&self) -> impl Iterator<Item = Range<u64>> + use<> {
        let all = self.shard.draws(&self.plan);
        let end = all.end;
        all.step_by(BLOCK as usize)
            .map(move |first| first..end.min(first + BLOCK))
    }

    /// The ranges of draws that are not completed, block by block. Not for results that were joined from shards.
    pub fn missing(&self) -> Vec<Range<u64>> {
        self.ranges()
            .filter(|range| !self.blocks.contains_key(&range.start))
            .collect()
    }

    /// Adds a block; `false` if it is not one of the shard's.
    pub fn add(&mut self, block: Block) -> bool {
        let draws = self.shard.draws(&self.plan);
        let aligned =
            draws.contains(&block.first) && (block.first - draws.start).is_multiple_of(BLOCK);
        let range = block.first..draws.end.min(block.first.saturating_add(BLOCK));
        let is_valid = aligned && block.fits(&self.plan, &range);
        if is_valid {
            self.blocks.insert(block.first, block);
        }
        is_valid
    }

    /// Adds the blocks of another shard of the same study, without a check of their ranges.
    pub(super) fn absorb(&mut self, other: Results) {
        self.blocks.extend(other.blocks);
    }

    /// Number of draws of the shard.
    pub fn total(&self) -> u64 {
        let draws = self.shard.draws(&self.plan);
        draws.end - draws.start
    }

    /// Number of draws that are not completed.
    pub fn left(&self) -> u64 {
        self.total() - self.done()
    }

    /// Whether all draws are done.
    pub fn is_done(&self) -> bool {
        self.left() == 0
    }

    /// Number of completed draws.
    pub fn done(&self) -> u64 {
        self.blocks()
            .map(|block| block.cnmp_pairs.len() as u64)
            .sum()
    }

    /// The completed blocks, in the order of the draws.
    pub fn blocks(&self) -> impl Iterator<Item = &Block> {
        self.blocks.values()
    }
}

//! Samples for clients: minimum and maximum of blocks of ticks, so that a spike of one tick is not lost.

use bench_hal::Validity;
use bench_rt::record::{TickRecord, flag};

/// Signals of a frame: reference, position and error in metres, current in amperes.
pub const SIGNALS: usize = 4;
/// Largest number of blocks in a frame. At 5 kHz and 20 frames a second each block is one tick.
const MAX_BLOCKS: usize = 512;
/// Kind and version of a message with samples.
const KIND: u8 = 1;
const VERSION: u8 = 1;

/// The signals of a tick. What is not known is not a number.
pub type Sample = [f32; SIGNALS];

/// The signals of a tick of a closed loop or of another run. Without a valid reading there is neither position nor error; without
/// a closed loop there is no error.
pub fn sample(tick: &TickRecord, is_closed: bool) -> Sample {
    let is_valid = tick.validity == Validity::Valid;
    let is_active = is_closed && tick.flags & flag::ACTIVE != 0;
    let known = |value: f64, is_known: bool| if is_known { value as f32 } else { f32::NAN };
    [
        tick.reference_m as f32,
        known(tick.position_m, is_valid),
        known(tick.reference_m - tick.position_m, is_valid && is_active),
        tick.command_a as f32,
    ]
}

/// Minimum and maximum of a block; not a number if no tick of the block is known.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Block {
    minimum: Sample,
    maximum: Sample,
}

impl Block {
    fn of(sample: Sample) -> Block {
        Block {
            minimum: sample,
            maximum: sample,
        }
    }

    /// The block of both. `f32::min` and `f32::max` ignore what is not a number.
    fn with(&self, other: &Block) -> Block {
        let mut both = *self;
        for signal in 0..SIGNALS {
            both.minimum[signal] = self.minimum[signal].min(other.minimum[signal]);
            both.maximum[signal] = self.maximum[signal].max(other.maximum[signal]);
        }
        both
    }
}

/// Samples of consecutive ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Time of the first tick in seconds since the daemon started.
    pub start_s: f64,
    /// Sampling period of the loop in seconds.
    tick_s: f64,
    /// Ticks of a block.
    block_ticks: u32,
    /// Number of the run; 0 between two runs.
    pub run: u32,
    /// Ticks in the last block.
    last_block_ticks: u32,
    blocks: Vec<Block>,
}

impl Frame {
    /// An empty frame that begins at a tick.
    pub fn new(start_s: f64, tick_s: f64, run: u32) -> Frame {
        Frame::with_blocks(start_s, tick_s, run, 1)
    }

    /// An empty frame with a number of ticks in each block.
    pub fn with_blocks(start_s: f64, tick_s: f64, run: u32, block_ticks: u32) -> Frame {
        Frame {
            start_s,
            tick_s,
            block_ticks,
            run,
            last_block_ticks: 0,
            blocks: Vec::new(),
        }
    }

    /// Whether it has no ticks.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// Ticks in the frame.
    pub fn ticks(&self) -> u64 {
        let whole = self.blocks.len().saturating_sub(1) as u64;
        whole * u64::from(self.block_ticks) + u64::from(self.last_block_ticks)
    }

    /// End of its last tick in seconds since the daemon started.
    pub fn end_s(&self) -> f64 {
        self.start_s + self.ticks() as f64 * self.tick_s
    }

    /// Whether a tick of a run follows its last one.
    pub fn continues(&self, time_s: f64, run: u32) -> bool {
        self.run == run && (time_s - self.end_s()).abs() < 0.5 * self.tick_s
    }

    /// Adds the next tick. A frame with too many blocks gets blocks of twice the length.
    pub fn push(&mut self, sample: Sample) {
        let block = Block::of(sample);
        match self.blocks.last_mut() {
            Some(last) if self.last_block_ticks < self.block_ticks => {
                *last = last.with(&block);
                self.last_block_ticks += 1;
            }
            _ => {
                self.make_room();
                self.append(block);
            }
        }
    }

    fn append(&mut self, block: Block) {
        match self.blocks.last_mut() {
            Some(last) if self.last_block_ticks < self.block_ticks => {
                *last = last.with(&block);
                self.last_block_ticks += 1;
            }
            _ => {
                self.blocks.push(block);
                self.last_block_ticks = 1;
            }
        }
    }

    fn make_room(&mut self) {
        if self.blocks.len() < MAX_BLOCKS {
            return;
        }
        let pairs = self.blocks.chunks(2).map(|pair| match pair {
            [first, second] => first.with(second),
            [first, ..] => *first,
            [] => Block::of([f32::NAN; SIGNALS]),
        });
        // The number of blocks is even and all are full.
        self.blocks = pairs.collect();
        self.block_ticks *= 2;
        self.last_block_ticks = self.block_ticks;
    }

    /// The message, little endian: kind u8, version u8, signals u16, ticks of a block u32, start f64, period of a block f64, blocks
    /// u32, run u32, then for each signal the minima f32; then, if a block has more than one tick, for each signal the maxima f32.
    pub fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(32 + self.blocks.len() * SIGNALS * 8);
        bytes.extend([KIND, VERSION]);
        bytes.extend((SIGNALS as u16).to_le_bytes());
        bytes.extend(self.block_ticks.to_le_bytes());
        bytes.extend(self.start_s.to_le_bytes());
        bytes.extend((self.tick_s * f64::from(self.block_ticks)).to_le_bytes());
        bytes.extend((self.blocks.len() as u32).to_le_bytes());
        bytes.extend(self.run.to_le_bytes());
        for signal in 0..SIGNALS {
            let minima = self.blocks.iter().map(|block| block.minimum[signal]);
            bytes.extend(minima.flat_map(f32::to_le_bytes));
        }
        if self.block_ticks > 1 {
            for signal in 0..SIGNALS {
                let maxima = self.blocks.iter().map(|block| block.maximum[signal]);
                bytes.extend(maxima.flat_map(f32::to_le_bytes));
            }
        }
        bytes
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn u32_at(bytes: &[u8], at: usize) -> usize {
        u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
    }

    fn f32_at(bytes: &[u8], at: usize) -> f32 {
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    proptest! {
        /// The message is read by its description; minima and maxima are computed from all ticks of each block.
        #[test]
        fn no_minimum_and_no_maximum_of_a_tick_is_lost(values in proptest::collection::vec(-1.0_f32..1.0, 1..6000)) {
            let mut frame = Frame::new(3.0, 2e-4, 7);
            for value in &values {
                frame.push([*value, -*value, 2.0 * *value, 0.5]);
            }
            let bytes = frame.encode();
            let (block, count) = (u32_at(&bytes, 4), u32_at(&bytes, 24));
            prop_assert_eq!(frame.ticks(), values.len() as u64);
            prop_assert!(count <= 512);
            prop_assert_eq!(count, values.len().div_ceil(block));
            prop_assert_eq!(u32_at(&bytes, 28), 7);
            prop_assert_eq!(f64::from_le_bytes(bytes[16..24].try_into().unwrap()), 2e-4 * block as f64);
            let parts = if block > 1 { 2 } else { 1 };
            prop_assert_eq!(bytes.len(), 32 + parts * SIGNALS * count * 4);
            for (number, ticks) in values.chunks(block).enumerate() {
                let lowest = ticks.iter().copied().fold(f32::INFINITY, f32::min);
                let highest = ticks.iter().copied().fold(f32::NEG_INFINITY, f32::max);
                prop_assert_eq!(f32_at(&bytes, 32 + number * 4), lowest);
                // The second signal is the first one with the other sign.
                prop_assert_eq!(f32_at(&bytes, 32 + (count + number) * 4), -highest);
                if block > 1 {
                    prop_assert_eq!(f32_at(&bytes, 32 + (SIGNALS * count + number) * 4), highest);
                }
            }
        }
    }

    #[test]
    fn invalid_reading_is_not_drawn() {
        let tick = TickRecord {
            position_m: 1.0,
            reference_m: 2.0,
            validity: Validity::Missing,
            ..TickRecord::default()
        };
        let [reference, position, error, current] = sample(&tick, true);
        assert_eq!((reference, current), (2.0, 0.0));
        assert!(position.is_nan() && error.is_nan());
    }

    #[test]
    fn unknown_ticks_do_not_hide_known_ones() {
        let mut frame = Frame::new(0.0, 1.0, 0);
        for tick in 0..MAX_BLOCKS * 2 {
            let value = if tick % 2 == 0 { f32::NAN } else { 3.0 };
            frame.push([value; SIGNALS]);
        }
        assert_eq!(frame.block_ticks, 2);
        assert!(frame.blocks.iter().all(|block| block.minimum[0] == 3.0));
    }
}

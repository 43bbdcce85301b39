//! The last ten minutes for a client that connects now: minimum and maximum of blocks of ticks.

use std::collections::VecDeque;

use bytes::Bytes;

use super::frame::{Frame, Sample};

/// Ticks of a block. At 5 kHz a block has 13 ms: less than a column of pixels of ten minutes.
const BLOCK_TICKS: u32 = 64;
/// Blocks of a frame.
const FRAME_BLOCKS: u64 = 512;
/// Kept time in seconds.
const KEPT_S: f64 = 600.0;

/// Frames of blocks, oldest first. Those that are complete are encoded once: all clients share them.
#[derive(Default)]
pub(super) struct History {
    closed: VecDeque<Closed>,
    open: Option<Frame>,
}

/// A complete frame.
struct Closed {
    /// End of its last tick in seconds since the daemon started.
    end_s: f64,
    message: Bytes,
}

impl From<Frame> for Closed {
    fn from(frame: Frame) -> Closed {
        Closed {
            end_s: frame.end_s(),
            message: frame.encode().into(),
        }
    }
}

impl History {
    /// Adds a tick; a gap in time or another run begins a new frame.
    pub(super) fn push(&mut self, sample: Sample, time_s: f64, tick_s: f64, run: u32) {
        let is_next = |frame: &Frame| frame.continues(time_s, run) && !is_full(frame);
        if !self.open.as_ref().is_some_and(is_next) {
            self.closed.extend(self.open.take().map(Closed::from));
            self.forget_before(time_s - KEPT_S);
        }
        self.open
            .get_or_insert_with(|| Frame::with_blocks(time_s, tick_s, run, BLOCK_TICKS))
            .push(sample);
    }

    fn forget_before(&mut self, time_s: f64) {
        while self
            .closed
            .front()
            .is_some_and(|frame| frame.end_s < time_s)
        {
            self.closed.pop_front();
        }
    }

    /// Everything as messages, oldest first.
    pub(super) fn encode(&self) -> Vec<Bytes> {
        let closed = self.closed.iter().map(|frame| frame.message.clone());
        let open = self.open.iter().map(|frame| frame.encode().into());
        closed.chain(open).collect()
    }
}

fn is_full(frame: &Frame) -> bool {
    frame.ticks() >= FRAME_BLOCKS * u64::from(BLOCK_TICKS)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 2e-4;

    /// Start, period of a block, and the maxima of the first signal of a message (docs/daemon.md, "Samples").
    fn decoded(bytes: &[u8]) -> (f64, f64, Vec<f32>) {
        let f64_at = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        let f32_at = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let blocks = u32::from_le_bytes(bytes[24..28].try_into().unwrap()) as usize;
        let maxima = (0..blocks).map(|block| f32_at(32 + 4 * (4 * blocks + block)));
        (f64_at(8), f64_at(16), maxima.collect())
    }

    #[test]
    fn keeps_ten_minutes_with_the_spike_of_one_tick() {
        let mut history = History::default();
        let ticks = 3_500_000; // 700 s
        let spike = 2_000_000; // at 400 s
        for tick in 0..ticks {
            let value = if tick == spike { 5.0 } else { 0.0 };
            history.push([value; 4], tick as f64 * TICK_S, TICK_S, 1);
        }
        let frames = history.encode();
        let (first_s, ..) = decoded(&frames[0]);
        let frame_s = FRAME_BLOCKS as f64 * f64::from(BLOCK_TICKS) * TICK_S;
        assert!(
            (100.0 - 2.0 * frame_s..=100.0).contains(&first_s),
            "{first_s}"
        );
        let found: Vec<f64> = frames
            .iter()
            .map(|frame| decoded(frame))
            .flat_map(|(start_s, block_s, maxima)| {
                let high = maxima
                    .into_iter()
                    .enumerate()
                    .filter(|(_, value)| *value == 5.0);
                high.map(|(block, _)| start_s + block as f64 * block_s)
                    .collect::<Vec<_>>()
            })
            .collect();
        let [found_s] = found[..] else {
            panic!("{found:?}")
        };
        let spike_s = spike as f64 * TICK_S;
        assert!(
            (spike_s - 64.0 * TICK_S..=spike_s).contains(&found_s),
            "{found_s}"
        );
    }

    #[test]
    fn a_gap_in_time_stays_a_gap() {
        let mut history = History::default();
        for tick in (0..100).chain(200..300) {
            history.push([1.0; 4], f64::from(tick) * TICK_S, TICK_S, 1);
        }
        let starts: Vec<f64> = history
            .encode()
            .iter()
            .map(|frame| decoded(frame).0)
            .collect();
        assert_eq!(starts, [0.0, 200.0 * TICK_S]);
    }
}

//! What a command that the daemon started has printed.

use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::{Deserialize, Serialize};
use tokio::sync::watch;

/// Bytes that are kept; what follows is dropped and counted.
const MAX_BYTES: usize = 4 << 20;

/// A piece of the output, in its order.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputPiece {
    /// From standard output.
    Stdout(String),
    /// From standard error.
    Stderr(String),
    /// The exit code, as the last piece.
    Exit(i32),
}

#[derive(Debug, Default)]
struct Printed {
    pieces: Vec<OutputPiece>,
    bytes: usize,
    dropped_bytes: usize,
}

/// The output of a command, while it runs and afterwards.
#[derive(Debug, Default)]
pub struct RunOutput {
    printed: Mutex<Printed>,
    changes: watch::Sender<usize>,
}

impl RunOutput {
    /// Adds a piece.
    pub fn add(&self, piece: OutputPiece) {
        let count = {
            let mut printed = self.printed();
            let bytes = match &piece {
                OutputPiece::Stdout(text) | OutputPiece::Stderr(text) => text.len(),
                OutputPiece::Exit(_) => 0,
            };
            if printed.bytes + bytes > MAX_BYTES {
                printed.dropped_bytes += bytes;
                return;
            }
            printed.bytes += bytes;
            printed.pieces.push(piece);
            printed.pieces.len()
        };
        self.changes.send_replace(count);
    }

    /// The pieces from number `first` on.
    pub fn from(&self, first: usize) -> Vec<OutputPiece> {
        let printed = self.printed();
        printed.pieces.get(first..).unwrap_or_default().to_vec()
    }

    /// The number of pieces, from now on.
    pub fn changes(&self) -> watch::Receiver<usize> {
        self.changes.subscribe()
    }

    /// The last `lines` lines of standard error.
    pub fn last_errors(&self, lines: usize) -> String {
        let printed = self.printed();
        let errors = printed.pieces.iter().filter_map(|piece| match piece {
            OutputPiece::Stderr(text) => Some(text.as_str()),
            OutputPiece::Stdout(_) | OutputPiece::Exit(_) => None,
        });
        let text: String = errors.collect();
        let all: Vec<&str> = text.lines().collect();
        all[all.len().saturating_sub(lines)..].join("\n")
    }

    fn printed(&self) -> MutexGuard<'_, Printed> {
        self.printed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_order_and_a_limited_number_of_bytes() {
        let output = RunOutput::default();
        output.add(OutputPiece::Stdout("a".into()));
        output.add(OutputPiece::Stderr("one\ntwo\nthree\n".into()));
        output.add(OutputPiece::Stdout("x".repeat(MAX_BYTES)));
        output.add(OutputPiece::Exit(1));
        let kept = output.from(0);
        assert_eq!(kept.len(), 3, "the large piece is dropped");
        assert_eq!(kept[2], OutputPiece::Exit(1));
        assert_eq!(output.last_errors(2), "two\nthree");
    }
}

//! The loop with its interlocks and its recordings, killed commands, and the daemon.

mod daemon;
mod process;
mod recording;
mod safety;
mod state_machine;

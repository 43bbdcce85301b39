//! The daemon as a process: its interface, its queue, its end, and the commands that use it.
mod asks;
mod common;
mod crash;
mod descriptions;
#[cfg(feature = "foxglove")]
mod foxglove;
mod full_disk;
mod held_sequences;
mod hold;
mod hostile;
mod interface;
mod listener;
mod ownership;
mod peer;
mod queue;
mod same_command;
mod sequences;
mod wire;

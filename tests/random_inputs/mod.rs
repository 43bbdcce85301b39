//! Random inputs of every parser of text and files: no panic, and no false valid value.
//!
//! Each input is a valid one with random damage. `BENCH_RANDOM_INPUTS` sets the number of inputs of each parser,
//! `BENCH_RANDOM_SEED` their seed; both are printed. The parsers of CAN frames and serial bytes are tested in `hal` with the
//! same variables, those of recordings in `tests/recording/damage.rs`.

mod checkpoints;
mod controllers;
mod damage;
mod tables;
mod texts;

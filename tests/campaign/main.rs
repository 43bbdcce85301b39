//! `bench campaign`: a grid of chirps, what is kept of it, and what all verdicts say together.

#[path = "../thesis/program.rs"]
mod program;

mod answers;
mod interrupted;
mod loads;

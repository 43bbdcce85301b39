//! `bench campaign`: a grid of chirps, what is kept of it, and what all verdicts say together.

#[path = "../thesis/program.rs"]
mod program;

#[path = "../common/faulty_rig.rs"]
#[allow(dead_code, reason = "each test binary takes what it needs")]
mod faulty_rig;

mod answers;
mod attended;
mod interrupted;
mod loads;

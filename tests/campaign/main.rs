//! `bench campaign`: a grid of chirps, what is kept of it, and what all verdicts say together.

use bench_test_support::program;

use bench_test_support::faulty_rig;

mod answers;
mod attended;
mod interrupted;
mod loads;

//! `bench campaign`: a grid of chirps, its folder, the load of the stage, and the evaluation of all verdicts.

use bench_test_support::program;

use bench_test_support::faulty_rig;

mod guided;
mod interrupted;
mod loads;
mod offset_and_recommendation;

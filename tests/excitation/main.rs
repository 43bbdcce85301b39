//! Whatever excites the stage, it shows the same stage; and what a plan says, the run does.
mod averages;
mod identified;
mod linearity;
mod plans;
use bench_test_support::program;
mod rig;
use bench_test_support::simulated;
use bench_test_support::truth;
mod unfinished;

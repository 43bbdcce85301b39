//! Whatever excites the stage, it shows the same stage; and what a plan says, the run does.
mod averages;
mod identified;
mod linearity;
mod plans;
#[path = "../thesis/program.rs"]
mod program;
mod rig;
#[path = "../common/simulated.rs"]
mod simulated;
#[path = "../thesis/truth.rs"]
mod truth;
mod unfinished;

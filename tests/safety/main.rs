//! What the loop promises whoever stands beside the motor. Each test has been seen to fail with the line it guards broken.
mod arming;
mod bumpless;
#[path = "../common/faulty_rig.rs"]
mod faulty_rig;
mod late_ticks;
mod orders_and_faults;
mod replay;
mod reproducible;
mod rig;
mod trips;

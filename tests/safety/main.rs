//! What the loop promises whoever stands beside the motor. Each test has been seen to fail with the line it guards broken.
mod arming;
mod bumpless;
use bench_test_support::faulty_rig;
mod late_ticks;
mod replay;
mod reproducible;
mod requests_and_faults;
use bench_test_support::loop_rig as rig;
mod trips;

//! Safety requirements of the loop. Each test has been seen to fail with the guarded line broken.
mod arming;
mod bumpless;
mod calibrated;
use bench_test_support::faulty_rig;
mod enabling;
mod late_ticks;
mod live_rig;
mod matrix;
mod replay;
mod reproducible;
mod requests_and_faults;
mod residual;
use bench_test_support::loop_rig as rig;
mod sequence_wrap;
mod settling;
mod supervision;
mod trips;
mod tune;

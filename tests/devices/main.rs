//! Every fault of a device, in every state of the loop: the current is zero and the amplifier off in the time that
//! `hal/README.md` states, the recording is complete and names the cause, the next run starts cleanly. The devices are the
//! real drivers against the acting devices of `bench device`. Each test has been seen to fail with the line it guards broken.
mod amplifier;
mod command;
mod probe;
use bench_test_support::loop_rig as rig;

//! Every fault of a device, in every state of the loop: the current is zero and the amplifier off within the time that
//! `hal/README.md` states, the recording is complete and names the cause, and the next run starts correctly. The real drivers
//! run with the devices of `bench emulate`. Each test has been seen to fail with the guarded line broken.
mod amplifier;
mod command;
mod deferred;
mod probe;
use bench_test_support::loop_rig as rig;

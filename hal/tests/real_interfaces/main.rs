//! The drivers on real interfaces: SocketCAN, slcan, CAN cards and UARTs of a kernel, and programs of other hands.
//!
//! These tests make and delete network interfaces and need cards that few machines have, so they run in the emulated
//! machine of `.ci/vm` (`.ci/vm/check`), and a plain `cargo test` does not build them. Time there is emulated: contents
//! and states are asserted, never latencies, and the drivers' time limits are raised (`support::settings`).

mod bus_off;
mod cable;
mod cards;
mod external_peers;
mod faults;
mod interface;
mod process;
mod running;
mod support;
mod uart;

//! The drivers on real interfaces: SocketCAN, slcan, CAN cards and UARTs of a kernel, and external programs.
//!
//! These tests create and delete network interfaces and need cards that few machines have. They run in the virtual machine of
//! `.ci/vm` (`.ci/vm/check`), and `cargo test` does not build them. Time is emulated there, so the tests check contents and
//! states but no latencies, and the time limits of the drivers are longer (`support::settings`).

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

//! The line of an emulated probe.

use std::os::fd::AsRawFd;

use bench_hal::serial::emulator::Fault;
use serialport::{SerialPort, TTYPort};

use crate::support::probes::{all, optoncdt, ramp, still};
use crate::support::rehearsal::{Rehearsal, more, until, wait_for};

/// Whether the terminal is in exclusive use: a user other than root could not open it.
fn is_exclusive(terminal: &TTYPort) -> bool {
    let mut exclusive: libc::c_int = 0;
    // SAFETY: the descriptor is open, and `exclusive` is the int that TIOCGEXCL writes.
    let result = unsafe { libc::ioctl(terminal.as_raw_fd(), libc::TIOCGEXCL, &mut exclusive) };
    assert_eq!(result, 0, "{}", std::io::Error::last_os_error());
    exclusive != 0
}

fn shared(rehearsal: &Rehearsal) -> TTYPort {
    TTYPort::open(&serialport::new(rehearsal.path.to_string_lossy(), 921_600).exclusive(false))
        .unwrap()
}

#[test]
fn several_readers_can_use_the_probe_one_after_the_other() {
    for protocol in all() {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, ramp);
        for _ in 0..3 {
            more(&mut rehearsal.open(), 20);
        }
    }
}

#[test]
fn exclusive_use_ends_after_a_reader_was_killed() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let observer = shared(&rehearsal);
    let killed = std::fs::File::options()
        .read(true)
        .write(true)
        .open(&rehearsal.path)
        .unwrap();
    // SAFETY: the descriptor is open; TIOCEXCL has no argument.
    let result = unsafe { libc::ioctl(killed.as_raw_fd(), libc::TIOCEXCL) };
    assert_eq!(result, 0);
    drop(killed);
    wait_for("the end of exclusive use", || !is_exclusive(&observer));
}

#[test]
fn bytes_without_a_reader_are_lost() {
    let rehearsal = Rehearsal::new(&optoncdt(), 20_000.0, still);
    let observer = shared(&rehearsal);
    wait_for("20,000 sent bytes", || rehearsal.sent() >= 20_000);
    rehearsal.inject_fault(Fault::Silence);
    let waiting = observer.bytes_to_read().unwrap();
    assert!(
        waiting < 2048 + 1024,
        "{waiting} bytes of {} wait",
        rehearsal.sent()
    );
    drop(observer);
    rehearsal.inject_fault(Fault::None);
    let mut probe = rehearsal.open();
    until(&mut probe, "a new reading", |reading, _| {
        reading.age_ns < 20_000_000 && reading.sequence > 0
    });
}

//! The pretend probe's end of the line.

use std::os::fd::AsRawFd;

use bench_hal::serial::emulator::Fault;
use serialport::{SerialPort, TTYPort};

use crate::support::probes::{all, optoncdt, ramp, still};
use crate::support::rehearsal::{Rehearsal, more, until};

/// Whether the terminal is marked for exclusive use: who is not root could not open it.
fn is_exclusive(terminal: &TTYPort) -> bool {
    let mut mark: libc::c_int = 0;
    // SAFETY: the descriptor is open, and `mark` is the int that TIOCGEXCL writes.
    let result = unsafe { libc::ioctl(terminal.as_raw_fd(), libc::TIOCGEXCL, &mut mark) };
    assert_eq!(result, 0, "{}", std::io::Error::last_os_error());
    mark != 0
}

fn shared(rehearsal: &Rehearsal) -> TTYPort {
    TTYPort::open(&serialport::new(rehearsal.path.to_string_lossy(), 921_600).exclusive(false))
        .unwrap()
}

#[test]
fn one_reader_after_the_other_is_served_by_the_same_probe() {
    for protocol in all() {
        let rehearsal = Rehearsal::new(&protocol, 1000.0, ramp);
        for _ in 0..3 {
            more(&mut rehearsal.open(&protocol), 20);
        }
    }
}

#[test]
fn the_mark_of_exclusive_use_that_a_killed_reader_leaves_is_taken_off() {
    let rehearsal = Rehearsal::new(&optoncdt(), 1000.0, still);
    let watch = shared(&rehearsal);
    let killed = std::fs::File::options()
        .read(true)
        .write(true)
        .open(&rehearsal.path)
        .unwrap();
    // SAFETY: the descriptor is open; TIOCEXCL takes no argument.
    assert_eq!(
        unsafe { libc::ioctl(killed.as_raw_fd(), libc::TIOCEXCL) },
        0
    );
    drop(killed);
    for _ in 0..10_000 {
        if !is_exclusive(&watch) {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    panic!("the mark stays");
}

#[test]
fn what_nobody_reads_is_lost_as_on_a_wire() {
    let rehearsal = Rehearsal::new(&optoncdt(), 20_000.0, still);
    let nobody = shared(&rehearsal);
    while rehearsal.sent() < 20_000 {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    rehearsal.inject_fault(Fault::Silence);
    let waiting = nobody.bytes_to_read().unwrap();
    assert!(
        waiting < 2048 + 1024,
        "{waiting} bytes of {} wait",
        rehearsal.sent()
    );
    drop(nobody);
    rehearsal.inject_fault(Fault::None);
    let mut probe = rehearsal.open(&optoncdt());
    until(&mut probe, "young", |reading, _| {
        reading.age_ns < 20_000_000 && reading.sequence > 0
    });
}

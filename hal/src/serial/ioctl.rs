//! System calls on a terminal that have no safe wrapper.
#![allow(unsafe_code, reason = "ioctl calls")]

use std::io;
use std::os::fd::AsRawFd;

use super::note::Note;

const TIOCGSERIAL: libc::Ioctl = 0x541E;
const TIOCSSERIAL: libc::Ioctl = 0x541F;
const ASYNC_LOW_LATENCY: libc::c_int = 1 << 13;

/// `struct serial_struct` of the kernel.
#[repr(C)]
struct SerialStruct {
    kind: libc::c_int,
    line: libc::c_int,
    port: libc::c_uint,
    irq: libc::c_int,
    flags: libc::c_int,
    xmit_fifo_size: libc::c_int,
    custom_divisor: libc::c_int,
    baud_base: libc::c_int,
    close_delay: libc::c_ushort,
    io_type: libc::c_char,
    reserved: libc::c_char,
    hub6: libc::c_int,
    closing_wait: libc::c_ushort,
    closing_wait2: libc::c_ushort,
    iomem_base: *mut libc::c_uchar,
    iomem_reg_shift: libc::c_ushort,
    port_high: libc::c_uint,
    iomap_base: libc::c_ulong,
}

/// Requests low latency from a serial driver: the flag `ASYNC_LOW_LATENCY` by TIOCGSERIAL and TIOCSSERIAL [Linux,
/// tty_ioctl(4), include/uapi/linux/serial.h]. The note gives the reason if driver or permissions do not allow it.
pub(super) fn request_low_latency(terminal: &impl AsRawFd) -> Result<(), Note> {
    let terminal = terminal.as_raw_fd();
    // SAFETY: all fields are integers or a pointer that is not dereferenced; zero is valid for each.
    let mut serial: SerialStruct = unsafe { std::mem::zeroed() };
    // SAFETY: `serial` has the layout that the kernel writes, and outlives the call.
    check(unsafe { libc::ioctl(terminal, TIOCGSERIAL, &mut serial) })?;
    if serial.flags & ASYNC_LOW_LATENCY != 0 {
        return Ok(());
    }
    serial.flags |= ASYNC_LOW_LATENCY;
    // SAFETY: as above; the kernel reads `serial`.
    check(unsafe { libc::ioctl(terminal, TIOCSSERIAL, &serial) })
}

/// Lets reads and writes return at once instead of waiting (O_NONBLOCK): the serial library waits with `poll` before each of
/// them, but a write of more bytes than fit would block beyond that time.
pub(super) fn do_not_block(terminal: &impl AsRawFd) -> io::Result<()> {
    // SAFETY: the descriptor is open as long as `terminal` is borrowed; F_SETFL takes an integer.
    let result = unsafe { libc::fcntl(terminal.as_raw_fd(), libc::F_SETFL, libc::O_NONBLOCK) };
    match result {
        -1 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}

fn check(result: libc::c_int) -> Result<(), Note> {
    if result >= 0 {
        return Ok(());
    }
    let error = io::Error::last_os_error();
    let remedy = match error.raw_os_error() {
        Some(libc::EPERM | libc::EACCES) => {
            "let root run `setserial PORT low_latency`, or grant CAP_SYS_ADMIN"
        }
        _ => "this driver does not support it; readings may be older than on a port that does",
    };
    Err(Note {
        what: format!("no low latency: {error}"),
        remedy,
    })
}

/// Ends the exclusive use of a terminal (TIOCNXCL). Best effort.
pub(super) fn end_exclusive_use(terminal: &impl AsRawFd) {
    // SAFETY: the descriptor is open as long as `terminal` is borrowed; TIOCNXCL has no argument.
    let _ = unsafe { libc::ioctl(terminal.as_raw_fd(), libc::TIOCNXCL) };
}

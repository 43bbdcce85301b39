//! Asking a serial driver for low latency: the flag `ASYNC_LOW_LATENCY` by TIOCGSERIAL and TIOCSSERIAL [Linux,
//! tty_ioctl(4), include/uapi/linux/serial.h]. Best effort: who may not, or has no such driver, is told.

use std::io;
use std::os::fd::RawFd;

use super::port::Note;

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

/// Sets the flag, or says why not.
pub(super) fn ask(terminal: RawFd) -> Result<(), Note> {
    // SAFETY: all fields are integers or a pointer nobody follows; zero is a value of each.
    let mut serial: SerialStruct = unsafe { std::mem::zeroed() };
    // SAFETY: `serial` has the layout the kernel writes, and lives through the call.
    check(unsafe { libc::ioctl(terminal, TIOCGSERIAL, &mut serial) })?;
    if serial.flags & ASYNC_LOW_LATENCY != 0 {
        return Ok(());
    }
    serial.flags |= ASYNC_LOW_LATENCY;
    // SAFETY: as above; the kernel reads.
    check(unsafe { libc::ioctl(terminal, TIOCSSERIAL, &serial) })
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
        _ => "this driver has no such switch; readings may be older than on a port that has it",
    };
    Err(Note {
        what: format!("no low latency: {error}"),
        remedy,
    })
}

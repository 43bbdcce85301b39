//! Checks whether the kernel supports CAN. Without the kernel module no CAN interface appears.

use nix::errno::Errno;
use nix::sys::socket::{AddressFamily, SockFlag, SockProtocol, SockType, socket};
use thiserror::Error;

/// Raw CAN sockets cannot be opened.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum KernelError {
    /// The kernel has no CAN.
    #[error(
        "this kernel has no CAN; load it with `modprobe can_raw`, or boot a kernel that has it (CONFIG_CAN_RAW)"
    )]
    Missing,
    /// This process may not use it.
    #[error(
        "this process may not open CAN sockets; run it outside the sandbox or container that forbids them"
    )]
    Denied,
    /// Anything else, with the system's number.
    #[error("a CAN socket cannot be opened: {0}; see the kernel messages (dmesg)")]
    Other(Errno),
}

/// Opens a raw CAN socket and closes it again.
pub fn check_can_support() -> Result<(), KernelError> {
    let opened = socket(
        AddressFamily::Can,
        SockType::Raw,
        SockFlag::SOCK_CLOEXEC,
        SockProtocol::CanRaw,
    );
    opened.map(drop).map_err(of)
}

fn of(errno: Errno) -> KernelError {
    match errno {
        Errno::EAFNOSUPPORT | Errno::EPROTONOSUPPORT | Errno::ESOCKTNOSUPPORT => {
            KernelError::Missing
        }
        Errno::EPERM | Errno::EACCES => KernelError::Denied,
        other => KernelError::Other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distinguishes_missing_support_from_missing_permission() {
        assert!(
            of(Errno::EAFNOSUPPORT)
                .to_string()
                .contains("modprobe can_raw")
        );
        assert!(of(Errno::EPROTONOSUPPORT).to_string().contains("no CAN"));
        assert!(of(Errno::EPERM).to_string().contains("may not"));
        assert!(of(Errno::EMFILE).to_string().contains("EMFILE"));
    }
}

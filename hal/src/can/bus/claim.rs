//! Only one process drives a node.
//!
//! The claim is a listening socket with an abstract name, `bench-can/IFACE/NODE`. The kernel gives it to one process of
//! a network namespace, which is where a CAN interface lives too, whoever the user is; it vanishes with the process,
//! however that ends; and it tells the holder's process number (SO_PEERCRED). A file would need a place that all users
//! may write to, and tells the number only as long as nobody else writes it.

use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener};

use nix::sys::socket::{self, AddressFamily, SockFlag, SockType, UnixAddr, sockopt};

/// Holds a node until dropped.
#[derive(Debug)]
pub struct Claim(#[allow(dead_code, reason = "held, not read")] Option<UnixListener>);

impl Claim {
    /// For a bus that nobody else can reach.
    pub const fn none() -> Claim {
        Claim(None)
    }

    /// Claims `node` on `interface`, or tells the process that has it (0 if that cannot be found out).
    pub fn new(interface: &str, node: u8) -> Result<Claim, u32> {
        let name = format!("bench-can/{interface}/{node}");
        let address = SocketAddr::from_abstract_name(&name).map_err(|_| 0u32)?;
        match UnixListener::bind_addr(&address) {
            Ok(listener) => Ok(Claim(Some(listener))),
            Err(_) => Err(holder(&name).unwrap_or(0)),
        }
    }
}

/// The process that listens under `name`.
fn holder(name: &str) -> nix::Result<u32> {
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK; // a full queue of callers must not make us wait
    let socket = socket::socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
    let fd = std::os::fd::AsRawFd::as_raw_fd(&socket);
    socket::connect(fd, &UnixAddr::new_abstract(name.as_bytes())?)?;
    let credentials = socket::getsockopt(&socket, sockopt::PeerCredentials)?;
    Ok(u32::try_from(credentials.pid()).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_claim_is_refused_with_the_holders_process_until_the_first_ends() {
        let me = std::process::id();
        let interface = format!("test-{me}");
        let first = Claim::new(&interface, 5).unwrap();
        assert_eq!(Claim::new(&interface, 5).unwrap_err(), me);
        assert!(Claim::new(&interface, 6).is_ok(), "another node is free");
        drop(first);
        assert!(Claim::new(&interface, 5).is_ok());
    }
}

//! Claims a node for one process.
//!
//! The claim is a listening socket with the abstract name `bench-can/IFACE/NODE`. The kernel permits one such socket per network
//! namespace, for all users; a CAN interface belongs to a network namespace as well. The socket disappears when the process ends
//! for any reason, and it identifies the process that holds it (SO_PEERCRED). A lock file would need a folder that all users can
//! write to, and its content would not be reliable.

use std::num::NonZeroU32;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener};

use nix::sys::socket::{self, AddressFamily, SockFlag, SockType, UnixAddr, sockopt};
use thiserror::Error;

/// Another process uses the node.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("node {node} is already in use by {}; end that process{}, or choose another node", process(*pid), kill(*pid))]
pub struct NodeInUse {
    /// The node.
    pub node: u8,
    /// The process, if it is known.
    pub pid: Option<NonZeroU32>,
}

fn process(pid: Option<NonZeroU32>) -> String {
    pid.map_or_else(
        || "another process".to_owned(),
        |pid| format!("process {pid}"),
    )
}

fn kill(pid: Option<NonZeroU32>) -> String {
    pid.map_or_else(String::new, |pid| format!(" (`kill {pid}`)"))
}

/// The claim of a node; dropping it releases the node.
#[derive(Debug)]
pub struct Claim(#[allow(dead_code, reason = "held, not read")] Option<UnixListener>);

impl Claim {
    /// No claim, for a bus that other processes cannot reach.
    pub const fn none() -> Claim {
        Claim(None)
    }

    /// Claims `node` on `interface`. The error names the process that holds it.
    pub fn new(interface: &str, node: u8) -> Result<Claim, NodeInUse> {
        let name = format!("bench-can/{interface}/{node}");
        let address =
            SocketAddr::from_abstract_name(&name).map_err(|_| NodeInUse { node, pid: None })?;
        match UnixListener::bind_addr(&address) {
            Ok(listener) => Ok(Claim(Some(listener))),
            Err(_) => Err(NodeInUse {
                node,
                pid: holder(&name).ok().flatten(),
            }),
        }
    }
}

/// The process that listens under `name`.
fn holder(name: &str) -> nix::Result<Option<NonZeroU32>> {
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK; // `connect` must not wait if the queue of the socket is full
    let socket = socket::socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
    let fd = std::os::fd::AsRawFd::as_raw_fd(&socket);
    socket::connect(fd, &UnixAddr::new_abstract(name.as_bytes())?)?;
    let credentials = socket::getsockopt(&socket, sockopt::PeerCredentials)?;
    Ok(u32::try_from(credentials.pid())
        .ok()
        .and_then(NonZeroU32::new))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_claim_is_refused_with_the_process_number_until_the_first_ends() {
        let me = std::process::id();
        let interface = format!("test-{me}");
        let first = Claim::new(&interface, 5).unwrap();
        let held = Claim::new(&interface, 5).unwrap_err();
        let text = format!(
            "node 5 is already in use by process {me}; end that process (`kill {me}`), or choose another node"
        );
        assert_eq!((held.node, held.to_string()), (5, text));
        assert!(Claim::new(&interface, 6).is_ok(), "another node is free");
        drop(first);
        assert!(Claim::new(&interface, 5).is_ok());
    }

    #[test]
    fn suggests_no_kill_for_an_unknown_process() {
        let text =
            "node 5 is already in use by another process; end that process, or choose another node";
        assert_eq!(NodeInUse { node: 5, pid: None }.to_string(), text); // `kill 0` would end the caller
    }
}

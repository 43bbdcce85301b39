//! Reserves the devices of a bench for one process, also while they are closed because of a fault.
//!
//! A reservation is a listening socket with an abstract name for each device. The kernel permits one such socket for all users, releases
//! it when the process ends, and knows its process (SO_PEERCRED). It needs no folder that all users and services can write to. The
//! drivers themselves lock the CAN node and the serial port as long as these are open.

use std::io;
use std::os::fd::AsRawFd;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener};
use std::path::Path;

use nix::sys::socket::{
    AddressFamily, SockFlag, SockType, UnixAddr, connect, getsockopt, socket, sockopt,
};

use super::amplifier::can_amplifier;
use bench_config::Config;

/// Longest abstract name, without the zero byte before it.
const MAX_NAME_BYTES: usize = 107;

/// A device that another process has reserved.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{device} belongs to {}; end that process, or give the run to its daemon (leave out --connect none); nothing was moved",
    process(*pid)
)]
pub struct DeviceInUse {
    /// The device, as configured.
    pub device: String,
    /// The process, if it is known.
    pub pid: Option<u32>,
}

/// Number and command line of a process.
fn process(pid: Option<u32>) -> String {
    let Some(pid) = pid else {
        return "another process".into();
    };
    let command = std::fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let command = String::from_utf8_lossy(&command).replace('\0', " ");
    match command.trim() {
        "" => format!("process {pid}"),
        command => format!("process {pid} (`{command}`)"),
    }
}

/// The devices of a configuration, reserved until it is dropped.
#[derive(Debug)]
pub struct Reservation(#[allow(dead_code, reason = "held, not read")] Vec<UnixListener>);

impl Reservation {
    /// Reserves the devices of a configuration; those that this process has reserved before count as reserved. The simulated stage needs
    /// no reservation.
    ///
    /// # Errors
    /// When another process has reserved a device.
    pub fn take(config: &Config) -> Result<Reservation, DeviceInUse> {
        let mut reserved = Vec::new();
        for (device, name) in devices(config) {
            reserved.extend(reserve(&device, &name)?);
        }
        Ok(Reservation(reserved))
    }
}

/// The real devices of a configuration: for the operator, and as the name of the reservation.
fn devices(config: &Config) -> Vec<(String, String)> {
    let amplifier = can_amplifier(&config.amplifier.device).map(|can| {
        let address = can.address();
        let (interface, node) = (address.interface, address.node);
        let shown = format!("node {node} on the CAN interface {interface}");
        (shown, format!("can/{interface}/{node}"))
    });
    let probe = config.probe.device.serial().map(|serial| {
        let path = serial.line.path.display();
        let shown = format!("the serial port {path}");
        (shown, format!("serial/{}", absolute(&serial.line.path)))
    });
    amplifier.into_iter().chain(probe).collect()
}

fn absolute(path: &Path) -> String {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    path.display().to_string()
}

/// The socket; `None` if this process has it already.
fn reserve(device: &str, name: &str) -> Result<Option<UnixListener>, DeviceInUse> {
    let name = abstract_name(name);
    match SocketAddr::from_abstract_name(&name).and_then(|name| UnixListener::bind_addr(&name)) {
        Ok(listener) => Ok(Some(listener)),
        Err(_) => match holder(&name) {
            Some(pid) if pid == std::process::id() => Ok(None),
            pid => Err(DeviceInUse {
                device: device.into(),
                pid,
            }),
        },
    }
}

/// A long path is represented by its end.
fn abstract_name(name: &str) -> Vec<u8> {
    let prefix = b"bench-owner/";
    let kept = name.len().min(MAX_NAME_BYTES - prefix.len());
    let end = &name.as_bytes()[name.len() - kept..];
    [prefix, end].concat()
}

/// The process that listens under `name`.
fn holder(name: &[u8]) -> Option<u32> {
    let peer = || -> io::Result<u32> {
        let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK; // does not wait if the queue of the socket is full
        let made = socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
        connect(made.as_raw_fd(), &UnixAddr::new_abstract(name)?)?;
        let credentials = getsockopt(&made, sockopt::PeerCredentials)?;
        u32::try_from(credentials.pid()).map_err(io::Error::other)
    };
    peer().ok().filter(|pid| *pid > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Purpose, Source, load};

    fn lab(set: String) -> Config {
        let source = Source {
            config: Some("lab".into()),
            sets: vec![set],
            purpose: Purpose::Chirp,
            ..Source::default()
        };
        load(&source).expect("a configuration")
    }

    #[test]
    fn simulated_stage_needs_no_reservation() {
        let config = load(&Source::default()).expect("a configuration");
        assert!(devices(&config).is_empty());
    }

    #[test]
    fn devices_of_the_same_process_count_as_reserved_and_are_free_afterwards() {
        let config = lab(format!(
            "amplifier.device.interface=\"t{}\"",
            std::process::id()
        ));
        assert_eq!(devices(&config).len(), 2);
        let first = Reservation::take(&config).expect("free devices");
        let second = Reservation::take(&config).expect("own devices");
        assert_eq!((first.0.len(), second.0.len()), (2, 0));
        drop(first);
        let third = Reservation::take(&config).expect("free devices");
        assert_eq!(third.0.len(), 2);
    }

    #[test]
    fn names_device_and_process_of_another_reservation() {
        let pid = std::process::id();
        let error = DeviceInUse {
            device: "node 5 on the CAN interface can0".into(),
            pid: Some(pid),
        };
        let text = error.to_string();
        let expected = format!("node 5 on the CAN interface can0 belongs to process {pid} (`");
        assert!(text.starts_with(&expected), "{text}");
    }

    #[test]
    fn long_names_keep_their_end() {
        let name = abstract_name(&"x/".repeat(200));
        assert_eq!(name.len(), MAX_NAME_BYTES);
        assert!(name.starts_with(b"bench-owner/"));
    }
}

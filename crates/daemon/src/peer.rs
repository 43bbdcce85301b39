//! The user of a connection at the socket, as the kernel knows it.

use std::io;

use nix::unistd::geteuid;
use tokio::net::UnixStream;

/// The process at the other end of a connection when it connected (SO_PEERCRED [unix(7)]). A message cannot change it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    /// Number of its user.
    uid: u32,
}

impl Peer {
    /// The peer of a connection.
    ///
    /// # Errors
    /// When the kernel does not tell it.
    pub fn of(stream: &UnixStream) -> io::Result<Peer> {
        let uid = stream.peer_cred()?.uid();
        Ok(Peer { uid })
    }

    /// Whether it runs as the user of this process.
    pub fn is_own_user(self) -> bool {
        self.uid == geteuid().as_raw()
    }
}

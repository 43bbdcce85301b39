//! What a daemon is started with, where it can be reached, and why it cannot start.

use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

use super::private_files::FolderError;
use super::secret::Secret;
use super::shared::DaemonConfig;
use bench_base::lock_file::Holder;
use bench_rig::devices::DeviceInUse;

/// Where the daemon can be reached.
#[derive(Clone, Debug)]
pub struct Started {
    /// The socket.
    pub socket: PathBuf,
    /// The address of the page.
    pub page: Option<String>,
    /// The token for TCP.
    pub token: Option<Secret>,
    /// The address for Foxglove and Lichtblick.
    pub foxglove: Option<SocketAddr>,
    /// The file with the token.
    pub token_file: Option<PathBuf>,
    /// Why the daemon started.
    pub reason: String,
}

impl Started {
    /// The address with which a browser opens the page and may change something.
    pub fn page_with_token(&self) -> Option<String> {
        let (page, token) = (self.page.as_ref()?, self.token.as_ref()?);
        Some(format!("{page}#token={}", token.reveal()))
    }
}

/// What the daemon is started with.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// The configuration.
    pub configuration: DaemonConfig,
    /// The socket.
    pub socket: PathBuf,
    /// An address for TCP.
    pub listen: Option<SocketAddr>,
    /// An address for Foxglove and Lichtblick. Only with the feature `foxglove`.
    pub foxglove: Option<SocketAddr>,
    /// Folder of the recordings.
    pub recordings: PathBuf,
    /// Whether a closed loop begins at once, on the simulated stage.
    pub demo: bool,
}

/// A daemon that cannot start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Another program listens at the socket.
    #[error("another program listens at {}; stop it first, or choose another path with --socket", .0.display())]
    Running(PathBuf),
    /// Another daemon has the socket.
    #[error("the socket {} belongs to {}; stop it first{}, or choose another path with --socket", path.display(), text(holder.as_ref()), kill(holder.as_ref()))]
    SocketInUse {
        /// The path.
        path: PathBuf,
        /// The daemon, if it is known.
        holder: Option<Holder>,
    },
    /// Another daemon has the folder of the recordings.
    #[error("the folder {} belongs to {}; stop it first{}, or choose another folder with --out", path.display(), text(holder.as_ref()), kill(holder.as_ref()))]
    FolderInUse {
        /// The folder.
        path: PathBuf,
        /// The daemon, if it is known.
        holder: Option<Holder>,
    },
    /// Another process has the devices.
    #[error(transparent)]
    DeviceInUse(#[from] DeviceInUse),
    /// Another user could use the socket.
    #[error(transparent)]
    SocketFolder(#[from] FolderError),
    /// The socket cannot be made.
    #[error("cannot listen at {}: {why}; choose another path with --socket", path.display())]
    Socket {
        /// The path.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The address cannot be used.
    #[error("cannot listen at {address}: {why}; choose another address with --listen")]
    Address {
        /// The address.
        address: SocketAddr,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The folder cannot be used.
    #[error("cannot write to the folder {}: {why}; choose another one with --out", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The address for viewers cannot be used.
    #[error("cannot listen at {address}: {why}; choose another address with --foxglove")]
    Foxglove {
        /// The address.
        address: SocketAddr,
        /// Why.
        why: String,
    },
    /// The program was built without the server for viewers.
    #[error(
        "this program was built without --foxglove; install the Debian package, or build with `--features foxglove`"
    )]
    WithoutFoxglove,
    /// The system refuses threads or random numbers.
    #[error("cannot start the daemon: {0}; look at the limits of the system")]
    System(String),
}

fn text(holder: Option<&Holder>) -> String {
    holder.map_or_else(|| "another process".into(), Holder::to_string)
}

fn kill(holder: Option<&Holder>) -> String {
    holder.map_or_else(String::new, |holder| format!(" (`kill {}`)", holder.pid))
}

//! Where the daemon listens on this machine.

use std::path::PathBuf;

use nix::unistd::getuid;

/// Variable of the environment with the path of the socket.
pub const SOCKET_VARIABLE: &str = "BENCH_SOCKET";
/// Variable of the environment with the ticket of a process that the daemon started.
pub const TICKET_VARIABLE: &str = "BENCH_TICKET";

/// The socket of a daemon that the system started.
const SYSTEM_SOCKET: &str = "/run/bench/bench.sock";

/// The socket of this user's daemon: `BENCH_SOCKET`, or the default socket of the user.
pub fn own_socket() -> PathBuf {
    match std::env::var_os(SOCKET_VARIABLE) {
        Some(path) => path.into(),
        None => default_socket(),
    }
}

/// `bench.sock` in the runtime folder of the user, or in a folder of the user in the folder for temporary files.
pub fn default_socket() -> PathBuf {
    match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) => PathBuf::from(folder).join("bench.sock"),
        None => std::env::temp_dir()
            .join(format!("bench-{}", getuid()))
            .join("bench.sock"),
    }
}

/// The sockets at which a command looks for a daemon: that of the environment only, or those of the user and of the system.
pub fn sockets() -> Vec<PathBuf> {
    match std::env::var_os(SOCKET_VARIABLE) {
        Some(path) => vec![path.into()],
        None => vec![own_socket(), SYSTEM_SOCKET.into()],
    }
}

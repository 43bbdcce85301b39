//! What a daemon owns alone: its socket, its devices, and the folder of its recordings. A second daemon on one of them is refused with the
//! name of the first.

use std::io;
use std::path::{Path, PathBuf};

use tokio::net::UnixListener;

use super::private_files::{
    OwnFile, create_private_folder, folder_of, listen_private, write_secret,
};
use super::run_record::{LastEnd, RunRecord};
use super::secret::Secret;
use super::start::{ServeError, ServeOptions};
use bench_base::lock_file::{Holder, LockError, LockFile};
use bench_rig::devices::Reservation;

/// The locks and files of a daemon. Dropping it removes the files that it made, in the order of the fields.
#[derive(Debug)]
pub(super) struct Ownership {
    token: Option<OwnFile>,
    socket_file: Option<OwnFile>,
    record: RunRecord,
    /// The folder of the recordings, without symbolic links.
    recordings: PathBuf,
    _devices: Reservation,
    socket: PathBuf,
    _socket_lock: LockFile,
}

impl Ownership {
    /// Takes everything, or leaves everything as it was.
    ///
    /// # Errors
    /// When another process owns a part of it, or the folder of the socket is not private, and those of the file system.
    pub fn take(options: &ServeOptions) -> Result<Ownership, ServeError> {
        let holder = holder(&options.socket);
        create_private_folder(folder_of(&options.socket))?;
        let socket_lock = lock_socket(&options.socket, &holder)?;
        let devices = Reservation::take(&options.configuration.config)?;
        let recordings = created(&options.recordings)?;
        let record = begin_record(&recordings, &holder)?;
        Ok(Ownership {
            token: None,
            socket_file: None,
            record,
            recordings,
            _devices: devices,
            socket: options.socket.clone(),
            _socket_lock: socket_lock,
        })
    }

    /// The socket, which only its owner and its group may use.
    ///
    /// # Errors
    /// When another program listens there, and those of the operating system.
    pub fn listen(&mut self) -> Result<UnixListener, ServeError> {
        let path = &self.socket;
        if std::os::unix::net::UnixStream::connect(path).is_ok() {
            return Err(ServeError::Running(path.clone()));
        }
        let (listener, file) = listen_private(path).map_err(|why| socket_error(path, why))?;
        self.socket_file = Some(file);
        UnixListener::from_std(listener).map_err(|why| socket_error(&self.socket, why))
    }

    /// Writes the token of this start to a file that only this user may read.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write_token(&mut self, token: &Secret) -> Result<(), ServeError> {
        let path = token_path(&self.socket);
        let written = write_secret(&path, token.reveal());
        self.token = Some(written.map_err(|why| socket_error(&path, why))?);
        Ok(())
    }

    /// The file with the token.
    pub fn token_file(&self) -> Option<PathBuf> {
        self.token.as_ref().map(|token| token.path().into())
    }

    /// The folder of the recordings.
    pub fn recordings(&self) -> &Path {
        &self.recordings
    }

    /// How the last daemon on the folder ended.
    pub fn last_end(&self) -> LastEnd {
        self.record.last()
    }

    /// The daemon runs.
    pub fn started(&mut self) {
        self.record.started();
    }
}

fn holder(socket: &Path) -> Holder {
    let socket = std::path::absolute(socket).unwrap_or_else(|_| socket.into());
    Holder::this_process(format!("the daemon at {}", socket.display()))
}

fn lock_socket(socket: &Path, holder: &Holder) -> Result<LockFile, ServeError> {
    LockFile::take(&with_suffix(socket, "lock"), holder).map_err(|error| match error {
        LockError::Held(holder) => ServeError::SocketInUse {
            path: socket.into(),
            holder,
        },
        LockError::Io(why) => socket_error(socket, why),
    })
}

fn socket_error(path: &Path, why: io::Error) -> ServeError {
    ServeError::Socket {
        path: path.into(),
        why,
    }
}

/// The folder of the recordings; it is made if it is missing.
fn created(folder: &Path) -> Result<PathBuf, ServeError> {
    let made = std::fs::create_dir_all(folder).and_then(|()| folder.canonicalize());
    made.map_err(|why| folder_error(folder, why))
}

fn begin_record(folder: &Path, holder: &Holder) -> Result<RunRecord, ServeError> {
    RunRecord::begin(folder, holder).map_err(|error| match error {
        LockError::Held(holder) => ServeError::FolderInUse {
            path: folder.into(),
            holder,
        },
        LockError::Io(why) => folder_error(folder, why),
    })
}

fn folder_error(folder: &Path, why: io::Error) -> ServeError {
    ServeError::Folder {
        path: folder.into(),
        why,
    }
}

/// `bench.token` for `bench.sock`.
fn token_path(socket: &Path) -> PathBuf {
    match socket.with_extension("token") {
        path if path == socket => with_suffix(socket, "token"),
        path => path,
    }
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    PathBuf::from(format!("{}.{suffix}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn token_never_has_the_name_of_the_socket() {
        assert_eq!(
            token_path(Path::new("a/bench.sock")),
            Path::new("a/bench.token")
        );
        assert_eq!(token_path(Path::new("bench")), Path::new("bench.token"));
        assert_eq!(token_path(Path::new("a.token")), Path::new("a.token.token"));
    }
}

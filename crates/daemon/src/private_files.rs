//! Socket and token of the daemon: only its user (and, at the socket, its group) may use them, and a clean end removes what the daemon
//! made itself.

use std::fs::{DirBuilder, File, OpenOptions, Permissions};
use std::io::{self, Write};
use std::os::fd::AsRawFd;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, PermissionsExt};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};

use nix::sys::socket::{
    AddressFamily, Backlog, SockFlag, SockType, UnixAddr, bind, listen, socket,
};
use nix::sys::stat::{Mode, fchmod};
use nix::unistd::geteuid;

use bench_base::lock_file::is_file_at;

/// Permissions of the token, and of the socket until it listens.
const PRIVATE_MODE: u32 = 0o600;
/// Permissions of the socket: its owner and its group.
const SOCKET_MODE: u32 = 0o660;
/// Permissions of a new folder.
const FOLDER_MODE: u32 = 0o700;
/// Permissions with which others than the owner could replace the files of a folder.
const WRITABLE_BY_OTHERS: u32 = 0o022;

/// A folder in which another user could read or replace the files of the daemon.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A symbolic link.
    #[error("the folder {} is a symbolic link; name the folder to which it leads with --socket", .0.display())]
    Link(PathBuf),
    /// It belongs to somebody else.
    #[error(
        "the folder {} belongs to the user {owner}, who could use the bench in your place; remove it, or choose a socket in a folder of your own with --socket (or XDG_RUNTIME_DIR)",
        path.display()
    )]
    Owner {
        /// The folder.
        path: PathBuf,
        /// Number of the user.
        owner: u32,
    },
    /// Its group or everybody may change it.
    #[error(
        "other users may change the folder {0} (mode {mode:04o}) and so replace the socket; `chmod go-w {0}`, or choose a socket in another folder with --socket",
        path.display()
    )]
    Mode {
        /// The folder.
        path: PathBuf,
        /// Its permissions.
        mode: u32,
    },
    /// It is missing, or not a folder.
    #[error("the folder {}: {why}; choose another path with --socket", path.display())]
    Io {
        /// The folder.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
}

/// The folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Refuses a folder in which another user than root could read or replace the files of this user.
///
/// # Errors
/// With what is wrong with it.
pub fn require_private_folder(folder: &Path) -> Result<(), FolderError> {
    let failed = |why| FolderError::Io {
        path: folder.into(),
        why,
    };
    let found = std::fs::symlink_metadata(folder).map_err(failed)?;
    if found.is_symlink() {
        return Err(FolderError::Link(folder.into()));
    }
    if !found.is_dir() {
        return Err(failed(io::ErrorKind::NotADirectory.into()));
    }
    let owner = found.uid();
    if owner != geteuid().as_raw() && owner != 0 {
        let path = folder.into();
        return Err(FolderError::Owner { path, owner });
    }
    let mode = found.mode() & 0o7777;
    match mode & WRITABLE_BY_OTHERS {
        0 => Ok(()),
        _ => Err(FolderError::Mode {
            path: folder.into(),
            mode,
        }),
    }
}

/// A folder that only this user may enter. One that exists must be private.
///
/// # Errors
/// When it cannot be made, or is not private.
pub fn create_private_folder(folder: &Path) -> Result<(), FolderError> {
    if std::fs::symlink_metadata(folder).is_err() {
        let made = DirBuilder::new()
            .recursive(true)
            .mode(FOLDER_MODE)
            .create(folder);
        made.map_err(|why| FolderError::Io {
            path: folder.into(),
            why,
        })?;
    }
    require_private_folder(folder)
}

/// A file or a socket that this process made. Dropping it removes the file, unless another file has taken its place.
#[derive(Debug)]
pub struct OwnFile {
    path: PathBuf,
    /// Open, so that no other file has its number meanwhile.
    file: File,
}

impl OwnFile {
    /// The file that this process made at `path`.
    fn made(path: &Path) -> io::Result<OwnFile> {
        let mut options = OpenOptions::new();
        options
            .read(true)
            .custom_flags(libc::O_PATH | libc::O_NOFOLLOW);
        Ok(OwnFile {
            path: path.into(),
            file: options.open(path)?,
        })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for OwnFile {
    fn drop(&mut self) {
        if is_file_at(&self.path, &self.file) {
            let _ = std::fs::remove_file(&self.path); // nobody needs it any more
        }
    }
}

/// Writes a secret to a file that nobody else can read at any time. A file that was left is replaced; links are not followed.
///
/// # Errors
/// Those of the file system.
pub fn write_secret(path: &Path, secret: &str) -> io::Result<OwnFile> {
    let partial = PathBuf::from(format!("{}.partial", path.display()));
    remove_left(&partial)?;
    let written = write_new(&partial, secret).and_then(|()| std::fs::rename(&partial, path));
    if let Err(error) = written {
        let _ = std::fs::remove_file(&partial); // the error of writing is the one to report
        return Err(error);
    }
    OwnFile::made(path)
}

/// O_CREAT and O_EXCL: a file or a link of this name is not opened.
fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true).mode(PRIVATE_MODE);
    let mut file = options.custom_flags(libc::O_NOFOLLOW).open(path)?;
    file.write_all(text.as_bytes())
}

fn remove_left(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// A socket that only its owner and its group may use. A socket that was left is replaced; another file is not.
///
/// # Errors
/// Those of the operating system.
pub fn listen_private(path: &Path) -> io::Result<(UnixListener, OwnFile)> {
    match std::fs::symlink_metadata(path) {
        Ok(found) if std::os::unix::fs::FileTypeExt::is_socket(&found.file_type()) => {
            remove_left(path)?;
        }
        Ok(_) => return Err(io::ErrorKind::AlreadyExists.into()),
        Err(_) => {}
    }
    let flags = SockFlag::SOCK_CLOEXEC | SockFlag::SOCK_NONBLOCK;
    let made = socket(AddressFamily::Unix, SockType::Stream, flags, None)?;
    // Linux gives the file the permissions of the descriptor [unix(7)], so that it is private from the beginning.
    fchmod(&made, Mode::from_bits_truncate(PRIVATE_MODE))?;
    bind(made.as_raw_fd(), &UnixAddr::new(path)?)?;
    let file = OwnFile::made(path)?;
    std::fs::set_permissions(path, Permissions::from_mode(SOCKET_MODE))?;
    listen(&made, Backlog::MAXCONN)?;
    Ok((UnixListener::from(made), file))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(path: &Path) -> u32 {
        let metadata = std::fs::symlink_metadata(path).expect("a file");
        metadata.mode() & 0o777
    }

    /// A folder with these permissions inside a private one.
    fn folder(parent: &Path, mode: u32) -> PathBuf {
        let path = parent.join(format!("{mode:o}"));
        std::fs::create_dir(&path).expect("a folder");
        std::fs::set_permissions(&path, Permissions::from_mode(mode)).expect("permissions");
        path
    }

    #[test]
    fn folder_must_be_a_folder_that_only_its_owner_changes() {
        let parent = tempfile::tempdir().expect("a folder");
        for private in [0o700, 0o750, 0o755, 0o711] {
            let folder = folder(parent.path(), private);
            assert!(require_private_folder(&folder).is_ok(), "{private:o}");
        }
        for open in [0o770, 0o775, 0o702, 0o777, 0o1777] {
            let folder = folder(parent.path(), open);
            let error = require_private_folder(&folder).expect_err("refused");
            let text = error.to_string();
            assert!(text.contains("chmod go-w"), "{open:o}: {text}");
        }
        let link = parent.path().join("link");
        std::os::unix::fs::symlink(parent.path().join("700"), &link).expect("a link");
        assert!(matches!(
            require_private_folder(&link),
            Err(FolderError::Link(_))
        ));
        let file = parent.path().join("file");
        std::fs::write(&file, "").expect("a file");
        assert!(matches!(
            require_private_folder(&file),
            Err(FolderError::Io { .. })
        ));
    }

    #[test]
    fn folder_of_another_user_is_refused() {
        // Files of the system are those of root; as root, the folder is given away.
        let parent = tempfile::tempdir().expect("a folder");
        let other = 65534;
        if nix::unistd::chown(parent.path(), Some(other.into()), None).is_err() {
            return; // only root may give a folder away
        }
        let error = require_private_folder(parent.path()).expect_err("refused");
        assert!(error.to_string().contains("the user 65534"), "{error}");
    }

    #[test]
    fn secret_replaces_links_and_files_that_were_left_and_is_private() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, target) = (folder.path().join("token"), folder.path().join("target"));
        std::fs::write(&target, "content").expect("a file");
        for name in ["token", "token.partial"] {
            std::os::unix::fs::symlink(&target, folder.path().join(name)).expect("a link");
        }
        let file = write_secret(&path, "secret").expect("a secret");
        assert_eq!(std::fs::read_to_string(&target).expect("a file"), "content");
        assert_eq!(std::fs::read_to_string(&path).expect("a file"), "secret");
        assert_eq!(mode(&path), 0o600);
        assert!(!path.is_symlink());
        drop(file);
        assert!(!path.exists());
    }

    #[test]
    fn removes_the_socket_only_if_it_is_its_own() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("socket");
        let (_first, first_file) = listen_private(&path).expect("a socket");
        assert_eq!(mode(&path), 0o660);
        std::fs::remove_file(&path).expect("the socket");
        let (_second, second_file) = listen_private(&path).expect("another socket");
        drop(first_file);
        assert!(path.exists());
        drop(second_file);
        assert!(!path.exists());
    }

    #[test]
    fn refuses_a_file_at_the_path_of_the_socket() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("socket");
        std::fs::write(&path, "content").expect("a file");
        let error = listen_private(&path).expect_err("refused");
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(std::fs::read_to_string(&path).expect("a file"), "content");
    }
}

//! Files that the user names: regular files of a limited size.
//!
//! A FIFO would block the program until somebody writes to it, and a device such as `/dev/zero` never ends.

use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

/// Largest configuration, controller or calibration in bytes.
pub const MAX_SETTINGS_BYTES: u64 = 1 << 20;
/// Largest reference or FRF in bytes: two million rows.
pub const MAX_TABLE_BYTES: u64 = 64 << 20;
/// Largest external record in bytes: an hour at 5 kHz with four columns.
pub const MAX_RECORD_BYTES: u64 = 1 << 30;

/// Opens a regular file for reading.
///
/// # Errors
/// Those of the file system; if the file is a folder, a FIFO, a socket or a device.
pub fn open(path: &Path) -> std::io::Result<File> {
    regular(File::options().read(true), path)
}

/// Opens a regular file for reading and writing, and creates it if it does not exist.
///
/// # Errors
/// Those of [`open`].
pub fn open_or_create(path: &Path) -> std::io::Result<File> {
    let mut options = File::options();
    options.read(true).write(true).create(true).truncate(false);
    regular(&mut options, path)
}

fn regular(options: &mut OpenOptions, path: &Path) -> std::io::Result<File> {
    // Without this flag a FIFO without a writer would block here.
    let file = options.custom_flags(libc::O_NONBLOCK).open(path)?;
    let kind = file.metadata()?.file_type();
    if kind.is_file() {
        Ok(file)
    } else {
        Err(refused(format!("it is {}, not a regular file", name(kind))))
    }
}

/// The bytes of a regular file of at most `max_bytes`.
///
/// # Errors
/// Those of [`open`]; if the file is larger.
pub fn read(path: &Path, max_bytes: u64) -> std::io::Result<Vec<u8>> {
    read_open(&open(path)?, max_bytes)
}

/// The rest of an open file, at most `max_bytes`.
///
/// # Errors
/// Those of the file system; if there are more bytes.
pub fn read_open(file: &File, max_bytes: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more shows that the file is too large, even if it grows meanwhile.
    file.take(max_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes {
        Err(refused(format!(
            "it is larger than the limit of {max_bytes} bytes for such a file"
        )))
    } else {
        Ok(bytes)
    }
}

/// The text of a regular file of at most `max_bytes`, without the byte order mark that some programs write at its
/// beginning.
///
/// # Errors
/// Those of [`read`]; if the file is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64) -> std::io::Result<String> {
    let text = String::from_utf8(read(path, max_bytes)?);
    let text = text.map_err(|_| refused("it is not UTF-8 text".into()))?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_string(),
        None => text,
    })
}

/// What a path is, if it is not a regular file: `a FIFO or a pipe`. `None` also if there is nothing or if it cannot be examined.
pub fn special_kind(path: &Path) -> Option<&'static str> {
    let kind = path.metadata().ok()?.file_type();
    (!kind.is_file()).then(|| name(kind))
}

fn refused(why: String) -> Error {
    Error::new(ErrorKind::InvalidInput, why)
}

fn name(kind: FileType) -> &'static str {
    if kind.is_dir() {
        "a directory"
    } else if kind.is_fifo() {
        "a FIFO or a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(path: &Path) -> String {
        read(path, 100).expect_err("refused").to_string()
    }

    #[test]
    fn rejects_a_fifo_a_device_and_a_directory_without_reading() {
        let folder = tempfile::tempdir().expect("a folder");
        let fifo = folder.path().join("fifo");
        nix::unistd::mkfifo(&fifo, nix::sys::stat::Mode::S_IRWXU).expect("a FIFO");
        for (path, what) in [
            (fifo.as_path(), "a FIFO"),
            (Path::new("/dev/zero"), "a device"),
            (folder.path(), "a directory"),
        ] {
            let error = error(path);
            assert!(error.contains(what) && error.contains("regular"), "{error}");
        }
    }

    #[test]
    fn accepts_a_file_of_the_largest_size_and_rejects_one_byte_more() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), [b'x'; 100]).expect("written");
        assert_eq!(read(file.path(), 100).expect("accepted").len(), 100);
        std::fs::write(file.path(), [b'x'; 101]).expect("written");
        let error = error(file.path());
        assert!(error.contains("limit of 100 bytes"), "{error}");
    }

    #[test]
    fn text_has_no_byte_order_mark_and_is_utf_8() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        std::fs::write(file.path(), b"\xef\xbb\xbf0,0\n").expect("written");
        assert_eq!(read_text(file.path(), 100).expect("text"), "0,0\n");
        std::fs::write(file.path(), b"\xff\xfe").expect("written");
        let error = read_text(file.path(), 100).expect_err("not text");
        assert!(error.to_string().contains("UTF-8"), "{error}");
    }
}

//! Archives of NumPy (`numpy.savez`, `numpy.savez_compressed`): a zip file with an array in each `.npy` file.

use std::io::Cursor;

use zip::ZipArchive;

use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;
use crate::npy;
use crate::value::{MAX_NAME_BYTES, Value, Variables, printable};

/// End of the name of an array.
const ENDING: &str = ".npy";

/// Whether the first file of an archive is an array: its header has the length of its name at byte 26, and the name at byte 30.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    let name = bytes.get(26..28).and_then(|length| {
        let length = ByteOrder::Little.bits(length) as usize;
        bytes.get(30..30 + length)
    });
    bytes.starts_with(b"PK\x03\x04") && name.is_some_and(|name| name.ends_with(ENDING.as_bytes()))
}

/// The arrays of an archive.
pub(crate) fn variables(bytes: &[u8], budget: &mut Budget) -> Result<Variables, ArraysError> {
    let file = Bytes::new(bytes, ByteOrder::Little);
    let archive = ZipArchive::new(Cursor::new(bytes));
    let mut archive = archive.map_err(|_| file.damaged("the list of files of a zip archive"))?;
    let mut variables = Variables::new();
    for index in 0..archive.len() {
        variables.extend(variable(&mut archive, index, &file, budget)?);
    }
    Ok(variables)
}

/// An array with its name; `None` for any other file.
fn variable(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    index: usize,
    file: &Bytes<'_>,
    budget: &mut Budget,
) -> Result<Option<(String, Value)>, ArraysError> {
    budget.take(0, 0)?;
    let damaged = |_| file.damaged("an array in a zip archive");
    let entry = archive.by_index(index).map_err(damaged)?;
    let name = printable(entry.name_raw());
    let Some(name) = name.strip_suffix(ENDING).map(String::from) else {
        return Ok(None);
    };
    if name.len() > MAX_NAME_BYTES {
        return Err(file.damaged("a name of at most 1024 bytes"));
    }
    let content = budget.unpack(entry, file, "a packed array, or its checksum");
    let array = content.and_then(|content| npy::array(&content, budget));
    let array = array.map_err(|error| error.in_variable(&name))?;
    Ok(Some((name, array)))
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use zip::CompressionMethod;
    use zip::write::{SimpleFileOptions, ZipWriter};

    use super::*;
    use crate::contents::Contents;

    /// An archive of two arrays of 100 zeros and of a text.
    fn archive(method: CompressionMethod) -> Vec<u8> {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (100,), }\n";
        let length = (header.len() as u16).to_le_bytes();
        let array = [
            b"\x93NUMPY\x01\x00",
            &length[..],
            header.as_bytes(),
            &[0; 800],
        ]
        .concat();
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        let options = SimpleFileOptions::default().compression_method(method);
        for (name, content) in [
            ("u.npy", &array[..]),
            ("y.npy", &array),
            ("note.txt", b"run 7"),
        ] {
            writer.start_file(name, options).expect("memory");
            writer.write_all(content).expect("memory");
        }
        writer.finish().expect("memory").into_inner()
    }

    fn read(bytes: &[u8], limit: u64) -> Result<Contents, ArraysError> {
        variables(bytes, &mut Budget::new(limit)).map(Contents::of)
    }

    #[test]
    fn arrays_of_stored_and_of_compressed_archives_are_read_up_to_the_limit() {
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let bytes = archive(method);
            assert!(is_one(&bytes));
            let contents = read(&bytes, 10_000).expect("valid");
            let names: Vec<&str> = contents.series.iter().map(|s| s.name.as_str()).collect();
            assert_eq!(names, ["u", "y"]);
            // One array, and not two.
            assert_eq!(
                read(&bytes, 1500),
                Err(ArraysError::TooLarge { limit: 1500 })
            );
        }
    }

    #[test]
    fn every_prefix_and_every_changed_byte_is_refused_or_read() {
        for method in [CompressionMethod::Stored, CompressionMethod::Deflated] {
            let whole = archive(method);
            for length in 0..whole.len() {
                assert!(read(&whole[..length], 1 << 20).is_err(), "{length}");
                let mut changed = whole.clone();
                changed[length] ^= 0xff;
                let _ = (is_one(&changed), read(&changed, 1 << 20));
            }
        }
    }

    #[test]
    fn other_archives_are_none() {
        for bytes in [
            &b"PK"[..],
            b"PK\x03\x04",
            &[b"PK\x03\x04", &[0; 40][..]].concat(),
        ] {
            assert!(!is_one(bytes));
        }
    }
}

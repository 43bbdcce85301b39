//! What a file contains: text, whatever its encoding. Other contents are named and refused.

use std::io::Read;

use bench_base::input_file::MAX_RECORD_BYTES;

/// A format that is no table of text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ForeignFormat {
    /// MAT-file of version 5 to 7.
    Mat5,
    /// HDF5, which is also the format of a MAT-file of version 7.3.
    Hdf5,
    /// Parquet.
    Parquet,
    /// A zip archive: NPZ, a workbook, or an archive of other files.
    Zip,
    /// One NumPy array.
    Npy,
    /// Universal file format.
    Universal,
    /// TDMS of LabVIEW.
    Tdms,
    /// MCAP, the format of the recordings of this program.
    Mcap,
    /// A gzip file that ends too early or has wrong bytes.
    DamagedGzip,
    /// A gzip file whose content is too long.
    LongGzip,
    /// Anything else with bytes that no text has.
    Binary,
}

impl ForeignFormat {
    /// The format by the first bytes of a file; `None` for text.
    fn of(bytes: &[u8]) -> Option<ForeignFormat> {
        const MARKS: [(&[u8], ForeignFormat); 8] = [
            (b"MATLAB 5.0", ForeignFormat::Mat5),
            (b"MATLAB 7.3", ForeignFormat::Hdf5),
            (b"\x89HDF", ForeignFormat::Hdf5),
            (b"PAR1", ForeignFormat::Parquet),
            (b"PK\x03\x04", ForeignFormat::Zip),
            (b"\x93NUMPY", ForeignFormat::Npy),
            (b"TDSm", ForeignFormat::Tdms),
            (b"\x89MCAP0\r\n", ForeignFormat::Mcap),
        ];
        let marked = MARKS.iter().find(|(mark, _)| bytes.starts_with(mark));
        let format = marked.map(|(_, format)| *format);
        // A universal file begins with a line of -1 alone.
        let first = bytes.split(|byte| b"\r\n".contains(byte)).next();
        let universal =
            first.is_some_and(|line| line.starts_with(b" ") && line.trim_ascii() == b"-1");
        let format = format.or(universal.then_some(ForeignFormat::Universal));
        format.or_else(|| bytes.contains(&0).then_some(ForeignFormat::Binary))
    }

    /// What it is, for a message.
    pub fn name(self) -> &'static str {
        match self {
            ForeignFormat::Mat5 => "a MATLAB file",
            ForeignFormat::Hdf5 => "an HDF5 or MATLAB 7.3 file",
            ForeignFormat::Parquet => "a Parquet file",
            ForeignFormat::Zip => "a zip archive, such as an NPZ file or a workbook",
            ForeignFormat::Npy => "a NumPy file",
            ForeignFormat::Universal => "a universal file",
            ForeignFormat::Tdms => "a TDMS file of LabVIEW",
            ForeignFormat::Mcap => "a recording (MCAP)",
            ForeignFormat::DamagedGzip => "a damaged or incomplete gzip file",
            ForeignFormat::LongGzip => "a gzip file with more than 1 GiB of content",
            ForeignFormat::Binary => "not a text file",
        }
    }

    /// How to get a table of text from it.
    pub fn remedy(self) -> &'static str {
        match self {
            ForeignFormat::Mat5 => {
                "write the columns as CSV, in MATLAB: writetable(table(t, u, y), 'record.csv')"
            }
            ForeignFormat::Hdf5 => {
                "write the columns as CSV, in MATLAB: writetable(table(t, u, y), 'record.csv'), or in Python with h5py and numpy.savetxt"
            }
            ForeignFormat::Parquet => {
                "write it as CSV, in Python: pandas.read_parquet(FILE).to_csv('record.csv', index=False)"
            }
            ForeignFormat::Zip | ForeignFormat::Npy => {
                "write the columns as CSV, in Python: numpy.savetxt('record.csv', columns, delimiter=',', header='t,u,y', comments='')"
            }
            ForeignFormat::Universal => {
                "write the signals as CSV, for example in Python with pyuff and numpy.savetxt"
            }
            ForeignFormat::Tdms => "export the channels as text or CSV",
            ForeignFormat::Mcap => {
                "leave out --input and --output: a recording has its own channels"
            }
            ForeignFormat::DamagedGzip => "copy it again",
            ForeignFormat::LongGzip => "unpack it and keep the part that is needed",
            ForeignFormat::Binary => "export it as CSV",
        }
    }
}

/// The text of a file.
///
/// # Errors
/// The format of a file that is no text.
pub(crate) fn text(bytes: Vec<u8>) -> Result<String, ForeignFormat> {
    let bytes = unpacked(bytes)?;
    if let Some(text) = utf16(&bytes) {
        return Ok(text);
    }
    if let Some(format) = ForeignFormat::of(&bytes) {
        return Err(format);
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    Ok(match std::str::from_utf8(text) {
        Ok(text) => text.into(),
        // Latin-1, in which every byte is a character.
        Err(_) => text.iter().map(|byte| char::from(*byte)).collect(),
    })
}

/// The bytes in a gzip file; other bytes as they are.
fn unpacked(bytes: Vec<u8>) -> Result<Vec<u8>, ForeignFormat> {
    if !bytes.starts_with(b"\x1f\x8b") {
        return Ok(bytes);
    }
    let mut unpacked = Vec::new();
    let decoder = flate2::read::MultiGzDecoder::new(bytes.as_slice());
    let read = decoder
        .take(MAX_RECORD_BYTES + 1)
        .read_to_end(&mut unpacked);
    match read {
        Err(_) => Err(ForeignFormat::DamagedGzip),
        Ok(_) if unpacked.len() as u64 > MAX_RECORD_BYTES => Err(ForeignFormat::LongGzip),
        Ok(_) => Ok(unpacked),
    }
}

/// The text of UTF-16 with a byte order mark.
fn utf16(bytes: &[u8]) -> Option<String> {
    let (rest, is_big_endian) = match bytes {
        [0xff, 0xfe, rest @ ..] => (rest, false),
        [0xfe, 0xff, rest @ ..] => (rest, true),
        _ => return None,
    };
    let unit = |pair: &[u8]| {
        let pair = [pair[0], pair[1]];
        if is_big_endian {
            u16::from_be_bytes(pair)
        } else {
            u16::from_le_bytes(pair)
        }
    };
    let units = rest.chunks_exact(2).map(unit);
    let characters = char::decode_utf16(units);
    Some(characters.map(|c| c.unwrap_or('\u{fffd}')).collect())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn text_of_each_encoding_is_the_same() {
        let plain = "t,µ\n1,2\n";
        let utf16 = |to_bytes: fn(u16) -> [u8; 2]| {
            let units = std::iter::once(0xfeff).chain(plain.encode_utf16());
            units.flat_map(to_bytes).collect::<Vec<u8>>()
        };
        let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        packed.write_all(plain.as_bytes()).unwrap();
        for bytes in [
            plain.as_bytes().to_vec(),
            [b"\xef\xbb\xbf", plain.as_bytes()].concat(),
            b"t,\xb5\n1,2\n".to_vec(),
            utf16(u16::to_le_bytes),
            utf16(u16::to_be_bytes),
            packed.finish().unwrap(),
        ] {
            assert_eq!(text(bytes.clone()).as_deref(), Ok(plain), "{bytes:?}");
        }
    }

    #[test]
    fn other_formats_are_named() {
        for (bytes, format) in [
            (
                &b"MATLAB 5.0 MAT-file, Platform: GLNXA64"[..],
                ForeignFormat::Mat5,
            ),
            (b"\x89HDF\r\n\x1a\n", ForeignFormat::Hdf5),
            (b"PAR1\x15\x04", ForeignFormat::Parquet),
            (b"PK\x03\x04\x14", ForeignFormat::Zip),
            (b"\x93NUMPY\x01\0", ForeignFormat::Npy),
            (b"    -1\n    58\n", ForeignFormat::Universal),
            (b"    -1  \r\n   151\r\n", ForeignFormat::Universal),
            (b"TDSm\x0e", ForeignFormat::Tdms),
            (b"\x89MCAP0\r\n", ForeignFormat::Mcap),
            (b"t,u\n\0\0\0", ForeignFormat::Binary),
            (b"\x1f\x8bdamaged\0", ForeignFormat::DamagedGzip),
        ] {
            assert_eq!(text(bytes.to_vec()), Err(format), "{bytes:?}");
        }
    }

    #[test]
    fn samples_that_begin_with_minus_one_are_text() {
        let samples = "    -1   0.5   2e-6\n     0   0.5   2e-6\n";
        assert_eq!(text(samples.into()), Ok(samples.into()));
    }
}

//! What a file contains: text, whatever its encoding, or arrays. Other contents are named and refused.

use std::io::Read;

use bench_arrays::Format;
use bench_base::input_file::MAX_RECORD_BYTES;

/// The content of a file, unpacked.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Content {
    /// Text.
    Text(String),
    /// The bytes of a file of arrays.
    Arrays(Format, Vec<u8>),
}

/// A format that is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ForeignFormat {
    /// Parquet, which is read with the feature `parquet`.
    Parquet,
    /// A zip archive that is no NPZ file: a workbook, or an archive of other files.
    Zip,
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
        const MARKS: [(&[u8], ForeignFormat); 4] = [
            (b"PAR1", ForeignFormat::Parquet),
            (b"PK\x03\x04", ForeignFormat::Zip),
            (b"TDSm", ForeignFormat::Tdms),
            (b"\x89MCAP0\r\n", ForeignFormat::Mcap),
        ];
        let marked = MARKS.iter().find(|(mark, _)| bytes.starts_with(mark));
        let format = marked.map(|(_, format)| *format);
        format.or_else(|| bytes.contains(&0).then_some(ForeignFormat::Binary))
    }

    /// What it is, for a message.
    pub fn name(self) -> &'static str {
        match self {
            ForeignFormat::Parquet => "a Parquet file",
            ForeignFormat::Zip => "a zip archive, such as a workbook",
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
            ForeignFormat::Parquet => {
                "build `bench` with `--features parquet`, or write it as CSV, in Python: pandas.read_parquet(FILE).to_csv('record.csv', index=False)"
            }
            ForeignFormat::Zip => "unpack it, or export the sheet as CSV",
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

impl Content {
    /// The content of a file.
    ///
    /// # Errors
    /// The format of a file that is not read.
    pub fn of(bytes: Vec<u8>) -> Result<Content, ForeignFormat> {
        let bytes = unpacked(bytes)?;
        if let Some(text) = utf16(&bytes) {
            return Ok(Content::Text(text));
        }
        if let Some(format) = Format::of(&bytes) {
            return Ok(Content::Arrays(format, bytes));
        }
        if let Some(format) = ForeignFormat::of(&bytes) {
            return Err(format);
        }
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        Ok(Content::Text(match std::str::from_utf8(text) {
            Ok(text) => text.into(),
            // Latin-1, in which every byte is a character.
            Err(_) => text.iter().map(|byte| char::from(*byte)).collect(),
        }))
    }
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
            assert_eq!(
                Content::of(bytes.clone()),
                Ok(Content::Text(plain.into())),
                "{bytes:?}"
            );
        }
    }

    #[test]
    fn other_formats_are_named() {
        for (bytes, format) in [
            #[cfg(not(feature = "parquet"))]
            (&b"PAR1\x15\x04"[..], ForeignFormat::Parquet),
            (&b"PK\x03\x04\x14"[..], ForeignFormat::Zip),
            (b"TDSm\x0e", ForeignFormat::Tdms),
            (b"\x89MCAP0\r\n", ForeignFormat::Mcap),
            (b"t,u\n\0\0\0", ForeignFormat::Binary),
            (b"\x1f\x8bdamaged\0", ForeignFormat::DamagedGzip),
        ] {
            assert_eq!(Content::of(bytes.to_vec()), Err(format), "{bytes:?}");
        }
    }

    #[test]
    fn files_of_arrays_are_recognised() {
        for (bytes, format) in [
            (&b"MATLAB 5.0 MAT-file, Platform: GLNXA64"[..], Format::Mat),
            (b"\x93NUMPY\x01\0", Format::Npy),
            (b"\x89HDF\r\n\x1a\n", Format::Hdf5),
            (
                &[&[0; 512], &b"\x89HDF\r\n\x1a\n"[..]].concat(),
                Format::Hdf5,
            ),
            (b"    -1\n    58\n", Format::Universal),
            (b"    -1  \r\n   151\r\n", Format::Universal),
        ] {
            let expected = Content::Arrays(format, bytes.to_vec());
            assert_eq!(Content::of(bytes.to_vec()), Ok(expected));
        }
    }

    #[test]
    fn samples_that_begin_with_minus_one_are_text() {
        let samples = "    -1   0.5   2e-6\n     0   0.5   2e-6\n";
        assert_eq!(
            Content::of(samples.into()),
            Ok(Content::Text(samples.into()))
        );
    }
}

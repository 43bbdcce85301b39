//! Named arrays of numbers in binary files of other programs.
//!
//! ```text
//! bytes -> variables (numbers, texts, structures) -> contents (series of equal kind of number, single numbers, all else by name)
//! ```
//!
//! | format | written by |
//! |---|---|
//! | MAT-file of version 5 to 7 | `save` of MATLAB and Octave, `scipy.io.savemat` |
//! | HDF5, as also a MAT-file of version 7.3 | `save` of MATLAB with `-v7.3`, h5py, PyTables, programs of instruments |
//! | Parquet (feature `parquet`) | pandas, polars, Arrow, DuckDB |
//! | NPZ, NPY | `numpy.savez`, `numpy.savez_compressed`, `numpy.save` |
//! | universal file, dataset 58 and 58b | vibration analysers, pyuff |
//! | measurement file (LVM) | LabVIEW |
//!
//! Sizes that a file states never determine how much memory is taken: a part ends where its bytes end, and all numbers together, as
//! well as all unpacked bytes, are limited.

#![deny(unsafe_code)]

mod budget;
mod bytes;
mod contents;
mod error;
mod hdf5;
mod labview;
mod mat;
mod npy;
mod npz;
mod number;
#[cfg(feature = "parquet")]
mod parquet;
mod places;
mod universal;
mod value;

pub use contents::{Contents, Series};
pub use error::ArraysError;
pub use number::{Numbers, Precision};
pub use universal::{Dataset, Function};
pub use value::{NumericArray, Value, Variables};

use budget::Budget;

/// A format that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MAT-file of version 5 to 7.
    Mat,
    /// HDF5 file, as also a MAT-file of version 7.3.
    Hdf5,
    /// Parquet file.
    #[cfg(feature = "parquet")]
    Parquet,
    /// Archive of NumPy arrays.
    Npz,
    /// One NumPy array.
    Npy,
    /// Universal file.
    Universal,
    /// Measurement file of LabVIEW.
    LabView,
}

impl Format {
    /// The format by the first bytes of a file; `None` for any other content.
    ///
    /// ```
    /// use bench_arrays::Format;
    /// assert_eq!(Format::of(b"\x93NUMPY\x01\x00"), Some(Format::Npy));
    /// assert_eq!(Format::of(b"t,u,y\n0,1,2\n"), None);
    /// ```
    pub fn of(bytes: &[u8]) -> Option<Format> {
        #[cfg(feature = "parquet")]
        if parquet::is_one(bytes) {
            return Some(Format::Parquet);
        }
        if bytes.starts_with(b"MATLAB 5.0") {
            Some(Format::Mat)
        } else if hdf5::is_one(bytes) {
            Some(Format::Hdf5)
        } else if bytes.starts_with(b"\x93NUMPY") {
            Some(Format::Npy)
        } else if npz::is_one(bytes) {
            Some(Format::Npz)
        } else if labview::is_one(bytes) {
            Some(Format::LabView)
        } else {
            universal::is_one(bytes).then_some(Format::Universal)
        }
    }

    /// What it is, for a message.
    pub fn name(self) -> &'static str {
        match self {
            Format::Mat => "a MAT-file",
            Format::Hdf5 => "an HDF5 file",
            #[cfg(feature = "parquet")]
            Format::Parquet => "a Parquet file",
            Format::Npz => "an NPZ file",
            Format::Npy => "a NumPy file",
            Format::Universal => "a universal file",
            Format::LabView => "a LabVIEW measurement file",
        }
    }
}

/// The variables of a file. The numbers, and the unpacked bytes, may take `max_bytes` each.
///
/// The time responses of a universal file are variables of the name `node:direction` (`2:+Z`), or of ID line 1 if the nodes are not
/// told apart by it, and their abscissas are `time`, in the unit of its axis label. Other functions are named only. The channels of a
/// LabVIEW file have their names and `time`; those of several measurements are fields of `1`, `2`, ...
///
/// # Errors
/// When the file is damaged, or has more numbers.
pub fn variables(format: Format, bytes: &[u8], max_bytes: u64) -> Result<Variables, ArraysError> {
    let mut budget = Budget::new(max_bytes);
    match format {
        Format::Mat => mat::variables(bytes, &mut budget),
        Format::Hdf5 => hdf5::variables(bytes, &mut budget),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::variables(bytes, &mut budget),
        Format::Npz => npz::variables(bytes, &mut budget),
        Format::Npy => Ok(vec![(String::new(), npy::array(bytes, &mut budget)?)]),
        Format::Universal => Ok(universal::records(&universal::datasets(
            bytes,
            &mut budget,
        )?)),
        Format::LabView => labview::variables(bytes, &mut budget),
    }
}

/// The datasets 58 and 58b of a universal file.
///
/// # Errors
/// Those of [`variables`].
pub fn datasets(bytes: &[u8], max_bytes: u64) -> Result<Vec<Dataset>, ArraysError> {
    universal::datasets(bytes, &mut Budget::new(max_bytes))
}

/// The contents of a file: [`variables`] as series and single numbers.
///
/// # Errors
/// Those of [`variables`].
pub fn contents(format: Format, bytes: &[u8], max_bytes: u64) -> Result<Contents, ArraysError> {
    Ok(Contents::of(variables(format, bytes, max_bytes)?))
}

//! Controllers as transfer functions: ratios of polynomials, zeros and poles, or matrices, continuous or discrete, as other
//! programs design them.
//!
//! ```text
//!  [tf], [zpk], [ss] -> Given --roots--> Factors --pairing--> Vec<Section> --check against Given--> Cascade
//!                                                                                                     |  continuous: Tustin
//!                                                                                                     \  discrete: as given
//! ```
//!
//! A transfer function is refused if the response of its sections differs by more than a millionth of its largest magnitude, or if a
//! zero or pole crosses the boundary of stability.

mod boundary;
mod cascade;
mod check;
mod domain;
mod error;
mod frequencies;
mod given;
mod matrices;
mod pairing;
mod polynomial;
mod refinement;
mod roots;
mod settings;
mod wide;

pub use cascade::{Cascade, DiscreteDesign};
pub use check::Agreement;
pub use domain::Domain;
pub use error::{Inexact, RootPlace, TransferError};
pub(crate) use given::factors_of_rows;
pub use roots::{Factors, Roots};
pub use settings::{
    GainUnit, SsFile, SsSettings, TfFile, TfSettings, TransferSettings, TransferTable, ZpkFile,
    ZpkSettings,
};

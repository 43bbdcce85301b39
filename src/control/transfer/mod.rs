//! Controllers as transfer functions: ratios of polynomials, zeros and poles, or matrices, continuous or discrete, as other
//! programs design them.
//!
//! ```text
//!  [tf], [zpk], [ss] -> Given --roots--> Factors --pairing--> Vec<Section> --check against Given--> Cascade
//!                                                                                                     |  continuous: Tustin
//!                                                                                                     \  discrete: as given
//! ```
//!
//! A transfer function whose numbers do not define its response to a millionth is refused.

mod cascade;
mod check;
mod domain;
mod error;
mod frequencies;
mod given;
mod matrices;
mod pairing;
mod polynomial;
mod roots;
mod settings;
mod wide;

pub use cascade::{Cascade, DiscreteDesign};
pub use check::Agreement;
pub use domain::Domain;
pub use error::{TransferError, UnstablePole};
pub use roots::{Factors, Roots};
pub use settings::{
    GainUnit, SsFile, SsSettings, TfFile, TfSettings, TransferSettings, TransferTable, ZpkFile,
    ZpkSettings,
};

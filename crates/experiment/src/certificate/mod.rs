//! Certificates: what a chirp showed about a rig, as the text that a plan contains.
//!
//! A `file` has the load, the digests of the settings and the `signs` of the residues; its defects are an `error`, which an operator
//! may override with a typed reason (`override_reason`). Certificates are issued and judged in [`evidence`](crate::evidence).

mod error;
mod file;
mod override_reason;
mod signs;

pub use error::{CertificateDefects, CertificateError};
pub(crate) use file::FORMAT;
pub use file::{
    Certificate, CertificateText, CertifiedDevices, CertifiedLoad, CertifiedLoop, CertifiedMode,
    CertifiedResponse, CertifiedVerdict, Digests, LoadedCertificate, sha256,
};
pub use override_reason::{OverrideReason, ReasonError};
pub use signs::{SIGNS_DIFFER, SignAgreement, SignCheck};

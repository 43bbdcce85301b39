//! Certificates: what a chirp showed about a rig, as the evidence with which a loop closes.
//!
//! ```text
//!  bench chirp: recording, analysis --certify--> STEM_certificate.json, STEM_frf.csv
//!                                                        |  CertificateText: both texts
//!                                                        v
//!  bench control: Plan --------------------> require_evidence: age, rate, settings, devices, calibration, load, signs,
//!                                                        |     band, lower 95 % modulus margin by the measured response
//!                                                        v
//!                                            a loop on devices closes, or is refused (CertificateError)
//! ```
//!
//! On the simulated stage a defect is a warning. An operator may override a refusal with a typed reason, which is recorded. A loop
//! that is unstable by the model is never run on devices (see `loop_check`).

mod band;
mod check;
mod condition;
mod error;
mod evidence;
mod file;
mod issue;
mod override_reason;
mod signs;

pub use condition::{Agreement, Condition, Subject};
pub use error::{CertificateDefects, CertificateError};
pub(super) use evidence::require_evidence_or_warn;
pub use evidence::{Evidence, OpenRig, require_evidence};
pub use file::{
    Certificate, CertificateText, CertifiedDevices, CertifiedLoad, CertifiedLoop, CertifiedMode,
    CertifiedResponse, CertifiedVerdict, Digests, LoadedCertificate, sha256,
};
pub use issue::{ResponseFile, certify};
pub use override_reason::{OverrideReason, ReasonError};
pub use signs::{SIGNS_DIFFER, SignAgreement, SignCheck};

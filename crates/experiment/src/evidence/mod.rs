//! The evidence with which a loop closes: a certificate is issued after a chirp (`issue`), and compared with the rig of today before a
//! loop closes (`requirement`, which uses `check` and `band`; the result is a table of `condition`s).
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
mod issue;
mod requirement;

pub use condition::{Agreement, Condition, Subject};
pub use issue::{ResponseFile, certify};
pub(crate) use requirement::require_evidence_or_warn;
pub use requirement::{Evidence, OpenRig, require_evidence};

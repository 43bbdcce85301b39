//! Plants of a controller design from measured frequency responses, without a model of the stage.
//!
//! ```text
//!  FRF file, recording (source) -> fit of the modes, distance of the FRF from it (identified) -> MeasuredPlant -> design
//!                                                                                                     |
//!  FRF + controller -> margins with 95 % intervals, bounds outside of the band (evidence) <----------+
//! ```
//!
//! Of the configuration only the loop rate, the delays, the amplifier, the probe and the limits of the interlocks are used.

mod certificate;
mod distinct;
mod disturbance;
mod error;
mod evidence;
mod identified;
mod mode_fit;
mod source;

pub use certificate::{DesignCertificate, DesignExtras, OppositeAsymmetry};
pub use distinct::check_distinct;
pub use disturbance::{DisturbanceError, recorded_disturbance};
pub use error::TuneSourceError;
pub use evidence::{FrfEvidence, evidence};
pub use identified::{IdentifiedFrf, ModeRole};
pub use source::FrfSource;

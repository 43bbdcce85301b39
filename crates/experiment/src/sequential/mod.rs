//! A sequential experiment: short chirps until the verdict is certain.
//!
//! ```text
//!  first shot over all modes --> data of all shots --> fit, verdict --certain--> end
//!           ^                                             |
//!           +----- next shot: band, length, amplitude <---+  the quantity that decides, and its information by frequency
//! ```
//!
//! The next shot excites the band that reduces the uncertainty of the deciding quantity most (the side of a zero or the sign of a
//! residue), for as long as the fit predicts to be necessary. Each look at the data requires a smaller probability of error than a single
//! one ([`Certainty::REPEATED_LOOKS`]), so that the number of looks does not increase the probability of a wrong verdict.
//!
//! [`Certainty::REPEATED_LOOKS`]: bench_identify::verdict::Certainty::REPEATED_LOOKS

mod amplitude;
mod evidence;
mod information;
mod next_shot;
mod planner;
mod run;
mod shot;
mod summary;

pub use run::{Sequence, default_max_motion_s, first_shot_config, until_decided};
pub use shot::Shot;
pub use summary::{SequenceEnd, SequenceLimits, ShotSummary};

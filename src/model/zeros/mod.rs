//! Where the response from the actuator to the probe vanishes: the zeros, their kinds, and what decides them.
//!
//! ```text
//!  Structure -> zeros, kinds -> loci over a setting (locus, matching), maps, bounds on bandwidth and sensitivity
//!  modes     -> sum: what shows between force and probe
//!                 |
//!                 v
//!              sequence of dominant modes -> Tables 3-1 to 3-4, step responses, break points
//! ```
//!
//! ZeroCounts, signs and the sequence of dominant modes are those of the undamped system unless a name says damped.

mod bounds;
mod break_points;
mod kinds;
mod locus;
mod map;
mod matching;
mod sequence;
mod step;
mod sum;
mod tables;

pub use bounds::{Bound, bandwidth_rad_s, guaranteed_peak, opening_angle, opening_angle_allowed};
pub use break_points::{
    critical_damping, critical_residues, critical_sums, touching_damping, two_mode_break_points,
};
pub use kinds::{
    Zero, ZeroCounts, ZeroKind, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros,
};
pub use locus::{Crossing, KindChange, Locus, LocusPlane};
pub use map::cnmp_map;
pub use sequence::{Dominant, Sequence, dominant_sequence, sign_sequence};
pub use step::{StepFeatures, StepResponse};
pub use sum::{ModalSum, ModalTerm};
pub use tables::{MmpLocation, TABLES, Table, TableRow, table_of};

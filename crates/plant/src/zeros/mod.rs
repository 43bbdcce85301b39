//! Zeros of the response from the actuator to the probe, their kinds, and the modes that determine them.
//!
//! ```text
//!  Structure -> zeros, kinds -> loci over a setting, maps, bounds on bandwidth and sensitivity
//!  modes     -> sum of the modes that can be observed between force and probe
//!                 |
//!                 v
//!              sequence of dominant modes -> Tables 3-1 to 3-4, step responses, break points
//! ```
//!
//! Kinds, signs and the sequence of dominant modes are those of the undamped system unless a name contains "damped". The
//! terms are defined in `docs/glossary.md`.

mod bounds;
mod break_points;
mod kinds;
mod locus;
mod map;
mod sequence;
mod step;
mod sum;
mod summary;
mod tables;

pub use bounds::{
    Bound, Demand, bandwidth_rad_s, guaranteed_peak, opening_angle, opening_angle_allowed,
};
pub use break_points::{
    ClosedForm, CriticalDamping, critical_damping, critical_residues, critical_sums,
    touching_damping, two_mode_break_points,
};
pub use kinds::{
    Zero, ZeroCounts, ZeroKind, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros,
};
pub use locus::{Crossing, KindChange, Locus, LocusPlane};
pub use map::cnmp_map;
pub use sequence::{Dominant, Sequence, dominant_sequence, sign_sequence};
pub use step::{StepFeatures, StepPrediction, StepResponse};
pub use sum::{ModalSum, ModalTerm};
pub use summary::{ModeSummary, PlantSummary};
pub use tables::{MmpLocation, SequenceReport, TABLES, Table, TableRow, table_of};

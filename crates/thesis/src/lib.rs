//! Results of the thesis about models of mechanics, which the daily commands of a bench do not need.
//!
//! Kinds, signs and the sequence of dominant modes are those of the undamped system unless a name contains "damped".
//!
//! ```text
//!  modes -> sequence of dominant modes -> Tables 3-1 to 3-4, step responses, break points
//!  zeros -> bounds on bandwidth and sensitivity
//!  two close modes over a setting -> veering: conditions, propositions, placement of the probe
//! ```

#![deny(unsafe_code)]

mod bounds;
mod break_points;
mod sequence;
mod step;
mod summary;
mod tables;
pub mod veering;

pub use bounds::{
    Bound, Demand, bandwidth_rad_s, guaranteed_peak, opening_angle, opening_angle_allowed,
};
pub use break_points::{
    ClosedForm, CriticalDamping, critical_damping, critical_residues, critical_sums,
    touching_damping, two_mode_break_points,
};
pub use sequence::{Dominant, Sequence, dominant_sequence, sign_sequence};
pub use step::{StepFeatures, StepPrediction, StepResponse};
pub use summary::{ModeSummary, PlantSummary};
pub use tables::{MmpLocation, SequenceReport, TABLES, Table, TableRow, table_of};

//! The thermal state of the motor: its model, and the file that keeps it between runs and restarts of the program.
//!
//! The state is the squared current in A^2 through a low-pass filter with the thermal time constant of the winding, as in the
//! interlocks. Its square root is the thermal current.
//!
//! ```text
//!  begin a run: file = "running"        end of the run: file = state of the interlocks
//!  next start:  file -> state, cooled for the time since then; without a usable file the motor is assumed at its limit
//! ```

mod memory;
mod moment;
mod thermal;

pub use memory::{MotorMemory, MotorMemoryError, MotorOrigin, MotorState};
pub use moment::Moment;
pub use thermal::{HeatPrediction, ThermalModel};

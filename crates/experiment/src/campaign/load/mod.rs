//! The load of the stage at a point of the grid, when an operator loads it.
//!
//! The load is planned (`planned_load`), its rest position is measured (`rest_position`), and both are compared (`load_check`).

mod load_check;
mod planned_load;
mod rest_position;

pub use load_check::{Finding, LengthCheck, LoadCheck, ModeCheck};
pub use planned_load::{Load, StageModel};
pub use rest_position::RestPosition;

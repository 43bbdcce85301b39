//! What the identification room promises, against analytic plants and against scipy.

mod accuracy;
mod bad_data;
mod csv;
mod curves;
mod joint;
mod noise;
mod python;
mod repeated;
mod seeds;
mod sides;
mod stage;
#[path = "../common/unrecorded.rs"]
mod unrecorded;
mod welch;

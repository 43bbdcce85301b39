//! What the identification room promises, against analytic plants and against scipy.

mod accuracy;
mod bad_data;
mod csv;
mod joint;
mod noise;
mod python;
mod seeds;
mod stage;
mod welch;

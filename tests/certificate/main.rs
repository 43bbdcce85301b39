//! Certificates: what a chirp leaves, which loops close with it, and the check of the stage before.

mod altered;
mod chirp;
mod command;
mod lower_margin;
mod refused;
mod refused_response;
#[path = "../calibration/skewed_rig.rs"]
#[allow(dead_code, reason = "only some errors of the devices are needed here")]
mod skewed_rig;
mod stage;
mod stage_check;

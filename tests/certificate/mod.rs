//! Certificates: what a chirp leaves, which loops close with it, and the check of the stage before.

mod altered;
mod chirp;
mod command;
mod lower_margin;
mod refused;
mod refused_response;
mod stage;
mod stage_check;

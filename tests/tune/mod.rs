//! `bench tune` and the design of controllers.

mod closed_form;
mod command;
mod delivered;
mod measured;
mod measured_command;
mod measured_disturbance;
mod measured_refused;
mod stage;

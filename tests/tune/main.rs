//! `bench tune` and the design of controllers.

mod closed_form;
mod command;
mod delivered;
mod stage;

//! The commands: options, settings and files; what they print, draw and write, and what they refuse.

mod bad_input;
mod calibration;
mod campaign;
mod certificate;
mod command;
mod compare;
mod config_settings;
mod devices;
mod doctor;
mod export;
mod external;
mod figures;
mod motor;
mod report;
mod study;

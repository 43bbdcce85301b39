//! `bench`: a controller daemon for a precision-motion test bench.
pub mod config;
pub mod control;
pub mod excitation;
pub mod plant;
pub mod rt;
pub mod sim;

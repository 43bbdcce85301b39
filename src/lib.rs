//! `bench`: a controller daemon for a precision-motion test bench.
pub mod identify;
pub mod recording;
pub mod report;
pub mod rt;

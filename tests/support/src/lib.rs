//! Shared code of the integration tests: running the program, independent references in Python, rigs, recordings.

pub mod chirp_source;
pub mod compared;
pub mod faulty_rig;
pub mod feedback_loop;
pub mod gain_in_noise;
pub mod identified;
pub mod loop_rig;
pub mod program;
pub mod python;
pub mod seeds;
pub mod sequences;
pub mod simulated;
pub mod stage;
pub mod svg;
pub mod synthetic;
pub mod truth;
pub mod unrecorded;

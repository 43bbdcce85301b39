//! The stage between an emulated amplifier and an emulated probe.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::simulated::LiveStage;
use bench_config::Config;
use bench_plant::PlantError;

/// A stage in real time; clones refer to the same stage. Times are nanoseconds of one clock.
#[derive(Clone, Debug)]
pub struct Stage(Arc<Mutex<LiveStage>>);

impl Stage {
    /// The stage of a configuration, at rest at time 0.
    pub fn new(config: &Config) -> Result<Stage, PlantError> {
        let stage = LiveStage::new(config)?;
        Ok(Stage(Arc::new(Mutex::new(stage))))
    }

    /// Sets the current that the amplifier gives from `now_ns` on, in amperes.
    pub fn command(&self, now_ns: u64, current_a: f64) {
        self.lock().command(seconds(now_ns), current_a);
    }

    /// The current that flows, in amperes. It follows the set-point with the amplifier's bandwidth.
    pub fn current_a(&self, now_ns: u64) -> f64 {
        self.lock().current_a(seconds(now_ns))
    }

    /// Displacement of the stage, in metres.
    pub fn position_m(&self, now_ns: u64) -> f64 {
        self.lock().position_m(seconds(now_ns))
    }

    fn lock(&self) -> MutexGuard<'_, LiveStage> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Nanoseconds as seconds.
pub(super) fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}

//! One stage for an acting amplifier and an acting probe.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::config::Config;
use crate::model::plant::PlantError;
use crate::rig::simulated::LiveStage;

/// A stage in real time; clones are the same stage. Times are nanoseconds of one clock.
#[derive(Clone, Debug)]
pub struct Stage(Arc<Mutex<LiveStage>>);

impl Stage {
    /// The stage of a configuration, at rest at time 0.
    pub fn new(config: &Config) -> Result<Stage, PlantError> {
        Ok(Stage(Arc::new(Mutex::new(LiveStage::new(config)?))))
    }

    /// From now on the amplifier shall give `current_a` amperes.
    pub fn command(&self, now_ns: u64, current_a: f64) {
        self.live().command(seconds(now_ns), current_a);
    }

    /// The current that flows, in amperes: it follows the set-point through the amplifier's bandwidth.
    pub fn current_a(&self, now_ns: u64) -> f64 {
        self.live().current_a(seconds(now_ns))
    }

    /// Where the stage is, in metres.
    pub fn position_m(&self, now_ns: u64) -> f64 {
        self.live().position_m(seconds(now_ns))
    }

    fn live(&self) -> MutexGuard<'_, LiveStage> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Nanoseconds as seconds.
pub(super) fn seconds(ns: u64) -> f64 {
    ns as f64 * 1e-9
}

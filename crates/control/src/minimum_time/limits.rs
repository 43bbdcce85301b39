//! The limits and the times of a step.

/// The limits of a step. All are positive, and apply to each plant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepLimits {
    /// Height of the step in metres.
    pub height_m: f64,
    /// Largest error in metres from the settling time on.
    pub error_m: f64,
    /// Largest current in amperes.
    pub current_a: f64,
    /// Largest change of the current from one tick to the next in amperes.
    pub change_a: f64,
    /// Largest travel in metres, also of the reference.
    pub travel_m: f64,
    /// Largest overshoot in metres, if it is limited.
    pub overshoot_m: Option<f64>,
}

/// The times of a step in ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepTiming {
    /// Length of a block with a constant reference.
    pub block_ticks: usize,
    /// Number of blocks until the reference stays at the height of the step.
    pub blocks: usize,
}

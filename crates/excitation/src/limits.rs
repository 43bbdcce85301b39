//! The limits of motor, amplifier and stage for an excitation.

/// Limits that an excitation must not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Travel in metres to either side.
    pub travel_m: f64,
    /// Peak current of the motor in amperes.
    pub peak_current_a: f64,
    /// Current limit of the amplifier in amperes.
    pub amplifier_current_a: f64,
    /// Continuous current of the motor in amperes.
    pub continuous_current_a: f64,
    /// Slew rate of the amplifier in A/s.
    pub slew_a_per_s: f64,
    /// Thermal time constant of the motor in seconds.
    pub thermal_time_constant_s: f64,
    /// Length of a tick in seconds.
    pub period_s: f64,
}

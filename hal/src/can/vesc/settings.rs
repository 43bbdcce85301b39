//! Settings of a VESC.

use std::time::Duration;

/// Settings of a VESC.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VescSettings {
    /// Node number.
    pub node: u8,
    /// Limit of the commands, in amperes.
    pub current_limit_a: f64,
    /// Without STATUS for this time the VESC is lost.
    pub status_timeout: Duration,
    /// If the loop sends no command for this time while the VESC is enabled, the current is switched off.
    pub command_timeout: Duration,
}

impl VescSettings {
    pub(super) fn check(&self) -> Result<(), String> {
        let limit_a = self.current_limit_a;
        if limit_a > 0.0 && limit_a <= 1000.0 {
            Ok(())
        } else {
            Err(format!(
                "current_limit_a = {limit_a} is invalid; set it to a value above 0 and at most 1000"
            ))
        }
    }
}

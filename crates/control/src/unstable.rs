//! Which poles on or beyond the boundary of stability a controller may have.

/// Largest number of integrators: a double one tracks a ramp without error.
pub const MAX_INTEGRATORS: usize = 2;

/// Why controllers with unstable poles are refused, also where the closed loop would be stable.
pub(super) const ONLY_STABLE: &str = "unstable controllers are refused also if the closed loop is stable, because the program has no anti-windup: while the loop is interrupted (limited current, missing readings) or its gain is lowered, their output grows exponentially";

/// Why the number of integrators is limited.
pub(super) const WHY_TWO: &str = "rounding moves the poles of more integrators so far that stability cannot be decided; remove integrators";

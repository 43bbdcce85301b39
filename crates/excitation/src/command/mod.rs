//! The command of a closed loop: its reference, and a feedforward current that is added to the current of the control law.
//!
//! ```text
//!                    +--> reference filter ----> r(k)     = sum over i of a_i r0(k - d_i)      to the control law
//!  reference r0(k) --+
//!                    +--> feedforward filter --> u_ff(k)  = sum over i of g_i r0(k - d_i)      added to its current
//! ```
//!
//! Both filters are sums of delayed values of the planned reference r0. A delay may be negative: r0 is a function of the tick
//! and known in advance (preview). Command shaping, a prefilter and the inverse of the plant are such filters; several in series
//! are one again, by convolution.

mod filter;
mod filtered;
mod impulses;
mod low_pass;
mod source;
mod taps;

pub use filter::{CommandFilter, CommandFilterError};
pub use filtered::FilteredCommand;
pub use impulses::{Impulse, ImpulseShaper, Vibration};
pub use low_pass::low_pass_taps;
pub use source::{CommandSource, LoopCommand, Unfiltered};
pub use taps::{Tap, Taps};

//! The fastest step of a closed loop within the limits of its current: a linear programme.
//!
//! The reference of the loop is constant over blocks of ticks, r = h x_j in block j, and r = h after the last block. The responses
//! of reading y and current u to a unit step of the reference are s_y and s_u, so that at tick k with blocks of B ticks
//!
//! y(k) = h (sum over j of x_j (s_y(k - j B) - s_y(k - (j + 1) B)) + s_y(k - J B))
//!
//! and the same for u. For the settling tick N the programme minimises the largest error after N over all plants,
//!
//! minimise t   subject to   |y(k) - h| <= t e for k >= N,   |u(k)| <= i,   |u(k) - u(k - 1)| <= d,   |y(k)| <= l
//!
//! with e the permitted error, i the current, d its change from tick to tick, l the travel; and y(k) <= h + o with an overshoot of
//! at most o. The least N with t <= 1 is found by bisection. Constraints are added where a solution violates them: of some 10^5 only
//! several hundred are active near the optimum.
//!
//! The result is the same reference for all plants, as a filter of the step: its taps are x_j - x_(j - 1) at j B.

mod limits;
mod programme;
mod responses;
mod solver;
mod step;

pub use limits::{StepLimits, StepTiming};
pub use responses::StepPlant;
pub use step::{MinimumTime, MinimumTimeError, minimum_time};

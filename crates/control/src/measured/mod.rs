//! Margins from a measured frequency response.
//!
//! ```text
//! points of P (command -> reading) -> smooth curve -> L = P C at every frequency -> margins, peaks with 95 % intervals
//!                                                        |
//!      model below and above the band -------------------+-> Nyquist count, bounds outside the band
//! ```
//!
//! P is the response from the command of a tick to the reading of a tick. It contains hold, computing delay, amplifier, stage and
//! the age of the readings; C is the discrete control law. So L = P C is the loop as it runs, and nothing is added to it.
//!
//! **Intervals.** The error of P is circular: with e = dP/P, E|e|^2 = v, its real and imaginary part have the variance v/2 and
//! are independent. To first order (delta method) dL/L = e and
//!
//! ```text
//! |1 + L|: Re(L e conj(F)/|F|), F = 1 + L      ln|S|: -Re(T e)     ln|T|: Re(S e)     ln|C S|: -Re(T e)     ln|P S|: Re(S e)
//! |L| = 1:       dw = -Re(e)/g,  d(arg L) = Im(e) - (f/g) Re(e)      g = d ln|L|/dw, f = d(arg L)/dw
//! arg L = -pi:   dw = -Im(e)/f,  d(ln|L|) = Re(e) - (g/f) Im(e)
//! |S| = 1/sqrt2: dw = Re(T e)/h                                      h = d ln|S|/dw
//! ```
//!
//! At an extremum the shift of its frequency has no effect of first order. The frequencies themselves are found on the smooth curve,
//! so that the smallest distance from -1 is not that of the point with the largest error (`smoothing`).

mod band;
mod count;
mod error;
mod lower;
mod margins;
mod measured_loop;
mod point;
mod quadratic;
mod smoothing;

pub use band::{OutsideBand, RangeBound, check_gaps, least_damping_ratio};
pub use count::{NyquistCount, Stability};
pub use error::MeasuredLoopError;
pub use lower::LowerMargin;
pub use margins::{LoopPeaks, MeasuredCrossing, MeasuredMargins};
pub use measured_loop::MeasuredLoop;
pub use point::ResponsePoint;

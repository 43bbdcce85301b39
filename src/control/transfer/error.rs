//! Why a transfer function is refused.

use std::fmt;

/// A transfer function that is refused. The text follows the name of its file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TransferError {
    /// All numbers of a key are 0.
    #[error("`{key}` has no number other than 0; give the coefficients by falling powers")]
    Zero {
        /// The key.
        key: &'static str,
    },
    /// A number that is not finite.
    #[error("`{key}` contains {value}; give finite numbers")]
    NotFinite {
        /// The key.
        key: &'static str,
        /// NaN or an infinity.
        value: f64,
    },
    /// A matrix or vector whose size does not match A.
    #[error(
        "`{key}` has {given} numbers, but `ss.a` has {states} rows; give {states} numbers in each row of `ss.a`, in `ss.b` and in `ss.c`"
    )]
    Size {
        /// The key.
        key: &'static str,
        /// Number of entries.
        given: usize,
        /// Number of rows of A.
        states: usize,
    },
    /// More zeros than poles.
    #[error(
        "it is improper: it has {zeros} zeros and {poles} poles; add poles until there are as many as zeros"
    )]
    Improper {
        /// Number of zeros.
        zeros: usize,
        /// Number of poles.
        poles: usize,
    },
    /// An order above the limit.
    #[error("its order is {order}, above the limit of {limit}; reduce the order")]
    Order {
        /// Number of poles.
        order: usize,
        /// The limit.
        limit: usize,
    },
    /// A complex root without its conjugate.
    #[error(
        "`{key}` contains {re} {im:+}j without its conjugate; add [{re}, {}], because the coefficients of a controller are real", -.im
    )]
    NoConjugate {
        /// The key.
        key: &'static str,
        /// Real part.
        re: f64,
        /// Imaginary part.
        im: f64,
    },
    /// A pole that is not stable.
    #[error("it is unstable: it has a pole at {pole}; {remedy}", remedy = .pole.remedy())]
    Unstable {
        /// The pole.
        pole: UnstablePole,
    },
    /// A response that is 0 at all frequencies.
    #[error("its response is 0 at all frequencies; check B, C, D and the gain")]
    NoResponse,
    /// Roots that cannot be computed.
    #[error(
        "its {what} cannot be computed in double precision; give `[zpk]`, with frequencies in rad/s and numbers of moderate size"
    )]
    NoRoots {
        /// Zeros or poles.
        what: &'static str,
    },
    /// Sections whose response is not that of the transfer function.
    #[error(
        "its response cannot be reproduced by sections: at {rad_s:.6} rad/s the relative difference is {difference:.1e}, the limit {limit:.1e}, because the numbers given are too sensitive to rounding; give `[zpk]` (zeros, poles and gain), which is not"
    )]
    Inexact {
        /// The frequency of the largest difference relative to its limit.
        rad_s: f64,
        /// Relative difference.
        difference: f64,
        /// Its limit.
        limit: f64,
    },
    /// Another servo rate.
    #[error(
        "it is discrete and designed for {designed_hz} Hz, but the loop runs at {loop_hz} Hz (loop.rate_hz); set loop.rate_hz={designed_hz}, or convert the controller for {loop_hz} Hz"
    )]
    Rate {
        /// The rate of the design.
        designed_hz: f64,
        /// The servo rate.
        loop_hz: f64,
    },
}

/// A pole that is not stable, in the s or the z plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnstablePole {
    /// Real part, in rad/s in the s plane.
    pub re: f64,
    /// Imaginary part, in rad/s in the s plane.
    pub im: f64,
    /// Whether it is a pole in the z plane.
    pub discrete: bool,
}

impl UnstablePole {
    fn remedy(&self) -> &'static str {
        match self.discrete {
            true => {
                "move the pole inside the unit circle (only a single pole at z = 1, an integrator, is allowed), leave out `rate_hz` if the controller is continuous, or give `[zpk]` if rounding of the numbers moved the pole there"
            }
            false => {
                "move the pole to the left of the imaginary axis (only a single pole at the origin, an integrator, is allowed), add `rate_hz` if the controller is discrete, or give `[zpk]` if rounding of the numbers moved the pole there"
            }
        }
    }
}

impl fmt::Display for UnstablePole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let UnstablePole { re, im, discrete } = self;
        match discrete {
            true => write!(f, "z = {re:.9} {im:+.9}j"),
            false => write!(f, "s = {re:.4} {im:+.4}j rad/s"),
        }
    }
}

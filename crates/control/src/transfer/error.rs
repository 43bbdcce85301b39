//! Why a transfer function is refused.

use std::fmt;

use nalgebra::Complex;

use super::domain::Domain;
use crate::unstable::{MAX_INTEGRATORS, ONLY_STABLE, WHY_TWO};

/// A transfer function that is refused. The text follows the name of its file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    /// A matrix A that is not square.
    #[error(
        "row {row} of `ss.a` has {given} numbers, but there are {states} rows; give a square matrix, as many numbers in each row as there are rows"
    )]
    NotSquare {
        /// Number of the row, from 1.
        row: usize,
        /// Number of its entries.
        given: usize,
        /// Number of rows.
        states: usize,
    },
    /// A vector whose size does not match A.
    #[error(
        "`{key}` has {given} numbers, but `ss.a` has {states} rows; give {states} numbers in `ss.b` and in `ss.c`"
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
    #[error("it is unstable: it has a pole at {pole}; {remedy}; {ONLY_STABLE}", remedy = .pole.remedy())]
    Unstable {
        /// The pole.
        pole: RootPlace,
    },
    /// A pole beside the place of an integrator that is not stable.
    #[error(
        "its pole at {pole} is not an integrator, which has its pole at exactly {place}, and it is not stable; if the controller was designed with an integrator, the numbers were rounded when they were computed or saved, and the pole moved: save zeros, poles and gain (zpk), or matrices (ss)",
        place = .pole.integrator()
    )]
    NotIntegrator {
        /// The pole.
        pole: RootPlace,
    },
    /// More than two integrators.
    #[error(
        "it has {count} integrators (poles at {place}); the limit is {MAX_INTEGRATORS}, because {WHY_TWO}"
    )]
    Integrators {
        /// Their number.
        count: usize,
        /// `s = 0` or `z = 1`.
        place: &'static str,
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
    #[error(transparent)]
    Inexact(Box<Inexact>),
    /// A zero or pole that the sections have on the other side of the stability boundary.
    #[error(
        "rounding of the sections moves its {what} from {from} across the boundary of stability to {to}; move it away from the boundary"
    )]
    Crossed {
        /// Zero or pole.
        what: &'static str,
        /// As given.
        from: Box<RootPlace>,
        /// In the sections.
        to: Box<RootPlace>,
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

/// Where the response of the sections differs from that of the transfer function.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "its response cannot be reproduced by sections: at {hz:.6} Hz ({rad_s:.6} rad/s) it is {}, that of the sections {}, a difference of {difference:.1e} of its largest magnitude, above the limit of {limit:.0e}{}; the numbers given are too sensitive to rounding: give `[zpk]` (zeros, poles and gain), which is not",
    rectangular(.given), rectangular(.sections), nearest(.pole.as_ref())
)]
pub struct Inexact {
    /// The frequency of the largest difference in hertz.
    pub hz: f64,
    /// The same frequency in rad/s.
    pub rad_s: f64,
    /// Response of the transfer function in amperes per micrometre.
    pub given: Complex<f64>,
    /// Response of the sections in amperes per micrometre.
    pub sections: Complex<f64>,
    /// Difference relative to the largest magnitude.
    pub difference: f64,
    /// Its limit.
    pub limit: f64,
    /// The pole of the sections that is nearest to this frequency.
    pub pole: Option<RootPlace>,
}

fn rectangular(value: &Complex<f64>) -> String {
    format!("{:.6e} {:+.6e}j A/um", value.re, value.im)
}

fn nearest(pole: Option<&RootPlace>) -> String {
    pole.map_or_else(String::new, |pole| {
        format!("; the pole that moved is near {pole}")
    })
}

/// A zero or pole in the s or the z plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RootPlace {
    /// Real part, in rad/s in the s plane.
    pub re: f64,
    /// Imaginary part, in rad/s in the s plane.
    pub im: f64,
    /// Whether it is in the z plane.
    pub discrete: bool,
}

impl RootPlace {
    pub(super) fn of(root: Complex<f64>, domain: Domain) -> RootPlace {
        RootPlace {
            re: root.re,
            im: root.im,
            discrete: domain != Domain::Continuous,
        }
    }

    fn integrator(&self) -> &'static str {
        if self.discrete { "z = 1" } else { "s = 0" }
    }

    fn remedy(&self) -> &'static str {
        if self.discrete {
            "move the pole inside the unit circle (at most two poles at exactly z = 1, integrators, are allowed), leave out `rate_hz` if the controller is continuous, or give `[zpk]` if rounding of the numbers moved the pole there"
        } else {
            "move the pole to the left of the imaginary axis (at most two poles at the origin, integrators, are allowed), add `rate_hz` if the controller is discrete, or give `[zpk]` if rounding of the numbers moved the pole there"
        }
    }
}

impl fmt::Display for RootPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RootPlace { re, im, discrete } = self;
        if *discrete {
            write!(f, "z = {re:.12} {im:+.12}j")
        } else {
            write!(f, "s = {re:.4} {im:+.4}j rad/s")
        }
    }
}

//! Why no controller was designed.

use std::fmt;

use super::binding::Binding;

/// A design that failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TuneError {
    /// No controller that was found fulfils the limits.
    #[error("{0}")]
    Conflict(Box<Conflict>),
    /// The closed loop of the result is unstable.
    #[error(
        "the loop designed for {plant} is unstable by its poles, although its Nyquist curve does not enclose -1; report this with the configuration"
    )]
    Unstable {
        /// The plant.
        plant: String,
    },
    /// No plant to design for.
    #[error("there is no plant to design for; give at least one operating point")]
    NoPlant,
    /// A loop of the plant with a weak integrator is unstable.
    #[error(
        "{plant} is not stable with a weak integrator, so the search has no first controller; only stages with a spring to ground and a positive static compliance are supported"
    )]
    NoStart {
        /// The plant.
        plant: String,
    },
}

/// Two requirements that exclude each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Conflict {
    /// Order of the controllers that were tried.
    pub order: usize,
    /// The tightest requirement.
    pub first: Option<Binding>,
    /// The tightest one that differs from it.
    pub second: Option<Binding>,
}

impl fmt::Display for Conflict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let order = self.order;
        write!(
            f,
            "no controller of order {order} was found that fulfils all limits"
        )?;
        if let (Some(first), Some(second)) = (&self.first, &self.second) {
            let percent = -100.0 * first.slack;
            write!(
                f,
                ": {first}, missed by {percent:.1} %, conflicts with {second}"
            )?;
        }
        f.write_str("; relax one of them, or raise --order")
    }
}

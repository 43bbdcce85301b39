//! Why no controller was designed.

use std::fmt;

use super::binding::Binding;

/// A design that failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneError {
    /// No controller that was found fulfils the limits.
    #[error("{0}")]
    Conflict(Box<Conflict>),
    /// The closed loop of the result is unstable.
    #[error(
        "the search ended with a controller of order {order} that is unstable with {plant}: a pole of the closed loop at {pole_hz:.3} Hz is so lightly damped that the frequencies of the search do not resolve it; choose a lower --order, a larger --modulus-margin or another --seed"
    )]
    Unstable {
        /// The plant.
        plant: String,
        /// Frequency of an unstable pole.
        pole_hz: f64,
        /// Order of the controller.
        order: usize,
    },
    /// No plant to design for.
    #[error("there is no plant to design for; give at least one operating point")]
    NoPlant,
    /// The plant has a mode without stiffness, so that a loop with an integrator alone is unstable.
    #[error(
        "{plant} has a mode of frequency zero, so a weak integrator does not stabilise it and the search has no first controller; bench tune needs a stage with a spring to ground"
    )]
    NoSpring {
        /// The plant.
        plant: String,
    },
    /// A positive current moves the plant in the negative direction.
    #[error(
        "the static compliance of {plant} is negative ({compliance_m_per_a:.3e} m/A), so an integrator of positive gain makes the loop unstable; change the sign of the motor (its leads) or of the probe"
    )]
    NegativeCompliance {
        /// The plant.
        plant: String,
        /// The response at the lowest frequency of the grid.
        compliance_m_per_a: f64,
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
    /// An operating point for which no controller of any order fulfils the limits, by the convex programme of the bound.
    pub excluded_plant: Option<String>,
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
        match &self.excluded_plant {
            Some(plant) => write!(
                f,
                "; a convex programme finds no controller of any order for {plant} alone; relax one of the limits"
            ),
            None => f.write_str("; relax one of them, or raise --order"),
        }
    }
}

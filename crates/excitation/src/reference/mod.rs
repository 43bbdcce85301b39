//! References for the closed loop, in metres relative to the rest position at which the loop closes.
//!
//! A new reference is one file here with its settings, and one line in `references!`.

mod design;
mod file;
mod hold;
mod ramp;
mod random;
mod s_curve;
mod sine;
mod square;
mod step;
mod swept;
mod triangle;
mod wave;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use design::{ReferenceContext, ReferenceDesign, ReferenceError, StepOfReference};
pub use file::FileReference;
pub use hold::HoldReference;
pub use ramp::RampReference;
pub use random::RandomReference;
pub use s_curve::SCurveReference;
pub use sine::SineReference;
pub use square::SquareReference;
pub use step::StepReference;
pub use swept::SweptReference;
pub use triangle::TriangleReference;

/// Declares the kinds of reference: `/// documentation, Kind(Settings)`.
macro_rules! references {
    ($($(#[$doc:meta])* $kind:ident($settings:ty)),* $(,)?) => {
        /// A reference, relative to the rest position at which the loop closes; zero before its start.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum ReferenceSettings {
            $($(#[$doc])* $kind($settings),)*
        }

        impl ReferenceSettings {
            /// Whether it is the sweep of `[chirp]`, whose amplitudes are planned with the model.
            pub fn is_swept(&self) -> bool {
                matches!(self, ReferenceSettings::Chirp(_))
            }

            /// The settings of the kind.
            pub fn design(&self) -> &dyn ReferenceDesign {
                match self { $(ReferenceSettings::$kind(settings) => settings,)* }
            }
        }
    };
}

references! {
    /// Constant: the position at which the loop closed.
    Hold(HoldReference),
    /// A step.
    Step(StepReference),
    /// From 0 to a height at a constant speed, then constant.
    Ramp(RampReference),
    /// A sine that starts at zero.
    Sine(SineReference),
    /// A square wave.
    Square(SquareReference),
    /// A triangle wave that starts at zero.
    Triangle(TriangleReference),
    /// From 0 to a height with bounded speed, acceleration and jerk, then constant.
    SCurve(SCurveReference),
    /// A random signal, limited to a band and to a peak.
    Random(RandomReference),
    /// The sweep of `[chirp]` in metres, with its rest before and after: for identification in closed loop. The run
    /// lasts as long as the sweep; `control.duration_s` is not used.
    Chirp(SweptReference),
    /// A CSV file with the columns `time_s,reference_m`; straight lines between its points.
    File(FileReference),
}

#[cfg(test)]
mod tests;

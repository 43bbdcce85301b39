//! References for the closed loop, in metres relative to the rest position at which the loop closes.
//!
//! A new reference is one file here with its settings, and one line in `references!`; a reference of another crate is added by
//! [`register_reference`].

mod design;
mod file;
mod hold;
mod own;
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
pub use own::{OwnReference, register_reference};
pub use ramp::RampReference;
pub use random::RandomReference;
pub use s_curve::SCurveReference;
pub use sine::SineReference;
pub use square::SquareReference;
pub use step::StepReference;
pub use swept::SweptReference;
pub use triangle::TriangleReference;

/// Declares the kinds of reference: `/// documentation, Kind(Settings) = "kind"`.
macro_rules! references {
    ($($(#[$doc:meta])* $kind:ident($settings:ty) = $name:literal),* $(,)?) => {
        /// A reference, relative to the rest position at which the loop closes; zero before its start.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind")]
        #[schemars(transform = bench_base::kinds::list_added_kinds)]
        pub enum ReferenceSettings {
            $(
                $(#[$doc])*
                #[serde(rename = $name)]
                $kind($settings),
            )*
            /// A reference of another crate.
            #[serde(untagged)]
            Own(OwnReference),
        }

        /// The names of the kinds of this crate.
        const KINDS: &[&str] = &[$($name,)*];

        impl ReferenceSettings {
            /// The name of the kind, as in `control.reference.kind`.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(ReferenceSettings::$kind(_) => $name,)*
                    ReferenceSettings::Own(own) => own.kind(),
                }
            }

            /// Whether it is the sweep of `[chirp]`, whose amplitudes are planned with the model.
            pub fn is_swept(&self) -> bool {
                matches!(self, ReferenceSettings::Chirp(_))
            }

            /// The settings of the kind.
            pub fn design(&self) -> &dyn ReferenceDesign {
                match self {
                    $(ReferenceSettings::$kind(settings) => settings,)*
                    ReferenceSettings::Own(own) => &**own,
                }
            }
        }
    };
}

references! {
    /// Constant: the position at which the loop closed.
    Hold(HoldReference) = "hold",
    /// A step.
    Step(StepReference) = "step",
    /// From 0 to a height at a constant speed, then constant.
    Ramp(RampReference) = "ramp",
    /// A sine that starts at zero.
    Sine(SineReference) = "sine",
    /// A square wave.
    Square(SquareReference) = "square",
    /// A triangle wave that starts at zero.
    Triangle(TriangleReference) = "triangle",
    /// From 0 to a height with bounded speed, acceleration and jerk, then constant.
    SCurve(SCurveReference) = "s_curve",
    /// A random signal, limited to a band and to a peak.
    Random(RandomReference) = "random",
    /// The sweep of `[chirp]` in metres, with its rest before and after: for identification in closed loop. The run
    /// lasts as long as the sweep; `control.duration_s` is not used.
    Chirp(SweptReference) = "chirp",
    /// A CSV file with the columns `time_s,reference_m`; straight lines between its points.
    File(FileReference) = "file",
}

#[cfg(test)]
mod tests;

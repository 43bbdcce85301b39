//! A campaign: one chirp at each point of a grid of operating points and mass asymmetries (section 5.2.2, Fig 5-10), and what
//! all verdicts together say of the stage.
//!
//! ```text
//!  Grid --> Store (a folder: settings, one file a point) --> missing points --> work: threads --> one Point each --> Store
//!                                                                                                        |
//!  model with damping --> Region (where it has CNMP zeros) --> offset: the asymmetry that nobody put in <+
//!                                       \__ recommend: farthest from it, within the tolerances <__/      |
//!                                                                       picture: dots over the map <-----+
//! ```
//!
//! On devices a person stands between Store and Point: [`Load`] says what to put on, [`Attended`] asks for it and checks it
//! (`check.rs`).
//!
//! Operating points are ratios Y1o/L, asymmetries m2/m3 - 1 as intended: what the stage has beside that is the offset.

mod answer;
mod attended;
mod check;
mod grid;
mod load;
mod measured;
mod offset;
mod order;
mod picture;
mod recommend;
mod region;
mod rest;
mod store;
mod work;

pub use answer::{Answer, AnswerError, Told};
pub use attended::{Attended, Person, Question, Reply, Stage};
pub use check::{Finding, LengthCheck, ModeCheck, PutOn};
pub use grid::{Grid, Place};
pub use load::Load;
pub use measured::measured;
pub use offset::{Offset, Said, Step, contradicted, offset};
pub use order::order;
pub use picture::{PictureError, picture};
pub use recommend::{Recommendation, Tolerances, recommend};
pub use region::Region;
pub use rest::Rest;
pub use store::{Found, Point, Store};
pub use work::work;

/// Why there is no campaign.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CampaignError {
    /// A grid that cannot be measured.
    #[error("{0}")]
    Grid(
        /// What is wrong, with the remedy.
        String,
    ),
    /// A folder of other settings.
    #[error("{folder} holds a campaign of other settings; name another folder with --out, or give the same settings:\n{}", differences.join("\n"))]
    Other {
        /// The folder.
        folder: String,
        /// A line for each difference.
        differences: Vec<String>,
    },
    /// Something else where the campaign's settings should be.
    #[error(
        "{path} is not of a campaign ({why}); it is left as it is: name another folder with --out"
    )]
    NotACampaign {
        /// The file.
        path: String,
        /// What was found.
        why: String,
    },
    /// A quiet run that says nothing.
    #[error(
        "{recording} does not tell where the stage rests: {why}; `bench doctor` looks at the probe"
    )]
    Rest {
        /// The run.
        recording: String,
        /// What was missing.
        why: String,
    },
    /// A file that cannot be written or read.
    #[error("cannot {what} {path}: {why}; {remedy}")]
    File {
        /// What was tried.
        what: &'static str,
        /// The file.
        path: String,
        /// The system's words.
        why: String,
        /// What to do about it.
        remedy: &'static str,
    },
}

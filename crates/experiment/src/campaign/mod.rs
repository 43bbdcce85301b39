//! A campaign: chirps at each point of a grid of operating points and mass asymmetries (section 5.2.2, Fig 5-10), and the
//! evaluation of all verdicts together.
//!
//! ```text
//!  Grid --> Campaign: Store (a folder with one file for each point) --> missing points --> chirps --> Store
//!               |                                             (in parallel, or guided: an operator loads the stage)
//!               v
//!  Evaluation: Region (where the model with damping has CNMP zeros) --> Offset (initial asymmetry of the stage)
//!                                                                   --> Recommendation (asymmetry farthest from CNMP zeros)
//! ```
//!
//! Operating points are ratios Y1o/L. Asymmetries are m2/m3 - 1 as intended; the initial asymmetry of the stage is the offset.

mod error;
mod evaluation;
mod grid;
mod guided;
mod load;
mod measure;
mod parallel;
mod point;
mod recorded;
mod run;
mod store;
mod visit_order;

pub use error::CampaignError;
pub use evaluation::{
    CHI2_95, ComparedPoint, Evaluation, Judgement, LikelihoodStep, Offset, Recommendation, Region,
    Tolerances, disagreeing, ends, estimate_offset, recommend,
};
pub use grid::{Grid, GridPoint};
pub use guided::{GuidedCampaign, LoadedRig, Operator, Question, Reply};
pub use load::{Finding, LengthCheck, Load, LoadCheck, ModeCheck, RestPosition, StageModel};
pub use measure::Method;
pub use point::{PointResult, analyse_point};
pub use recorded::{RecordedPoint, recorded_points};
pub use run::{Campaign, CampaignOptions, RunPlan};
pub use store::{OpenedStore, Store};
pub use visit_order::visit_order;

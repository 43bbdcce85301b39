//! The evaluation of all points of a campaign together.
//!
//! The region in which the model has CNMP zeros (`region`) and the verdicts give the initial asymmetry of the stage (`offset`), and
//! that the recommended asymmetry (`recommend`); `all_points` does this for a whole campaign.

mod all_points;
mod offset;
mod recommend;
mod region;

pub use all_points::{ComparedPoint, Evaluation, ends};
pub use offset::{CHI2_95, Judgement, LikelihoodStep, Offset, disagreeing, estimate_offset};
pub use recommend::{Recommendation, Tolerances, recommend};
pub use region::Region;

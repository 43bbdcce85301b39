//! A constant reference: the rest position at which the loop closed.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError};
use crate::waveform::Reference;

/// Zero at all times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HoldReference {}

impl ReferenceDesign for HoldReference {
    fn describe(&self) -> String {
        "the position at rest".into()
    }

    fn build(&self, _: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(*self))
    }
}

impl Reference for HoldReference {
    fn at_m(&self, _tick: u64) -> f64 {
        0.0
    }
}

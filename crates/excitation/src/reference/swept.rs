//! A swept reference, for identification in closed loop.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError};
use crate::amplitude::{AmplitudeCurve, TravelPoint};
use crate::sweep::SweptSine;
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// The sweep of `[chirp]` in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweptReference {
    /// Amplitude over frequency: straight lines on logarithmic axes, constant outside. Without points it is planned
    /// from the model: the command has the amplitude of `[chirp]` where the stage moves by no more than `travel_m`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub amplitude: Vec<TravelPoint>,
    /// Largest amplitude in metres by which a planned sweep moves the stage.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub travel_m: f64,
}

impl SweptReference {
    fn check_travel(&self, soft_limit_m: f64) -> Option<Finding> {
        let amplitudes_m = self.amplitude.iter().map(|point| point.amplitude_m);
        let largest_m = amplitudes_m.fold(self.travel_m, f64::max);
        let what = format!(
            "reaches {largest_m} m, beyond the soft limit of {soft_limit_m} m (interlock.soft_limit_m); lower it"
        );
        (largest_m > soft_limit_m).then(|| Finding::new("control.reference", what))
    }

    fn check_rising(&self) -> Option<Finding> {
        let mut pairs = self.amplitude.windows(2);
        let rising = pairs.all(|pair| pair[0].frequency_hz < pair[1].frequency_hz);
        let what =
            "has frequencies that do not rise from point to point; sort the points by frequency";
        (!rising).then(|| Finding::new("control.reference.amplitude", what))
    }

    /// The sweep in metres.
    pub fn sweep(&self, context: &ReferenceContext<'_>) -> SweptSine {
        let amplitude = AmplitudeCurve::of_travel(&self.amplitude);
        SweptSine::new(context.chirp, amplitude, context.period_s)
    }
}

impl ReferenceDesign for SweptReference {
    fn describe(&self) -> String {
        "reference swept over the band of the chirp".into()
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(Swept(self.sweep(context))))
    }

    fn check(&self, soft_limit_m: f64, _rate_hz: f64) -> Vec<Finding> {
        let travel = self.check_travel(soft_limit_m);
        travel.into_iter().chain(self.check_rising()).collect()
    }

    fn can_identify(&self) -> bool {
        true
    }

    fn closed_ticks(&self, context: &ReferenceContext<'_>) -> Option<u64> {
        Some(self.sweep(context).ticks())
    }
}

struct Swept(SweptSine);

impl Reference for Swept {
    fn at_m(&self, tick: u64) -> f64 {
        self.0.at(tick)
    }
}

//! An excitation: a pulse of current to one side, and the same to the other.

use bench_excitation::{Excitation, ExcitationDesign, Length, SharedSettings};
use schemars::JsonSchema;
use serde::Deserialize;

/// The table `[own_excitation]` with `kind = "doublet"`.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Doublet {
    /// Current of the pulses in amperes.
    #[schemars(range(min = 1e-6, max = 100.0))]
    amplitude_a: f64,
    /// Length of each pulse in seconds.
    #[schemars(range(min = 1e-4, max = 1.0))]
    pulse_s: f64,
    /// Time in which the stage comes to rest after the pulses, in seconds.
    #[schemars(range(min = 0.1, max = 1000.0))]
    rest_s: f64,
}

impl Doublet {
    fn signal(&self, shared: &SharedSettings<'_>) -> Pulses {
        let first = shared.ticks(shared.chirp.quiet_before_s);
        let pulse = shared.ticks(self.pulse_s).max(1);
        Pulses {
            amplitude_a: self.amplitude_a,
            first,
            pulse,
            ticks: first + 2 * pulse + shared.ticks(self.rest_s),
        }
    }
}

impl ExcitationDesign for Doublet {
    fn describe(&self, _: &SharedSettings<'_>) -> String {
        format!(
            "doublet of {} A, pulses of {} s",
            self.amplitude_a, self.pulse_s
        )
    }

    fn length(&self, shared: &SharedSettings<'_>) -> Length {
        Length {
            ticks: self.signal(shared).ticks as f64,
            key: "own_excitation.rest_s",
            value: self.rest_s,
        }
    }

    fn build(&self, shared: &SharedSettings<'_>) -> Box<dyn Excitation> {
        Box::new(self.signal(shared))
    }

    fn amplitude_key(&self) -> &'static str {
        "own_excitation.amplitude_a"
    }

    fn has_amplitude_curve(&self) -> bool {
        false
    }
}

/// The current over time, in ticks.
struct Pulses {
    amplitude_a: f64,
    first: u64,
    pulse: u64,
    ticks: u64,
}

impl Excitation for Pulses {
    fn current_a(&self, tick: u64) -> f64 {
        let pulses = tick.checked_sub(self.first).map(|since| since / self.pulse);
        match pulses {
            Some(0) => self.amplitude_a,
            Some(1) => -self.amplitude_a,
            Some(_) | None => 0.0,
        }
    }

    fn ticks(&self) -> u64 {
        self.ticks
    }
}

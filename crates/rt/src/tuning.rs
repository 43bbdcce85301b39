//! Reference and loop gain of a run in progress. Both are factors that change along a ramp, so that nothing jumps:
//!
//! k(n) = k_to + (k_from - k_to) s(n / N), n = 1 ... N,
//!
//! with the ramp s of [`settling`](super::settling). The reference factor scales the reference relative to the rest position. The gain
//! factor scales the error that the control law receives ([`LawInput::with_gain`](bench_control::LawInput::with_gain)); an
//! integrator keeps its state.

use super::settling::ramp;

/// Largest size of a factor: more is not a change of a loop, but another loop.
const MAX_FACTOR: f64 = 10.0;

/// Factors of a run. Both are 1 until they are changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Factor of the reference, relative to the rest position.
    pub reference: f64,
    /// Factor of the loop gain.
    pub gain: f64,
}

impl Default for Factors {
    fn default() -> Factors {
        Factors {
            reference: 1.0,
            gain: 1.0,
        }
    }
}

/// A change of the factors that was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneError {
    /// The reference factor is not a number within the limits.
    #[error("the reference factor is {0}; choose a factor from -{MAX_FACTOR} to {MAX_FACTOR}")]
    Reference(f64),
    /// The gain factor is not a number within the limits.
    #[error("the gain factor is {0}; choose a factor above 0, up to {MAX_FACTOR}")]
    Gain(f64),
    /// A ramp without ticks is a step.
    #[error("the ramp has no ticks; choose at least one")]
    Ramp,
}

/// A change of the factors along a ramp. Its values are finite and within limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tune {
    to: Factors,
    ramp_ticks: u64,
}

impl Tune {
    /// A change to `to` within `ramp_ticks`.
    ///
    /// # Errors
    /// For a reference factor beyond +-10, a gain factor that is not above 0 and at most 10, values that are not numbers, and a ramp
    /// without ticks.
    pub fn new(to: Factors, ramp_ticks: u64) -> Result<Tune, TuneError> {
        if !(-MAX_FACTOR..=MAX_FACTOR).contains(&to.reference) {
            return Err(TuneError::Reference(to.reference));
        }
        if !(to.gain > 0.0 && to.gain <= MAX_FACTOR) {
            return Err(TuneError::Gain(to.gain));
        }
        match ramp_ticks {
            0 => Err(TuneError::Ramp),
            ramp_ticks => Ok(Tune { to, ramp_ticks }),
        }
    }

    /// The factors at the end of the ramp.
    pub fn factors(&self) -> Factors {
        self.to
    }

    /// Length of the ramp in ticks.
    pub fn ramp_ticks(&self) -> u64 {
        self.ramp_ticks
    }
}

/// The factors of a run, from tick to tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tuning {
    from: Factors,
    now: Factors,
    change: Option<(Tune, u64)>,
}

impl Tuning {
    /// Begins a change, from the factors of this moment.
    pub(super) fn begin(&mut self, tune: Tune) {
        self.from = self.now;
        self.change = Some((tune, 0));
    }

    /// The factors of this tick.
    pub(super) fn now(&self) -> Factors {
        self.now
    }

    /// The factors of the next tick.
    pub(super) fn next(&mut self) -> Factors {
        if let Some((tune, tick)) = &mut self.change {
            *tick += 1;
            let left = ramp(*tick, tune.ramp_ticks);
            let between = |from: f64, to: f64| {
                if left == 0.0 {
                    to
                } else {
                    to + (from - to) * left
                }
            };
            self.now = Factors {
                reference: between(self.from.reference, tune.to.reference),
                gain: between(self.from.gain, tune.to.gain),
            };
            if *tick >= tune.ramp_ticks {
                self.change = None;
            }
        }
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_of_this_moment_are_those_of_the_last_tick() {
        let to = Factors {
            reference: 2.0,
            gain: 0.5,
        };
        let mut tuning = Tuning::default();
        assert_eq!(tuning.now(), Factors::default());
        tuning.begin(Tune::new(to, 4).expect("valid factors"));
        for _ in 0..4 {
            let next = tuning.next();
            assert_eq!(tuning.now(), next);
        }
        assert_eq!(tuning.now(), to);
    }
}

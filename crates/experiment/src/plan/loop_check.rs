//! Whether a closed loop may run: its stability and its modulus margin by the model.

use std::fmt;

use super::plan_error::PlanError;
use bench_config::Config;
use bench_control::{ClosedLoop, ControllerText, Margins};
use bench_plant::{LoopPlant, ModalModel};
use bench_rig::devices;

/// A loop that is refused: too small a margin, or unstable.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MarginError {
    /// The modulus margin is below the configured limit.
    #[error(
        "refused: the modulus margin of the {controller} is {margin:.3}, below the limit of {least} (control.min_modulus_margin); {DESIGNED}, or {LOWER}; nothing was moved"
    )]
    Low {
        /// The controller.
        controller: RatedController,
        /// The modulus margin.
        margin: f64,
        /// The limit.
        least: f64,
    },
    /// An unstable loop has no margin.
    #[error(
        "refused: the loop with the {controller} is unstable, so its modulus margin is below the limit of {least} (control.min_modulus_margin); {DESIGNED}, or {LOWER}; nothing was moved"
    )]
    Unstable {
        /// The controller.
        controller: RatedController,
        /// The limit.
        least: f64,
    },
    /// An unstable loop on devices, whatever the limit of the margin is.
    #[error(
        "refused: the loop with the {controller} is unstable by the model, and such a loop is never run on devices; {DESIGNED}, or add --simulate to run it on the simulated stage; nothing was moved"
    )]
    UnstableOnDevices {
        /// The controller.
        controller: RatedController,
    },
}

const DESIGNED: &str = "choose a controller designed for this rate and delay (--controller FILE)";
const LOWER: &str = "lower control.min_modulus_margin if a smaller margin is acceptable";

/// A controller and its rate, as text: `fast controller at 5000 Hz`.
#[derive(Clone, Debug, PartialEq)]
pub struct RatedController {
    name: String,
    rate_hz: f64,
}

impl RatedController {
    fn of(config: &Config) -> RatedController {
        RatedController {
            name: config.control.controller.clone(),
            rate_hz: config.servo.rate_hz,
        }
    }
}

impl fmt::Display for RatedController {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} controller at {} Hz", self.name, self.rate_hz)
    }
}

/// The stage on which a loop is closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// The simulated stage.
    Simulated,
    /// The stage of the configured devices.
    Devices,
}

impl Stage {
    /// The stage of the configured devices.
    pub fn of(config: &Config) -> Stage {
        if devices::is_simulated(config) {
            Stage::Simulated
        } else {
            Stage::Devices
        }
    }
}

/// The loop of a configuration around the model of its plant.
pub fn closed_loop(config: &Config) -> Result<ClosedLoop, PlanError> {
    closed_loop_of(&ControllerText::find(&config.control.controller)?, config)
}

/// The loop of a controller around the model of the configured plant.
pub(crate) fn closed_loop_of(
    controller: &ControllerText,
    config: &Config,
) -> Result<ClosedLoop, PlanError> {
    let design = controller.design(config.servo.rate_hz)?;
    let modes = ModalModel::of(&bench_plant::build(&config.plant)?)?.modes;
    let plant = LoopPlant::new(config, &modes);
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    Ok(ClosedLoop::new(
        plant,
        modes,
        force_constant_n_per_a,
        design,
    )?)
}

/// Refuses a loop with less than the configured modulus margin, and an unstable loop on devices, whatever that limit is.
pub fn require_margins(
    config: &Config,
    margins: &Margins,
    stage: Stage,
) -> Result<(), MarginError> {
    let (least, margin) = (config.control.min_modulus_margin, margins.modulus_margin);
    let controller = RatedController::of(config);
    match (margins.stable, stage) {
        (true, _) if !margins.has_modulus_margin(least) => Err(MarginError::Low {
            controller,
            margin,
            least,
        }),
        (true, _) => Ok(()),
        (false, _) if least > 0.0 => Err(MarginError::Unstable { controller, least }),
        (false, Stage::Devices) => Err(MarginError::UnstableOnDevices { controller }),
        (false, Stage::Simulated) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Purpose, Source, load};
    use bench_control::LoopMargins;

    fn config(min_modulus_margin: f64) -> Config {
        load(&Source {
            config: None,
            sets: vec![format!("control.min_modulus_margin={min_modulus_margin}")],
            options: Vec::new(),
            purpose: Purpose::Control,
        })
        .unwrap()
    }

    fn margins(stable: bool, modulus_margin: f64) -> Margins {
        let margins = closed_loop(&config(0.0)).unwrap().margins();
        Margins {
            stable,
            loop_margins: LoopMargins {
                modulus_margin,
                ..margins.loop_margins
            },
            ..margins
        }
    }

    #[test]
    fn refuses_unstable_loop_on_devices_at_any_limit_and_low_margin_everywhere() {
        use Stage::{Devices, Simulated};
        // Limit, whether stable, modulus margin, allowed on the simulated stage, allowed on devices.
        let cases = [
            (0.0, true, 1e-6, true, true),
            (0.0, false, 0.9, true, false),
            (0.5, true, 0.5, true, true),
            (0.5, true, 0.499, false, false),
            (0.5, false, 0.9, false, false),
        ];
        for (limit, stable, margin, on_simulated, on_devices) in cases {
            let (config, margins) = (config(limit), margins(stable, margin));
            let is_allowed = |stage| require_margins(&config, &margins, stage).is_ok();
            assert_eq!(
                is_allowed(Simulated),
                on_simulated,
                "{limit} {stable} {margin}"
            );
            assert_eq!(is_allowed(Devices), on_devices, "{limit} {stable} {margin}");
        }
    }
}

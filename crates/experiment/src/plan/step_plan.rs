//! The plan of a minimum-time step: the plants for which it is planned, and its limits.

use super::plan_error::PlanError;
use bench_config::{Config, MinimumTimeSettings, PlantSettings, SimSettings};
use bench_control::{
    ClosedLoop, ControllerText, MinimumTime, SETTLING_BAND, StepLimits, StepPlant, StepTiming,
    minimum_time,
};
use bench_plant::LoopPlant;
use bench_rig::simulated;

/// Time in seconds after the last change of the reference over which the error is limited.
const WATCHED_S: f64 = 0.3;
/// Largest number of blocks: the programme has as many unknowns.
const MAX_BLOCKS: usize = 400;

/// A planned step.
pub(super) struct StepPlan {
    pub step: MinimumTime,
    /// Number of plants.
    pub plants: usize,
}

/// Plans the fastest step of `height_m`, above 0.
pub(super) fn planned(
    config: &Config,
    controller: &ControllerText,
    settings: &MinimumTimeSettings,
    height_m: f64,
) -> Result<StepPlan, PlanError> {
    let limits = limits(config, settings, height_m)?;
    let timing = timing(config, settings)?;
    let watched = config.servo.rate_hz * WATCHED_S;
    let ticks = timing.block_ticks * timing.blocks + watched as usize;
    let mut plants = Vec::new();
    for point in points(config, settings)? {
        for variant in variants(config, settings) {
            let closed_loop = loop_at(config, controller, &point, variant)?;
            if !closed_loop.is_stable() {
                return Err(PlanError::UnstableCommand);
            }
            plants.push(StepPlant::of(&closed_loop, ticks));
        }
    }
    Ok(StepPlan {
        step: minimum_time(&plants, &limits, timing)?,
        plants: plants.len(),
    })
}

/// The plant of the model at each planned operating point.
fn points(
    config: &Config,
    settings: &MinimumTimeSettings,
) -> Result<Vec<PlantSettings>, PlanError> {
    if settings.operating_points_m.is_empty() {
        return Ok(vec![config.plant.clone()]);
    }
    let points_m = settings.operating_points_m.iter();
    let points = points_m.map(|point_m| config.plant.at_operating_point(*point_m));
    let points: Option<Vec<PlantSettings>> = points.collect();
    points.ok_or(PlanError::NoOperatingPoint)
}

/// A plant within the tolerances of the model.
#[derive(Clone, Copy)]
struct Variant {
    /// Factor of the frequencies of the modelled modes.
    ratio: f64,
    /// Whether it has the unmodelled modes.
    is_whole: bool,
}

/// The frequencies lower, equal and higher by the tolerance, and the model alone: the step must not depend on the exact unmodelled
/// modes.
fn variants(config: &Config, settings: &MinimumTimeSettings) -> Vec<Variant> {
    let ratios = match settings.frequency_tolerance_ratio {
        0.0 => vec![1.0],
        tolerance => vec![1.0 - tolerance, 1.0, 1.0 + tolerance],
    };
    let whole = ratios.into_iter().map(|ratio| Variant {
        ratio,
        is_whole: true,
    });
    let nominal = Variant {
        ratio: 1.0,
        is_whole: false,
    };
    let nominal = (!config.sim.unmodelled.is_empty()).then_some(nominal);
    whole.chain(nominal).collect()
}

/// The closed loop around a variant of a plant.
fn loop_at(
    config: &Config,
    controller: &ControllerText,
    plant: &PlantSettings,
    variant: Variant,
) -> Result<ClosedLoop, PlanError> {
    // What is unknown to the model is unknown to the plan.
    let unmodelled = SimSettings {
        asymmetry_offset: 0.0,
        frequency_ratio: 1.0,
        ..config.sim.clone()
    };
    let count = unmodelled.unmodelled.len();
    let mut modes = simulated::modes(plant, &unmodelled)?;
    let modelled = modes.len() - count;
    for mode in &mut modes[..modelled] {
        mode.omega_rad_s *= variant.ratio;
    }
    if !variant.is_whole {
        modes.truncate(modelled);
    }
    let design = controller.design(config.servo.rate_hz)?;
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    let loop_plant = LoopPlant::new(config, &modes);
    Ok(ClosedLoop::new(
        loop_plant,
        modes,
        force_constant_n_per_a,
        design,
    )?)
}

fn limits(
    config: &Config,
    settings: &MinimumTimeSettings,
    height_m: f64,
) -> Result<StepLimits, PlanError> {
    let band_m = SETTLING_BAND * height_m;
    let error_m = band_m - settings.margin_m;
    if error_m <= 0.0 {
        return Err(PlanError::NoBand {
            band_m,
            margin_m: settings.margin_m,
        });
    }
    let limits = config.excitation_limits();
    let current_a = limits.amplifier_current_a.min(limits.peak_current_a);
    let overshoot_m = settings.max_overshoot_ratio.map(|ratio| {
        // At least half of a permitted overshoot is planned, however small it is.
        (ratio * height_m - settings.margin_m).max(0.5 * ratio * height_m)
    });
    Ok(StepLimits {
        height_m,
        error_m,
        current_a: settings.current_ratio * current_a,
        change_a: settings.current_ratio * limits.slew_a_per_s * limits.period_s,
        travel_m: limits.travel_m,
        overshoot_m,
    })
}

fn timing(config: &Config, settings: &MinimumTimeSettings) -> Result<StepTiming, PlanError> {
    let rate_hz = config.servo.rate_hz;
    let block_ticks = (libm::round(settings.block_s * rate_hz) as usize).max(1);
    let longest = libm::ceil(settings.longest_s * rate_hz) as usize;
    let blocks = longest.div_ceil(block_ticks).max(1);
    if blocks > MAX_BLOCKS {
        Err(PlanError::ManyBlocks { blocks })
    } else {
        Ok(StepTiming {
            block_ticks,
            blocks,
        })
    }
}

//! The model of a rig for a design, from the settings.

use super::Config;
use bench_control::tuning::RigModel;
use bench_plant::SignalPath;

impl From<&Config> for RigModel {
    fn from(config: &Config) -> RigModel {
        RigModel {
            path: SignalPath::from(config),
            unmodelled: config.sim.unmodelled.clone(),
            floor: config.sim.floor.clone(),
            probe_noise_rms_m: config.sim.probe_noise_rms_m,
            probe_step_m: config.sim.probe_quantisation_m,
        }
    }
}

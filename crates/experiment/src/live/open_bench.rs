//! An open rig with its loop, which is kept open for the next run.

use bench_hal::blocking;
use bench_hal::serial::StatisticsHandle;

use super::live_rig::LiveRig;
use super::run_hooks::RunHooks;
use crate::errors::ExperimentError;
use crate::plan::Stage;
use bench_config::Config;
use bench_rig::devices::{self, OpenRig, Reservation};
use bench_rt::device_defect::DeviceDefect;
use bench_rt::thread::{Pace, Scheduling};

/// Which rig is opened, and how.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    /// The simulated stage, or the configured devices.
    pub stage: Stage,
    /// Pace of the loop.
    pub pace: Pace,
    /// Whether a stored fault of the amplifier is cleared first.
    pub clear_fault: bool,
}

/// Identities of the devices.
#[derive(Clone, Debug)]
pub struct DeviceNames {
    /// The amplifier, as it reports itself.
    pub amplifier: String,
    /// The probe, as far as it is known.
    pub probe: String,
}

/// A rig with its loop. Dropping it closes the rig.
pub struct OpenBench {
    pub(crate) rig: LiveRig,
    pub(crate) names: DeviceNames,
    serial: Option<StatisticsHandle>,
    config: Config,
    opening: Opening,
    /// Dropped after the rig.
    _reservation: Option<Reservation>,
}

impl OpenBench {
    /// Opens the rig of a configuration, disarmed.
    ///
    /// # Errors
    /// When a device cannot be opened, or the system refuses the thread of the loop.
    pub fn open(
        config: &Config,
        opening: Opening,
        hooks: RunHooks,
    ) -> Result<OpenBench, ExperimentError> {
        let mut opened = match opening.stage {
            Stage::Simulated => devices::simulate(config)?,
            Stage::Devices => devices::open(config)?,
        };
        for note in &opened.notes {
            tracing::warn!("{note}");
        }
        if opening.clear_fault {
            blocking::reset_fault(&mut opened.rig, std::thread::sleep).map_err(|error| {
                ExperimentError::Failed(format!("amplifier: {error}; nothing was moved"))
            })?;
        }
        OpenBench::with_loop(opened, config, opening, hooks)
    }

    /// The simulated stage in place of the devices of a configuration, for tests of what happens on devices.
    #[cfg(test)]
    pub(crate) fn emulated(config: &Config, opening: Opening) -> OpenBench {
        let opened = devices::simulate(config).expect("a simulated stage");
        OpenBench::with_loop(opened, config, opening, RunHooks::default()).expect("a thread")
    }

    /// Starts the loop of opened devices.
    fn with_loop(
        opened: OpenRig,
        config: &Config,
        opening: Opening,
        hooks: RunHooks,
    ) -> Result<OpenBench, ExperimentError> {
        Ok(OpenBench {
            rig: LiveRig::with_hooks(opened.rig, config, opening.pace, hooks)?,
            names: DeviceNames {
                amplifier: opened.amplifier,
                probe: opened.probe,
            },
            serial: opened.watch,
            config: config.clone(),
            opening,
            _reservation: opened.reservation,
        })
    }

    /// Whether it is the rig of `config`, opened in the same way. Excitation, controller, calibration and analysis do not belong to
    /// the rig, and the model of the plant belongs to a simulated one only.
    pub(crate) fn is_of(&self, config: &Config, opening: &Opening) -> bool {
        let open = &self.config;
        let is_simulated = opening.stage == Stage::Simulated;
        opening.stage == self.opening.stage
            && opening.pace == self.opening.pace
            && !opening.clear_fault
            && open.servo == config.servo
            && (!is_simulated || open.plant == config.plant)
            && open.motor == config.motor
            && open.amplifier == config.amplifier
            && open.probe == config.probe
            && open.interlock == config.interlock
            && open.sim == config.sim
    }

    /// The device that cannot be used, as of the last tick between two runs.
    pub fn defect(&self) -> Option<DeviceDefect> {
        self.rig.defect()
    }

    /// Identities of the devices.
    pub fn names(&self) -> &DeviceNames {
        &self.names
    }

    /// Counts of the serial port of the probe; `None` on a simulated stage.
    pub fn serial(&self) -> Option<&StatisticsHandle> {
        self.serial.as_ref()
    }

    /// How the loop is scheduled.
    pub fn scheduling(&self) -> &Scheduling {
        self.rig.scheduling()
    }
}

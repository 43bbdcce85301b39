//! The one thread that holds the rig. It runs one plan at a time. Between two commands the loop goes on, disarmed.

use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use bench_hal::serial::StatisticsHandle;
use tokio::sync::{mpsc, oneshot};

use super::same_rig::require_same_rig;
use super::warnings::copy_warnings;
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::{
    Description, DeviceNames, ExperimentError, FeedSender, MotorHandling, OpenBench, Opening,
    PlannedRun, RecordingDefect, Run, RunHooks, Runner, Setup, Stage, StopCause, TripCount,
};
use bench_rig::motor::Moment;
use bench_rt::supervision::{ArmLease, StopFlags};
use bench_rt::thread::{Pace, Scheduling};

/// Pause between two attempts to open the devices, and between two checks of open devices without a command.
const RETRY: Duration = Duration::from_secs(2);
/// Devices with a defect are opened again after this number of checks.
const REOPENED_AT: u32 = 2;
/// Checks until they are opened once more, if the defect remains, for example a stored fault of the amplifier.
const REOPENED_EVERY: u32 = 15;

/// A plan for the owner.
pub struct OwnerOrder {
    /// The command to which it belongs. The rig stays the same for all plans of a command.
    pub command: u64,
    /// The plan.
    pub order: PlannedRun,
    /// Ends the run.
    pub stop: StopFlags,
    /// The arm lease of the run, if its client renews it.
    pub lease: Option<Arc<ArmLease>>,
    /// Receives the progress.
    pub progress: Progress,
    /// Receives warnings for the operator.
    pub warnings: mpsc::UnboundedSender<String>,
    /// Receives the run.
    pub reply: oneshot::Sender<Result<Run, ExperimentError>>,
}

enum Message {
    Run(Box<OwnerOrder>),
    EndCommand(u64),
}

/// The rig, for display.
#[derive(Clone, Debug)]
pub struct RigStatus {
    /// Names of the devices; `None` while they are not open.
    pub names: Option<DeviceNames>,
    /// How the loop is scheduled.
    pub scheduling: Scheduling,
    /// Pace of the loop.
    pub pace: Pace,
    /// Counts of the serial port of the probe; `None` on a simulated stage.
    pub serial: Option<StatisticsHandle>,
    /// Why the rig is not open, or cannot be used.
    pub fault: Option<String>,
    /// Whether the devices are being opened, which takes up to some seconds.
    pub is_opening: bool,
}

/// The thread of the owner. Dropping it waits until the rig is closed.
pub struct Owner {
    messages: Option<Sender<Message>>,
    status: Arc<Mutex<RigStatus>>,
    tuner: Sender<bench_rt::tuning::Tune>,
    recording_defect: RecordingDefect,
    trips: TripCount,
    thread: Option<JoinHandle<()>>,
}

impl Owner {
    /// Opens the rig of `config` on its own thread.
    ///
    /// # Errors
    /// When the system refuses the thread.
    pub fn start(config: Config, feeds: FeedSender) -> std::io::Result<Owner> {
        let (messages, received) = channel();
        let hooks = RunHooks::watched(feeds);
        let tuner = hooks.tuner();
        let recording_defect = hooks.recording_defect.clone();
        let trips = hooks.trips.clone();
        let status = Arc::new(Mutex::new(RigStatus {
            names: None,
            scheduling: Scheduling::default(),
            pace: Pace::Realtime,
            serial: None,
            fault: None,
            is_opening: true,
        }));
        let mut thread = OwnerThread {
            config,
            hooks,
            idle: None,
            defects: 0,
            command: None,
            status: Arc::clone(&status),
        };
        let builder = std::thread::Builder::new().name("bench-owner".into());
        let thread = builder.spawn(move || thread.serve(&received))?;
        Ok(Owner {
            messages: Some(messages),
            status,
            tuner,
            recording_defect,
            trips,
            thread: Some(thread),
        })
    }

    /// The rig, for display.
    pub fn status(&self) -> RigStatus {
        lock(&self.status).clone()
    }

    /// Sends changes of the run in progress to the loop.
    pub fn tuner(&self) -> Sender<bench_rt::tuning::Tune> {
        self.tuner.clone()
    }

    /// Why the run in progress, or the last one, cannot be recorded.
    pub fn recording_defect(&self) -> Option<StopCause> {
        self.recording_defect.get()
    }

    /// Orders a run. The order is dropped, and with it the reply, if the thread has ended.
    pub fn run(&self, order: OwnerOrder) {
        self.send(Message::Run(Box::new(order)));
    }

    /// The turn of a command has ended: the rig goes back to its own configuration.
    pub fn end_command(&self, command: u64) {
        self.send(Message::EndCommand(command));
    }

    /// Number of runs that an interlock ended, and the reason of the last one.
    pub fn trips(&self) -> (u64, &'static str) {
        self.trips.get()
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            let _ = messages.send(message); // without the thread there is no run
        }
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic has been printed
        }
    }
}

fn lock(status: &Mutex<RigStatus>) -> MutexGuard<'_, RigStatus> {
    status.lock().unwrap_or_else(PoisonError::into_inner)
}

struct OwnerThread {
    config: Config,
    hooks: RunHooks,
    /// The rig between two commands.
    idle: Option<OpenBench>,
    /// Checks in a row in which a device of the rig was not usable.
    defects: u32,
    /// The command that has its turn.
    command: Option<(u64, Runner)>,
    status: Arc<Mutex<RigStatus>>,
}

impl OwnerThread {
    fn serve(&mut self, messages: &Receiver<Message>) {
        self.open_idle();
        loop {
            match messages.recv_timeout(RETRY) {
                Ok(Message::Run(order)) => self.run(*order),
                Ok(Message::EndCommand(command)) => self.end_command(command),
                Err(RecvTimeoutError::Timeout) => self.check_idle(),
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn opening(&self) -> Opening {
        Opening {
            stage: Stage::of(&self.config),
            pace: Pace::Realtime,
            clear_fault: false,
        }
    }

    /// Checks the rig between two commands. A rig with a device that lost its cable or its supply is opened again.
    fn check_idle(&mut self) {
        let Some(bench) = &self.idle else {
            return self.open_idle();
        };
        let Some(defect) = bench.defect().filter(|_| !self.is_simulated()) else {
            self.defects = 0;
            lock(&self.status).fault = None;
            return;
        };
        if self.defects == 0 {
            tracing::warn!("between two runs: {defect}");
        }
        self.defects = self.defects.saturating_add(1);
        lock(&self.status).fault = Some(defect.to_string());
        if self.defects % REOPENED_EVERY == REOPENED_AT {
            self.idle = None;
            self.open_idle();
        }
    }

    /// Opens the rig between two commands, if it is not open.
    fn open_idle(&mut self) {
        if self.idle.is_some() || self.command.is_some() {
            return;
        }
        lock(&self.status).is_opening = true;
        let opened = OpenBench::open(&self.config, self.opening(), self.hooks.clone());
        let mut status = lock(&self.status);
        status.is_opening = false;
        match opened {
            Ok(bench) => {
                status.names = Some(bench.names().clone());
                status.pace = Pace::Realtime;
                status.scheduling = bench.scheduling().clone();
                status.serial = bench.serial().cloned();
                status.fault = None;
                self.idle = Some(bench);
            }
            Err(error) => {
                let fault = error.to_string();
                if status.fault.as_ref() != Some(&fault) {
                    tracing::warn!("the rig is not open: {fault}");
                }
                (status.names, status.fault) = (None, Some(fault));
            }
        }
    }

    fn run(&mut self, order: OwnerOrder) {
        let _copy = copy_warnings(order.warnings.clone());
        let result = self.planned_run(&order);
        // Without a receiver the client is disconnected, and the recording is completed when it is dropped.
        let _ = order.reply.send(result);
    }

    fn planned_run(&mut self, order: &OwnerOrder) -> Result<Run, ExperimentError> {
        let plan = order.order.plan()?;
        require_same_rig(&self.config, &plan.config)?;
        let calibration = order.order.calibration()?;
        let mut runner = self.runner(order);
        lock(&self.status).pace = order.order.conditions.pace;
        runner.set_hooks(
            self.hooks
                .with_stop(order.stop.clone(), order.lease.clone()),
        );
        runner.progress = order.progress.clone();
        let folder = &order.order.conditions.folder;
        runner.setup.conditions.folder.clone_from(folder);
        let result = runner.run_calibrated(&plan, plan.kind.name(), calibration);
        self.command = Some((order.command, runner));
        result
    }

    /// The runner of a command, which keeps its rig and the heat of a simulated motor between its runs.
    fn runner(&mut self, order: &OwnerOrder) -> Runner {
        match self.command.take() {
            Some((command, runner)) if command == order.command => runner,
            other => {
                drop(other);
                // A simulated stage begins each command at rest, as it does without a daemon.
                let idle = self.idle.take().filter(|_| !self.is_simulated());
                Runner::on_bench(self.setup(order), idle, self.hooks.clone())
            }
        }
    }

    fn setup(&self, order: &OwnerOrder) -> Setup {
        let mut conditions = order.order.conditions.clone();
        if self.is_simulated() {
            conditions.motor = MotorHandling::Simulated;
        }
        Setup {
            conditions,
            simulate: false,
            now: Moment::now,
            description: Description::default(),
            owner: None,
        }
    }

    fn is_simulated(&self) -> bool {
        Stage::of(&self.config) == Stage::Simulated
    }

    /// Another command may have begun to use the rig.
    fn end_command(&mut self, ended: u64) {
        self.defects = 0;
        let runner = self.command.take_if(|(command, _)| *command == ended);
        if let Some((_, runner)) = runner {
            let bench = runner.into_bench();
            self.idle = bench.filter(|_| !self.is_simulated());
        }
        self.open_idle();
    }
}

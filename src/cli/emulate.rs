//! `bench emulate`: emulated devices, for a rehearsal without hardware.

use std::fs::File;
use std::io::{BufRead, Read, Write};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use tokio::runtime::Runtime;

use super::error::CliError;
use super::exit::Exit;
use super::output::{print_json, print_message, print_note};
use bench_base::quantity::{Dimension, OfFrequency, OfTime, si};
use bench_config::{Config, OptionSetting, Purpose};
use bench_experiment::StopSignals;
use bench_order::{BenchOptions, SeedOption};
use bench_rig::emulator::{
    EmulatedDevice, EmulatedDevices, Emulator, EmulatorError, FaultRequest, FaultSchedule,
    LogEntry, PlannedFault, ProbeEndpoint, fault,
};

/// Period at which commands and planned faults are handled.
const PERIOD: Duration = Duration::from_millis(2);
/// Largest number of commands that are handled at once.
const COMMANDS_PER_STEP: usize = 16;
/// A longer line of standard input is read as several.
const MAX_LINE_BYTES: u64 = 4096;
/// Measuring rates of a probe.
const MEASURING_RATE_HZ: RangeInclusive<f64> = 0.1..=1e6;

/// Which devices are emulated, and where
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = format!("Faults, for --fault KIND@TIME and on standard input:\n{}", fault::help()))]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    seed: SeedOption,
    /// Devices to emulate: amplifier, probe, or both (on the same simulated stage)
    #[arg(required = true, value_name = "amplifier|probe")]
    devices: Vec<EmulatedDevice>,
    /// CAN interface instead of the configured one
    #[arg(long, value_name = "NAME")]
    interface: Option<String>,
    /// Serial port on which the probe is emulated, connected by a null-modem cable [default: a new pseudo terminal; its
    /// path is printed]
    #[arg(long, value_name = "PATH", conflicts_with = "pty")]
    port: Option<PathBuf>,
    /// Emulate the probe on a new pseudo terminal and create the symbolic link LINK to it
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Measuring rate of the probe [default: as configured]
    #[arg(long, value_name = "FREQUENCY", value_parser = si::<OfFrequency>)]
    measuring_rate: Option<f64>,
    /// Inject a fault at a time (KIND@2s) or for an interval (KIND@500ms..2s), repeatable; the kinds are listed below
    #[arg(long = "fault", value_name = "KIND@TIME")]
    faults: Vec<PlannedFault>,
    /// Origin of the times of --fault: the first enable of the amplifier, or the start
    /// [default: enable; start if no amplifier is emulated]
    #[arg(long, value_name = "enable|start")]
    faults_from: Option<Origin>,
    /// Write every change to a file as well, one JSON object per line
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// End after this time [default: on Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = si::<OfTime>)]
    duration: Option<f64>,
}

/// Origin of the times of planned faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Origin {
    /// The first enable of the amplifier
    Enable,
    /// The start of the emulator
    Start,
}

impl Args {
    fn emulates(&self, device: EmulatedDevice) -> bool {
        self.devices.contains(&device)
    }

    fn emulated_devices(&self) -> EmulatedDevices {
        let endpoint = match &self.port {
            Some(port) => ProbeEndpoint::Port(port.clone()),
            None => ProbeEndpoint::Terminal(self.pty.clone()),
        };
        EmulatedDevices {
            amplifier: self.emulates(EmulatedDevice::Amplifier),
            probe: self.emulates(EmulatedDevice::Probe).then_some(endpoint),
            measuring_rate_hz: self.measuring_rate,
        }
    }

    /// The settings that the options replace.
    fn settings(&self) -> Vec<OptionSetting> {
        let interface = self.interface.as_ref().map(|name| {
            let option = format!("--interface {name}");
            OptionSetting::new("amplifier.device.interface", name.as_str(), option)
        });
        interface.into_iter().chain(self.seed.setting()).collect()
    }

    /// Refuses options of a device that is not emulated, and invalid values.
    fn check(&self) -> Result<(), CliError> {
        let has_probe_options =
            self.port.is_some() || self.pty.is_some() || self.measuring_rate.is_some();
        if has_probe_options && !self.emulates(EmulatedDevice::Probe) {
            let what = "--port, --pty and --measuring-rate are valid only for the device `probe`; add `probe`, or leave them out";
            return Err(CliError::Usage(what.into()));
        }
        if self.interface.is_some() && !self.emulates(EmulatedDevice::Amplifier) {
            let what = "--interface is valid only for the device `amplifier`; add `amplifier`, or leave it out";
            return Err(CliError::Usage(what.into()));
        }
        require_measuring_rate(self.measuring_rate)?;
        require_positive("--duration", self.duration)
    }

    fn origin(&self) -> Origin {
        match self.faults_from {
            Some(origin) => origin,
            None if self.emulates(EmulatedDevice::Amplifier) => Origin::Enable,
            None => Origin::Start,
        }
    }
}

/// Refuses rates that `probe.rate_hz` does not allow either.
fn require_measuring_rate(rate_hz: Option<f64>) -> Result<(), CliError> {
    match rate_hz {
        Some(rate_hz) if !MEASURING_RATE_HZ.contains(&rate_hz) => {
            let rate = Dimension::Frequency.display(rate_hz);
            let (min, max) = (MEASURING_RATE_HZ.start(), MEASURING_RATE_HZ.end());
            Err(CliError::Usage(format!(
                "--measuring-rate is {rate}; give a rate from {min} to {max} Hz"
            )))
        }
        _ => Ok(()),
    }
}

fn require_positive(option: &str, value: Option<f64>) -> Result<(), CliError> {
    if value.is_none_or(|value| value > 0.0) {
        Ok(())
    } else {
        Err(CliError::Usage(format!(
            "{option} is not above 0; give a value above 0"
        )))
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    args.check()?;
    let config = args.bench.load(Purpose::Model, &args.settings())?;
    let log = args.log.as_deref().map(LogFile::create).transpose()?;
    let signals = watch_signals();
    let (runtime, signals) = signals.map_err(|e| {
        CliError::Failed(format!(
            "cannot install the handlers of SIGINT and SIGTERM: {e}; start the command again"
        ))
    })?;
    let mut server = Server::start(args, &config, log)?;
    runtime.block_on(server.serve(signals))?;
    if args.bench.json {
        print_json(&server.emulator.summary())?;
    }
    Ok(Exit::Done)
}

struct Server<'a> {
    emulator: Emulator,
    schedule: FaultSchedule,
    log: Option<LogFile>,
    input: Receiver<String>,
    args: &'a Args,
    is_over: bool,
}

impl<'a> Server<'a> {
    /// Starts the devices. Refuses a planned fault that no emulated device can have.
    fn start(args: &'a Args, config: &Config, log: Option<LogFile>) -> Result<Self, CliError> {
        let emulator = Emulator::start(config, &args.emulated_devices())?;
        let schedule = FaultSchedule::new(&args.faults);
        for step in schedule.steps() {
            emulator.check(step)?;
        }
        Ok(Server {
            emulator,
            schedule,
            log,
            input: read_lines(),
            args,
            is_over: false,
        })
    }

    /// Serves until a signal, `quit`, or the end of the duration.
    async fn serve(&mut self, mut signals: StopSignals) -> Result<(), CliError> {
        let mut period = tokio::time::interval(PERIOD);
        while !self.is_over {
            tokio::select! {
                _ = period.tick() => self.step()?,
                () = signals.received() => self.is_over = true,
            }
        }
        self.report()
    }

    fn step(&mut self) -> Result<(), CliError> {
        let time_s = self.emulator.time_s();
        let origin_s = match self.args.origin() {
            Origin::Start => Some(0.0),
            Origin::Enable => self.emulator.enabled_s(),
        };
        if let Some(origin_s) = origin_s {
            for step in self.schedule.take_due(time_s - origin_s) {
                self.emulator.inject(&step)?;
            }
        }
        let lines: Vec<String> = self.input.try_iter().take(COMMANDS_PER_STEP).collect();
        for line in lines {
            self.execute(line.trim());
        }
        let duration_s = self.args.duration.unwrap_or(f64::INFINITY);
        self.is_over |= time_s >= duration_s;
        self.report()
    }

    /// Executes a command of the operator. An error is reported, and the emulator continues.
    fn execute(&mut self, line: &str) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            [] => {}
            ["quit"] => self.is_over = true,
            ["help"] => {
                let kinds = fault::help();
                print_message(&format!("fault KIND, quit, help; the kinds are\n{kinds}"));
            }
            ["fault", fault] => {
                if let Err(why) = self.inject(fault) {
                    print_note(&why);
                }
            }
            _ => print_note(&format!(
                "`{line}` is not a command; use fault KIND, quit or help"
            )),
        }
    }

    fn inject(&mut self, fault: &str) -> Result<(), String> {
        let request = FaultRequest::parse_for(fault, &self.args.devices);
        let request = request.map_err(|error| error.to_string())?;
        let injected = self.emulator.inject(&request);
        injected.map_err(|error| error.to_string())
    }

    /// Prints new log entries, and writes them to the file.
    fn report(&mut self) -> Result<(), CliError> {
        for entry in self.emulator.new_entries() {
            print_message(&format!("{entry}\n"));
            if let Some(log) = &mut self.log {
                log.write(&entry)?;
            }
        }
        Ok(())
    }
}

/// Receives the signals that end a run from now on, so that everything that is served is removed in order.
fn watch_signals() -> std::io::Result<(Runtime, StopSignals)> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let signals = {
        let _context = runtime.enter();
        StopSignals::listen()?
    };
    Ok((runtime, signals))
}

/// Lines of standard input, read by a thread that ends with the program. The end of the input is not a command. Bytes that
/// are not UTF-8 make one unknown command.
fn read_lines() -> Receiver<String> {
    let (sender, receiver) = sync_channel(COMMANDS_PER_STEP);
    std::thread::spawn(move || {
        while let Some(line) = read_line() {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

/// The next line of standard input, or the first part of a very long one; `None` at its end.
fn read_line() -> Option<String> {
    let mut line = Vec::new();
    let mut input = std::io::stdin().lock().take(MAX_LINE_BYTES);
    let bytes = input.read_until(b'\n', &mut line).ok()?;
    (bytes > 0).then(|| String::from_utf8_lossy(&line).into_owned())
}

/// A file with one JSON object per line, each written at once.
struct LogFile {
    file: File,
    path: PathBuf,
}

impl LogFile {
    fn create(path: &Path) -> Result<LogFile, CliError> {
        let file = File::create(path).map_err(|e| {
            let path = path.display();
            CliError::Usage(format!(
                "cannot write {path}: {e}; choose another file with --log"
            ))
        })?;
        let path = path.to_owned();
        Ok(LogFile { file, path })
    }

    fn write(&mut self, entry: &LogEntry) -> Result<(), CliError> {
        self.append(entry).map_err(|e| {
            let path = self.path.display();
            CliError::Failed(format!(
                "cannot write {path}: {e}; free some space, or choose another file with --log"
            ))
        })
    }

    fn append(&mut self, entry: &LogEntry) -> std::io::Result<()> {
        let line = serde_json::to_string(entry)? + "\n";
        self.file.write_all(line.as_bytes())
    }
}

impl From<EmulatorError> for CliError {
    fn from(error: EmulatorError) -> Self {
        match error {
            EmulatorError::Bus(_) | EmulatorError::Thread { .. } => {
                CliError::Failed(error.to_string())
            }
            _ => CliError::Usage(error.to_string()),
        }
    }
}

//! `bench device`: the other end of the bench, for a rehearsal without hardware.

use std::fs::File;
use std::io::{BufRead, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::print_json;
use crate::config::{OptionSetting, Purpose};
use crate::rig::emulator::probe::ProbeEndpoint;
use crate::rig::emulator::rehearsal::EmulatedDevices;
use crate::rig::emulator::schedule::PlannedFault;
use crate::rig::emulator::{
    EmulatedFault, Emulator, EmulatorError, FaultSchedule, LogEntry, fault,
};
use crate::util::quantity::{OfFrequency, OfTime, si};

/// How often orders, signals and faults are looked for.
const BEAT: Duration = Duration::from_millis(2);

/// Which devices act, and where.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = format!("Faults, for --fault KIND@SECONDS and on standard input:\n{}", fault::help()))]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// The devices that act: amplifier, probe, or both with one stage
    #[arg(required = true, value_name = "amplifier|probe", value_parser = ["amplifier", "probe"])]
    devices: Vec<String>,
    /// CAN interface instead of the configured one
    #[arg(long, value_name = "NAME")]
    interface: Option<String>,
    /// Serial port of the probe: the other end of a null-modem cable [default: a pseudo terminal, whose path is printed]
    #[arg(long, value_name = "PATH", conflicts_with = "pty")]
    port: Option<PathBuf>,
    /// Make a pseudo terminal for the probe, with a link of this name for the reader
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,
    /// Measurements of the probe a second [default: as configured]
    #[arg(long, value_name = "FREQUENCY", value_parser = si::<OfFrequency>)]
    measuring_rate: Option<f64>,
    /// A fault at a time (KIND@SECONDS) or for a while (KIND@FROM..TO), repeatable; the kinds are listed below
    #[arg(long = "fault", value_name = "KIND@SECONDS")]
    faults: Vec<PlannedFault>,
    /// What the times of --fault count from: the first enable of the amplifier, or the start
    /// [default: enable; start if there is no amplifier]
    #[arg(long, value_name = "enable|start", value_parser = ["enable", "start"])]
    faults_from: Option<String>,
    /// Write every change to a file as well, a JSON object a line
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// End after this time [default: on Ctrl-C]
    #[arg(long, value_name = "TIME", value_parser = si::<OfTime>)]
    duration: Option<f64>,
}

impl Args {
    fn serves(&self, device: &str) -> bool {
        self.devices.iter().any(|served| served == device)
    }

    fn cast(&self) -> EmulatedDevices {
        let end = self.port.clone().map_or_else(
            || ProbeEndpoint::Terminal(self.pty.clone()),
            ProbeEndpoint::Port,
        );
        EmulatedDevices {
            amplifier: self.serves("amplifier"),
            probe: self.serves("probe").then_some(end),
            measuring_rate_hz: self.measuring_rate,
        }
    }

    /// The settings that the options stand for.
    fn settings(&self) -> Vec<OptionSetting> {
        let set = |name: &String| {
            let option = format!("--interface {name}");
            OptionSetting::new("amplifier.device.interface", name.as_str(), option)
        };
        self.interface.iter().map(set).collect()
    }

    /// Options that the devices have no use for, and values that cannot be.
    fn check(&self) -> Result<(), CliError> {
        let of_probe = self.port.is_some() || self.pty.is_some() || self.measuring_rate.is_some();
        let positive = |value: Option<f64>| value.is_none_or(|value| value > 0.0);
        let wrong = [
            (
                of_probe && !self.serves("probe"),
                "--port, --pty and --measuring-rate go with the device `probe` only",
            ),
            (
                self.interface.is_some() && !self.serves("amplifier"),
                "--interface goes with the device `amplifier` only",
            ),
            (
                !positive(self.measuring_rate),
                "--measuring-rate must be above zero",
            ),
            (!positive(self.duration), "--duration must be above zero"),
        ];
        wrong
            .iter()
            .find(|(wrong, _)| *wrong)
            .map_or(Ok(()), |(_, why)| Err(CliError::Usage((*why).into())))
    }

    fn counts_from_start(&self) -> bool {
        self.faults_from
            .as_ref()
            .map_or(!self.serves("amplifier"), |from| from == "start")
    }
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    args.check()?;
    let config = args.bench.load(Purpose::Model, &args.settings())?;
    let log = args.log.as_ref().map(Log::create).transpose()?;
    let (runtime, signals) =
        signals().map_err(|e| CliError::Failed(format!("cannot watch for signals: {e}")))?;
    let rehearsal = Emulator::start(&config, &args.cast())?;
    let schedule = FaultSchedule::new(&args.faults);
    schedule
        .steps()
        .try_for_each(|(word, fault)| rehearsal.check(word, *fault))?;
    let mut session = Session {
        rehearsal,
        schedule,
        log,
        typed: listen(),
        args,
        is_over: false,
    };
    runtime.block_on(session.serve(signals))?;
    if args.bench.json {
        print_json(&session.rehearsal.summary())?;
    }
    Ok(Outcome::Done)
}

struct Session<'a> {
    rehearsal: Emulator,
    schedule: FaultSchedule,
    log: Option<Log>,
    typed: Receiver<String>,
    args: &'a Args,
    is_over: bool,
}

impl Session<'_> {
    /// Serves until a signal, `quit`, or the end of the time.
    async fn serve(&mut self, [mut interrupt, mut terminate]: [Signal; 2]) -> Result<(), CliError> {
        let mut beat = tokio::time::interval(BEAT);
        while !self.is_over {
            tokio::select! {
                _ = beat.tick() => self.look()?,
                _ = interrupt.recv() => self.is_over = true,
                _ = terminate.recv() => self.is_over = true,
            }
        }
        self.tell()
    }

    fn look(&mut self) -> Result<(), CliError> {
        let time_s = self.rehearsal.time_s();
        let origin_s = if self.args.counts_from_start() {
            Some(0.0)
        } else {
            self.rehearsal.enabled_s()
        };
        for (word, fault) in
            origin_s.map_or(Vec::new(), |origin_s| self.schedule.due(time_s - origin_s))
        {
            self.rehearsal.ask(&word, fault)?;
        }
        while let Ok(line) = self.typed.try_recv() {
            self.obey(line.trim());
        }
        self.is_over |= self
            .args
            .duration
            .is_some_and(|duration_s| time_s >= duration_s);
        self.tell()
    }

    /// An order of the person at the keyboard; what is wrong with it is said, and all goes on.
    fn obey(&mut self, line: &str) {
        match line.split_whitespace().collect::<Vec<_>>()[..] {
            [] => {}
            ["quit"] => self.is_over = true,
            ["help"] => eprint!("fault KIND, quit, help; the kinds are\n{}", fault::help()),
            ["fault", word] => {
                let word = fault::whole(word, &self.args.devices);
                let fault = EmulatedFault::parse(&word).map_err(|e| e.to_string());
                let asked = fault
                    .and_then(|fault| self.rehearsal.ask(&word, fault).map_err(|e| e.to_string()));
                asked.unwrap_or_else(|why| eprintln!("bench device: {why}"));
            }
            _ => eprintln!("bench device: `{line}` is no order; there are fault KIND, quit, help"),
        }
    }

    /// Tells what has changed, to people and to the log.
    fn tell(&mut self) -> Result<(), CliError> {
        for entry in self.rehearsal.news() {
            eprintln!("{entry}");
            self.log.as_mut().map_or(Ok(()), |log| log.write(&entry))?;
        }
        Ok(())
    }
}

/// From here on Ctrl-C and SIGTERM end a rehearsal in order: before anything is served that must be taken away again.
fn signals() -> std::io::Result<(Runtime, [Signal; 2])> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let watched = {
        let _inside = runtime.enter();
        [
            signal(SignalKind::interrupt())?,
            signal(SignalKind::terminate())?,
        ]
    };
    Ok((runtime, watched))
}

/// Lines of standard input, read by a thread that ends with the program; its end is no order.
fn listen() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let lines = std::io::stdin().lock().lines().map_while(Result::ok);
        lines.into_iter().all(|line| sender.send(line).is_ok())
    });
    receiver
}

/// A file with a JSON object a line, each of which is there when it is written.
struct Log {
    file: File,
    path: PathBuf,
}

impl Log {
    fn create(path: &PathBuf) -> Result<Log, CliError> {
        let failed = |e| {
            CliError::Usage(format!(
                "cannot write {}: {e}; choose another --log",
                path.display()
            ))
        };
        Ok(Log {
            file: File::create(path).map_err(failed)?,
            path: path.clone(),
        })
    }

    fn write(&mut self, entry: &LogEntry) -> Result<(), CliError> {
        let written = serde_json::to_string(entry).map_err(std::io::Error::other);
        let written = written.and_then(|line| self.file.write_all((line + "\n").as_bytes()));
        written.map_err(|e| {
            CliError::Failed(format!(
                "cannot write {}: {e}; free some space",
                self.path.display()
            ))
        })
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

//! Findings: the examined subject, the observation, and the severity.

use std::fmt::Display;

use serde::Serialize;

use bench_base::remedy;

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// As it should be.
    Ok,
    /// For information.
    Note,
    /// The run starts, but its timing or its results may suffer.
    Warning,
    /// The run would not start, or would trip at once.
    Failure,
}

impl Severity {
    /// The word in the text output.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Ok => "ok",
            Severity::Note => "note",
            Severity::Warning => "WARNING",
            Severity::Failure => "FAILURE",
        }
    }
}

/// Defines the subjects, each with its name in the text output and in JSON.
macro_rules! subjects {
    ($($(#[$doc:meta])+ $variant:ident = $name:literal,)+) => {
        /// The examined subject.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
        #[serde(into = "&'static str")]
        pub enum Subject {
            $($(#[$doc])+ $variant,)+
        }

        impl Subject {
            /// The name in the text output and in JSON.
            pub fn name(self) -> &'static str {
                match self {
                    $(Subject::$variant => $name,)+
                }
            }
        }
    };
}

subjects! {
    /// The kinds of the configured devices.
    Configuration = "configuration",
    /// The configuration of `bench chirp`; a failure does not stop `bench control`.
    Chirp = "chirp",
    /// The configuration of `bench control`; a failure does not stop `bench chirp`.
    Control = "control",
    /// The kernel and its preemption.
    Kernel = "kernel",
    /// The clock source.
    Clock = "clock",
    /// The frequency governors of the processors.
    Processors = "processors",
    /// The limit of the kernel for the run time of real-time threads.
    Throttling = "throttling",
    /// The thread of the loop.
    Loop = "loop",
    /// The priority that the loop is granted.
    Scheduler = "scheduler",
    /// Whether the memory can be locked.
    Memory = "memory",
    /// The processor that the loop is bound to.
    Processor = "processor",
    /// How late the loop wakes up.
    Lateness = "lateness",
    /// The predicted load of the CAN bus.
    BusLoad = "bus load",
    /// The support of CAN by the kernel.
    CanKernel = "CAN kernel",
    /// The network interface of the CAN bus.
    CanInterface = "CAN interface",
    /// The error state of the CAN controller.
    CanState = "CAN state",
    /// The error counters of the CAN controller.
    CanErrors = "CAN errors",
    /// The restart of the CAN controller after a bus-off.
    CanRestart = "CAN restart",
    /// The transmit queue of the CAN interface.
    CanQueue = "CAN queue",
    /// The nodes on the CAN bus.
    CanNodes = "CAN nodes",
    /// The CANopen drive.
    Drive = "drive",
    /// The VESC.
    Vesc = "VESC",
    /// The calibration file.
    Calibration = "calibration",
    /// The serial port of the probe.
    SerialPort = "serial port",
    /// The readings of the probe.
    Readings = "readings",
    /// The heat of the motor.
    Motor = "motor",
    /// The folder of the recordings and its free space.
    Recordings = "recordings",
}

impl From<Subject> for &'static str {
    fn from(subject: Subject) -> Self {
        subject.name()
    }
}

impl Subject {
    /// As it should be.
    pub fn ok(self, what: impl Into<String>) -> Finding {
        Finding::new(self, Severity::Ok, what, None)
    }

    /// For information.
    pub fn note(self, what: impl Into<String>, remedy: impl Into<String>) -> Finding {
        Finding::new(self, Severity::Note, what, Some(remedy.into()))
    }

    /// The run starts nevertheless.
    pub fn warning(self, what: impl Into<String>, remedy: impl Into<String>) -> Finding {
        Finding::new(self, Severity::Warning, what, Some(remedy.into()))
    }

    /// The run does not start, or trips at once.
    pub fn failure(self, what: impl Into<String>, remedy: impl Into<String>) -> Finding {
        Finding::new(self, Severity::Failure, what, Some(remedy.into()))
    }

    /// The run does not start because of an error, whose text is `what; remedy`.
    pub fn refused(self, error: &impl Display) -> Finding {
        let text = error.to_string();
        let (what, remedy) = remedy::split(&text);
        Finding::new(self, Severity::Failure, what, remedy.map(String::from))
    }
}

/// A fact and its severity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The examined subject.
    pub subject: Subject,
    /// The observation, with its figures.
    pub what: String,
    /// How severe it is.
    #[serde(rename = "verdict")]
    pub severity: Severity,
    /// The remedy.
    pub remedy: Option<String>,
}

impl Finding {
    fn new(
        subject: Subject,
        severity: Severity,
        what: impl Into<String>,
        remedy: Option<String>,
    ) -> Finding {
        Finding {
            subject,
            what: what.into(),
            severity,
            remedy,
        }
    }

    /// The finding with its severity limited to `limit`.
    pub fn at_most(self, limit: Severity) -> Finding {
        Finding {
            severity: self.severity.min(limit),
            ..self
        }
    }
}

/// The content of a file of one line, trimmed; `None` if it does not exist.
pub(super) fn read_line(path: impl AsRef<std::path::Path>) -> Option<String> {
    let text = std::fs::read_to_string(path).ok()?;
    Some(text.trim().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_text_is_split_into_what_and_remedy() {
        let subject = Subject::SerialPort;
        let finding = subject.refused(&"/dev/x: gone; plug it in; then start again");
        assert_eq!(finding.what, "/dev/x: gone");
        let remedy = finding.remedy.as_deref();
        assert_eq!(remedy, Some("plug it in; then start again"));
        assert_eq!(subject.refused(&"no remedy").remedy, None);
    }

    #[test]
    fn severity_is_limited_and_never_raised() {
        let warning = Subject::Clock.warning("y", "z");
        let limited = warning.clone().at_most(Severity::Note);
        assert_eq!(limited.severity, Severity::Note);
        assert_eq!(
            warning.at_most(Severity::Failure).severity,
            Severity::Warning
        );
    }
}

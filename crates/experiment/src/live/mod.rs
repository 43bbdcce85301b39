//! A rig with its loop, its recorder and its supervisor, open for several runs.
//!
//! A bench is opened (`open_bench`); its rig (`live_rig`) connects the loop (`connections`), creates the recording (`file_name`,
//! `run_recording`) and watches the run (`run_supervisor`, `run_hooks`, `stop_signals`), which ends as a `run`.

mod connections;
mod file_name;
mod live_rig;
mod open_bench;
mod run;
mod run_hooks;
mod run_recording;
mod run_supervisor;
mod stop_signals;

pub(crate) use connections::{OutsideEnds, connect};
pub use live_rig::{LiveRig, run};
pub(crate) use live_rig::{TAIL_S, servo_run};
pub use open_bench::{DeviceNames, OpenBench, Opening};
pub(crate) use run::RunFile;
pub use run::{RemoteRecording, Run, RunEnd, StopCause};
pub use run_hooks::{Feed, FeedSender, FeedSource, RecordingDefect, RunHooks, TripCount};
pub use stop_signals::{StopSignals, abandon_on_signal, stop_on_signal, survive_file_size_limit};

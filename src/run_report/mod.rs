//! What a person gets of a run: its pictures, and one page with all of them that needs nothing from elsewhere.
//!
//! ```text
//! session::Analysis, config, recording -> pictures (report::*) -> page (report::page)
//! ```

mod page;
mod pictures;

pub use page::page;
pub use pictures::{KINDS, Picture, pictures};

use crate::config::Config;
use crate::excitation::{swept_words, words};
use crate::recording::Recording;
use crate::session::Analysis;

/// A run that was analysed.
#[derive(Clone, Copy, Debug)]
pub struct AnalysedRun<'a> {
    /// What it shows.
    pub analysis: &'a Analysis,
    /// What it was made with.
    pub config: &'a Config,
    /// Where it was recorded.
    pub recording: &'a Recording,
}

impl AnalysedRun<'_> {
    /// What was excited, and when, in two lines.
    fn subtitle(&self) -> String {
        format!("current set-point to displacement, with hold, amplifier and delay;\n{}", self.occasion())
    }

    /// How the stage was excited, and when.
    fn occasion(&self) -> String {
        let how = match self.analysis.closed {
            Some(_) => swept_words(self.config),
            None => words(self.config),
        };
        format!("{how} at {} Hz; {}", self.config.servo.rate_hz, self.said("started"))
    }

    /// What the recording says of itself under a name.
    fn said(&self, name: &str) -> &str {
        self.recording.metadata().get(name).map_or("", String::as_str)
    }
}

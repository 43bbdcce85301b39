//! Monte Carlo over manufacturing tolerances: how likely each number of CNMP pairs is, and which settings decide it.
//!
//! ```text
//!  Tolerance (as typed) + settings -> Plan -> draw k: its own random numbers -> plant -> zeros -> Count
//!                                      |                                                       |
//!                                      |            blocks of draws, on all threads <----------+
//!                                      v                          |
//!                        Answer <--- Results <--- StudyFile: what is done, by shards, to go on and to join
//! ```
//!
//! A file holds the counts alone: the settings of draw k are a function of the plan and of k. So an answer does not depend
//! on threads, on shards, on interruptions, or on the order in which blocks were done.

mod answer;
mod counter;
mod effects;
mod file;
mod interval;
mod plan;
mod results;
mod tolerance;
mod workers;

pub use answer::{Answer, Counted, Effect, Interaction, NotAnalysed, Probability};
pub(crate) use file::differences;
pub use file::{Opened, StudyFile, joined};
pub use plan::{Drawn, Plan, Shard, Varied};
pub use results::{Block, Count, Failure, Results};
pub use tolerance::{Deviation, Tolerance};
pub use workers::count;

/// Why there is no study.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// A tolerance that cannot be read, or means nothing for its setting.
    #[error("--vary {text}: {why}")]
    Tolerance {
        /// As typed.
        text: String,
        /// What is wrong, with the remedy.
        why: String,
    },
    /// No setting, too many, or no draws.
    #[error("{0}")]
    Plan(
        /// What is wrong, with the remedy.
        String,
    ),
    /// A shard that is none.
    #[error("`{0}` is no shard; write I/N, as in 3/8: the third of eight, I from 1 to N")]
    Shard(
        /// As typed.
        String,
    ),
    /// A file that cannot be written or read.
    #[error("cannot {what} {path}: {why}; {remedy}")]
    File {
        /// What was tried.
        what: &'static str,
        /// The file.
        path: String,
        /// The system's words.
        why: String,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A file that is something else.
    #[error("{path} is not a study ({why}); it is left as it is: name another file")]
    NotAStudy {
        /// The file.
        path: String,
        /// What was found.
        why: String,
    },
    /// A file of other settings.
    #[error("{path} holds a study of other settings; name another file, or give the same settings:\n{}", differences.join("\n"))]
    Other {
        /// The file.
        path: String,
        /// A line for each difference.
        differences: Vec<String>,
    },
    /// Files that do not make up a whole.
    #[error("the shards do not make up a whole study:\n{}", .0.join("\n"))]
    Shards(
        /// A line for each finding.
        Vec<String>,
    ),
}

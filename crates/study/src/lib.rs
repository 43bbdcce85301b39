//! Monte Carlo study of manufacturing tolerances: the probability of each number of CNMP pairs, and the settings that
//! decide it.
//!
//! ```text
//!  Tolerance (as typed) + settings -> Plan -> draw k: its own random numbers -> plant -> zeros -> Count
//!                                      |                                                       |
//!                                      |            blocks of draws, on all threads <----------+
//!                                      v                          |
//!                        Answer <--- Results <--- StudyFile: completed blocks, by shards, to continue and to join
//! ```
//!
//! A file holds the counts alone: the settings of draw k are a function of the plan and of k. The answer therefore does
//! not depend on threads, shards, interruptions, or the order in which blocks were completed.

#![deny(unsafe_code)]

mod answer;
mod counter;
mod effects;
mod file;
mod plan;
mod results;
mod tolerance;
mod workers;

pub use answer::{Answer, Counted, Effect, Interaction, NotAnalysed, Probability};
pub use counter::Count;
pub use file::{Opened, StudyFile, joined};
pub use plan::{Drawn, Plan, Shard, Varied};
pub use results::{Block, Failure, Results};
pub use tolerance::{Deviation, Tolerance};
pub use workers::complete;

use bench_base::checkpoint::FileError;

/// The reason why a study is refused or fails.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// A tolerance that cannot be read, or that does not apply to its setting.
    #[error("--vary {text}: {why}")]
    Tolerance {
        /// As typed.
        text: String,
        /// The reason, with the remedy.
        why: String,
    },
    /// A plan without or with too many settings or draws, or of a plant that cannot be analysed.
    #[error("{0}")]
    Plan(
        /// The reason, with the remedy.
        String,
    ),
    /// An invalid shard.
    #[error("invalid shard `{0}`; give I/N with 1 <= I <= N, as in 3/8 for the third of eight")]
    Shard(
        /// As typed.
        String,
    ),
    /// A file that cannot be written or read.
    #[error("{error}; {remedy}")]
    File {
        /// The failure.
        error: FileError,
        /// The remedy.
        remedy: &'static str,
    },
    /// A file of another kind.
    #[error("{path} is not a study ({why}) and was left unchanged; choose another file")]
    NotAStudy {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// A file of other settings.
    #[error("{path} contains a study with different settings; \
        choose another file, or use the same settings:\n{}", differences.join("\n"))]
    OtherSettings {
        /// The file.
        path: String,
        /// A line for each difference.
        differences: Vec<String>,
    },
    /// Files that are not a complete study together.
    #[error("the shards are not a complete study; correct the list of files, or complete the shards:\n{}", .0.join("\n"))]
    Shards(
        /// A line for each finding.
        Vec<String>,
    ),
}

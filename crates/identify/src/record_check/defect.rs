//! The kinds of defects of a record, and their messages.

use std::fmt;

/// A defect of a record. Times are in seconds from its first sample, heights in units of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Defect {
    /// A few samples are far off.
    Spike {
        /// Time of the first one.
        time_s: f64,
        /// By how much.
        height: f64,
    },
    /// The output jumps.
    Step {
        /// Time of the first sample after the jump.
        time_s: f64,
        /// By how much.
        height: f64,
    },
    /// The output changes abruptly, but not by a jump: with friction or play, or after a force that is not in the input.
    Abrupt {
        /// Time of the first sample of the change.
        time_s: f64,
    },
    /// The output keeps its value for some samples.
    Repeated {
        /// Time of the first one.
        time_s: f64,
        /// Number of samples.
        samples: usize,
    },
    /// The output keeps its value at the beginning or the end of the record, while the input changes: a command at rest, or a probe that
    /// fails for good.
    Constant {
        /// Time of the first one.
        time_s: f64,
        /// Number of samples.
        samples: usize,
    },
    /// The probe is slower than the log: each of its values is repeated.
    Held {
        /// Samples for each value.
        samples: f64,
        /// Values per second.
        probe_hz: f64,
    },
    /// The output stays at its largest or smallest value.
    Clipped {
        /// Time of the first sample at that value.
        time_s: f64,
        /// The value.
        value: f64,
    },
    /// The output moves at the beginning.
    MovingAtStart {
        /// Its velocity over the RMS velocity of the record.
        ratio: f64,
    },
    /// The output moves at the end.
    MovingAtEnd {
        /// Its velocity over the RMS velocity of the record.
        ratio: f64,
    },
}

impl Defect {
    /// Whether samples of the output are no readings of it, or only limits.
    pub fn loses_readings(&self) -> bool {
        matches!(
            self,
            Defect::Repeated { .. } | Defect::Held { .. } | Defect::Clipped { .. }
        )
    }

    /// Whether it is a spike or a step, which may be corrected.
    pub fn is_outlier(&self) -> bool {
        matches!(self, Defect::Spike { .. } | Defect::Step { .. })
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Defect::Spike { time_s, height } => write!(
                f,
                "the output has a spike of {height:.3e} at {time_s:.4} s; replace these samples by interpolation"
            ),
            Defect::Step { time_s, height } => write!(
                f,
                "the output jumps by {height:.3e} at {time_s:.4} s; subtract the jump from the samples after it, or repeat the record"
            ),
            Defect::Abrupt { time_s } => write!(
                f,
                "the output changes abruptly at {time_s:.4} s, which neither the input nor a jump of the reading explains, as with friction or play, or after a blow; remove the cause, or repeat the record"
            ),
            Defect::Repeated { time_s, samples } => write!(
                f,
                "{samples} samples of the output from {time_s:.4} s on have the same value; check the probe and its connection, and repeat the record"
            ),
            Defect::Constant { time_s, samples } => write!(
                f,
                "{samples} samples of the output from {time_s:.4} s on have the same value, while the input changes; exchange --input and --output if the output is the command, or else check the probe and its connection"
            ),
            Defect::Held { samples, probe_hz } => write!(
                f,
                "{}: the probe has {probe_hz:.1} values per second; keep only the lines in which the output has changed, with their times, or log both columns at the rate of the probe; the excitation must end below {:.1} Hz, half of it",
                HeldFor(*samples),
                probe_hz / 2.0
            ),
            Defect::Clipped { time_s, value } => write!(
                f,
                "the output is clipped at {value:.6e}, for the first time at {time_s:.4} s; lower the amplitude, or extend the range of the probe"
            ),
            Defect::MovingAtStart { ratio } => write!(
                f,
                "the output moves at the first sample, with {:.0} % of its RMS velocity; begin the record before the excitation, with the plant at rest, or give --period if it is periodic",
                100.0 * ratio
            ),
            Defect::MovingAtEnd { ratio } => write!(
                f,
                "the output still moves at the last sample, with {:.0} % of its RMS velocity; record for longer after the excitation, until the plant is at rest, or give --period if it is periodic",
                100.0 * ratio
            ),
        }
    }
}

/// A whole number of samples differs from a measured one by less than this.
pub(super) const WHOLE: f64 = 0.02;

/// For how many samples the output stays the same.
pub(super) struct HeldFor(pub(super) f64);

impl fmt::Display for HeldFor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let whole = self.0.round();
        if (self.0 - whole).abs() > WHOLE {
            return write!(
                f,
                "the output changes only after {:.2} samples on average",
                self.0
            );
        }
        let ending = match whole as u64 % 10 {
            2 if whole != 12.0 => "nd",
            3 if whole != 13.0 => "rd",
            1 if whole != 11.0 => "st",
            _ => "th",
        };
        write!(
            f,
            "the output changes only at every {whole:.0}{ending} sample"
        )
    }
}

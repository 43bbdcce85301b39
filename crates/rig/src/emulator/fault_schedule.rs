//! Planned faults: `KIND@TIME` begins a fault, `KIND@FROM..TO` also ends it.

use std::collections::VecDeque;

use super::fault::{FaultError, FaultRequest};
use bench_base::quantity::Time;

/// Latest planned time, in seconds: one day.
const LATEST_S: f64 = 86_400.0;

/// A fault and its times, in seconds.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedFault {
    request: FaultRequest,
    from_s: f64,
    to_s: Option<f64>,
}

/// A text that is not a planned fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlannedFaultError {
    /// The fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// The time.
    #[error(
        "`{text}` is not a fault with its time; write KIND@TIME or KIND@FROM..TO, with times from 0 to {LATEST_S} s (2s, 500ms, or a number of seconds) and the end after the start, as in probe.silence@2s..2.5s"
    )]
    Time {
        /// The text.
        text: String,
    },
}

impl std::str::FromStr for PlannedFault {
    type Err = PlannedFaultError;

    fn from_str(text: &str) -> Result<PlannedFault, PlannedFaultError> {
        let (fault, from_s, to_s) =
            split(text).ok_or_else(|| PlannedFaultError::Time { text: text.into() })?;
        let request = fault.parse()?;
        Ok(PlannedFault {
            request,
            from_s,
            to_s,
        })
    }
}

/// The fault's text, its start and its end.
fn split(text: &str) -> Option<(&str, f64, Option<f64>)> {
    let (fault, times) = text.split_once('@')?;
    let Some((from, to)) = times.split_once("..") else {
        return Some((fault, seconds(times)?, None));
    };
    let (from_s, to_s) = (seconds(from)?, seconds(to)?);
    (to_s > from_s).then_some((fault, from_s, Some(to_s)))
}

fn seconds(text: &str) -> Option<f64> {
    let seconds = text.parse::<Time>().ok()?.si();
    (0.0..=LATEST_S).contains(&seconds).then_some(seconds)
}

/// The planned faults and their ends that are still to come, in the order of time.
#[derive(Clone, Debug, Default)]
pub struct FaultSchedule(VecDeque<(f64, FaultRequest)>);

impl FaultSchedule {
    /// The schedule of `planned`.
    pub fn new(planned: &[PlannedFault]) -> FaultSchedule {
        let mut steps: Vec<(f64, FaultRequest)> = Vec::new();
        for fault in planned {
            steps.push((fault.from_s, fault.request.clone()));
            steps.extend(fault.to_s.map(|to_s| (to_s, fault.request.end())));
        }
        steps.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        FaultSchedule(steps.into())
    }

    /// All steps to come.
    pub fn steps(&self) -> impl Iterator<Item = &FaultRequest> {
        self.0.iter().map(|(_, step)| step)
    }

    /// Takes the steps that are due by `time_s`.
    pub fn take_due(&mut self, time_s: f64) -> Vec<FaultRequest> {
        let mut due = Vec::new();
        while let Some((_, step)) = self.0.pop_front_if(|(at_s, _)| *at_s <= time_s) {
            due.push(step);
        }
        due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planned(text: &str) -> PlannedFault {
        text.parse().expect(text)
    }

    #[test]
    fn faults_begin_and_end_at_the_planned_times() {
        let plan = [
            planned("probe.stuck@2.5"),
            planned("amplifier.late=20ms@1000ms..2s"),
        ];
        let mut schedule = FaultSchedule::new(&plan);
        let mut due = |time_s| {
            let steps = schedule.take_due(time_s);
            steps
                .iter()
                .map(FaultRequest::to_string)
                .collect::<Vec<_>>()
        };
        assert!(due(0.99).is_empty());
        assert_eq!(due(1.0), ["amplifier.late=20ms"]);
        assert_eq!(due(2.4), ["end of amplifier.late=20ms"]);
        assert_eq!(due(9.0), ["probe.stuck"]);
        assert!(due(99.0).is_empty());
    }

    #[test]
    fn rejects_times_that_are_missing_negative_or_reversed() {
        for text in [
            "probe.stuck",
            "probe.stuck@",
            "probe.stuck@-1",
            "probe.stuck@2..1",
            "probe.stuck@NaN",
            "probe.stuck@2A",
            "probe.stuck@2s..500ms",
            "@1..x",
        ] {
            let error = text.parse::<PlannedFault>().expect_err(text).to_string();
            assert!(error.contains("KIND@FROM..TO"), "{error}");
        }
        let unknown = "probe.nonsense@1".parse::<PlannedFault>();
        let error = unknown.expect_err("no such kind").to_string();
        assert!(error.contains("probe.stuck"), "{error}");
    }
}

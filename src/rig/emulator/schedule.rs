//! Faults that are planned: `KIND@SECONDS` for good, `KIND@FROM..TO` for a while.

use std::collections::VecDeque;

use super::fault::{EmulatedFault, FaultError};

/// Longest plan: a day, in seconds.
const LONGEST_S: f64 = 86_400.0;

/// A fault and when.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedFault {
    word: String,
    fault: EmulatedFault,
    from_s: f64,
    to_s: Option<f64>,
}

/// Words that are no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlannedFaultError {
    /// The fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// The time.
    #[error(
        "`{text}`: a fault is planned as KIND@SECONDS or KIND@FROM..TO, in seconds from 0 to {LONGEST_S}, the end after the start: probe.silence@2..2.5"
    )]
    Time {
        /// What was said.
        text: String,
    },
}

impl std::str::FromStr for PlannedFault {
    type Err = PlannedFaultError;

    fn from_str(text: &str) -> Result<PlannedFault, PlannedFaultError> {
        let refused = || PlannedFaultError::Time { text: text.into() };
        let seconds = |text: &str| {
            text.parse()
                .ok()
                .filter(|s| (0.0..=LONGEST_S).contains(s))
                .ok_or_else(refused)
        };
        let (word, when) = text.split_once('@').ok_or_else(refused)?;
        let (from, to) = when
            .split_once("..")
            .map_or((when, None), |(from, to)| (from, Some(to)));
        let (from_s, to_s): (f64, Option<f64>) = (seconds(from)?, to.map(seconds).transpose()?);
        if to_s.is_some_and(|to_s| to_s <= from_s) {
            return Err(refused());
        }
        Ok(PlannedFault {
            word: word.into(),
            fault: EmulatedFault::parse(word)?,
            from_s,
            to_s,
        })
    }
}

/// A word and its fault: what is to be asked for next.
pub type Step = (String, EmulatedFault);

/// What begins and ends when.
#[derive(Clone, Debug, Default)]
pub struct FaultSchedule(VecDeque<(f64, Step)>);

impl FaultSchedule {
    /// All that is planned, in the order of time.
    pub fn new(planned: &[PlannedFault]) -> FaultSchedule {
        let mut steps: Vec<(f64, Step)> = Vec::new();
        for PlannedFault {
            word,
            fault,
            from_s,
            to_s,
        } in planned
        {
            steps.push((*from_s, (word.clone(), *fault)));
            steps.extend(to_s.map(|to_s| (to_s, (format!("end of {word}"), fault.end()))));
        }
        steps.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        FaultSchedule(steps.into())
    }

    /// All faults that will be asked for.
    pub fn steps(&self) -> impl Iterator<Item = &Step> {
        self.0.iter().map(|(_, step)| step)
    }

    /// What is due by `time_s`, once.
    pub fn due(&mut self, time_s: f64) -> Vec<Step> {
        std::iter::from_fn(|| self.0.pop_front_if(|(at_s, _)| *at_s <= time_s))
            .map(|(_, step)| step)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planned(text: &str) -> PlannedFault {
        text.parse().expect(text)
    }

    #[test]
    fn faults_begin_and_end_when_planned() {
        let mut schedule = FaultSchedule::new(&[
            planned("probe.stuck@2.5"),
            planned("amplifier.late=20ms@1..2"),
        ]);
        let mut words = |time_s| {
            schedule
                .due(time_s)
                .into_iter()
                .map(|(word, _)| word)
                .collect::<Vec<_>>()
        };
        assert!(words(0.99).is_empty());
        assert_eq!(words(1.0), ["amplifier.late=20ms"]);
        assert_eq!(words(2.4), ["end of amplifier.late=20ms"]);
        assert_eq!(words(9.0), ["probe.stuck"]);
        assert!(words(99.0).is_empty());
    }

    #[test]
    fn what_is_no_plan_is_refused_with_the_form() {
        for text in [
            "probe.stuck",
            "probe.stuck@",
            "probe.stuck@-1",
            "probe.stuck@2..1",
            "probe.stuck@NaN",
            "@1..x",
        ] {
            let error = text.parse::<PlannedFault>().expect_err(text).to_string();
            assert!(error.contains("KIND@FROM..TO"), "{error}");
        }
        assert!(
            "probe.nonsense@1"
                .parse::<PlannedFault>()
                .expect_err("no kind")
                .to_string()
                .contains("probe.stuck")
        );
    }
}

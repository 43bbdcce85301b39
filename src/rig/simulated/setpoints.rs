//! Commands on their way to the current: accepted in a tick, acting later.

use std::collections::VecDeque;

/// Set-points in order, each with the time from which it acts. Times are in ticks since the start.
#[derive(Clone, Debug)]
pub(super) struct Setpoints {
    coming_a: VecDeque<(f64, f64)>,
    acting_a: f64,
}

impl Setpoints {
    /// Room for what `delay_ticks` hold back.
    pub(super) fn new(delay_ticks: f64) -> Self {
        Setpoints {
            coming_a: VecDeque::with_capacity(delay_ticks as usize + 3),
            acting_a: 0.0,
        }
    }

    /// Takes a set-point that acts from `due`; the last word for a moment counts.
    pub(super) fn push(&mut self, due: f64, current_a: f64) {
        self.coming_a.pop_back_if(|(other, _)| *other == due);
        self.coming_a.push_back((due, current_a));
    }

    /// Zero, and nothing to come.
    pub(super) fn clear(&mut self) {
        self.coming_a.clear();
        self.acting_a = 0.0;
    }

    /// What acts from `time` on, if nothing comes in between.
    pub(super) fn at(&mut self, time: f64) -> f64 {
        while let Some((_, current_a)) = self.coming_a.pop_front_if(|(due, _)| *due <= time) {
            self.acting_a = current_a;
        }
        self.acting_a
    }

    /// The mean from `from` to `to`: over a step much shorter than anything that answers, its impulse is all that counts.
    pub(super) fn mean(&mut self, from: f64, to: f64) -> f64 {
        let (mut sum, mut since) = (0.0, from);
        while let Some((due, current_a)) = self.coming_a.pop_front_if(|(due, _)| *due < to) {
            let due = due.max(since);
            sum += self.acting_a * (due - since);
            (since, self.acting_a) = (due, current_a);
        }
        (sum + self.acting_a * (to - since)) / (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_set_point_acts_from_its_time_and_the_last_word_for_a_moment_counts() {
        let mut setpoints = Setpoints::new(1.0);
        setpoints.push(1.0, 5.0);
        setpoints.push(1.0, 2.0);
        setpoints.push(2.0, 3.0);
        assert_eq!(
            [0.0, 1.0, 1.5, 2.0].map(|time| setpoints.at(time)),
            [0.0, 2.0, 2.0, 3.0]
        );
    }

    #[test]
    fn the_mean_over_a_step_is_weighted_by_time() {
        let mut setpoints = Setpoints::new(1.0);
        setpoints.push(0.25, 4.0);
        setpoints.push(0.75, -4.0);
        assert_eq!(setpoints.mean(0.0, 1.0), 0.5 * 4.0 - 0.25 * 4.0);
        assert_eq!(setpoints.mean(1.0, 2.0), -4.0);
        setpoints.clear();
        assert_eq!(setpoints.mean(2.0, 3.0), 0.0);
    }
}

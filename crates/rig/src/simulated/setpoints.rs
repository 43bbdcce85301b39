//! Set-points that have been accepted and take effect later.

use std::collections::VecDeque;

/// Set-points in order, each with the time at which it takes effect. Times are in ticks since the start.
#[derive(Clone, Debug)]
pub(super) struct Setpoints {
    pending_a: VecDeque<(f64, f64)>,
    active_a: f64,
}

impl Setpoints {
    /// Capacity for the set-points of `delay_ticks`.
    pub(super) fn new(delay_ticks: f64) -> Self {
        Setpoints {
            pending_a: VecDeque::with_capacity(delay_ticks as usize + 3),
            active_a: 0.0,
        }
    }

    /// Adds a set-point that takes effect at `due`. It replaces an earlier one for the same time.
    pub(super) fn push(&mut self, due: f64, current_a: f64) {
        self.pending_a.pop_back_if(|(other, _)| *other == due);
        self.pending_a.push_back((due, current_a));
    }

    /// Removes all set-points; the active one is zero.
    pub(super) fn clear(&mut self) {
        self.pending_a.clear();
        self.active_a = 0.0;
    }

    /// The set-point that is active at `time`.
    pub(super) fn at(&mut self, time: f64) -> f64 {
        while let Some((_, current_a)) = self.pending_a.pop_front_if(|(due, _)| *due <= time) {
            self.active_a = current_a;
        }
        self.active_a
    }

    /// The mean from `from` to `to`. For a step much shorter than the time constants of the stage only the impulse matters.
    pub(super) fn mean(&mut self, from: f64, to: f64) -> f64 {
        let (mut sum, mut since) = (0.0, from);
        while let Some((due, current_a)) = self.pending_a.pop_front_if(|(due, _)| *due < to) {
            let due = due.max(since);
            sum += self.active_a * (due - since);
            (since, self.active_a) = (due, current_a);
        }
        (sum + self.active_a * (to - since)) / (to - from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_point_takes_effect_at_its_time_and_the_last_one_counts() {
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

//! The missing ticks between the recorded ones. Writer and reader count them by the same rule.

use bench_rt::record::{Event, EventKind, TickRecord};

/// Missing ticks between two successive records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The last tick before the gap.
    pub after_tick: u64,
    /// The first tick after the gap.
    pub before_tick: u64,
    /// Ticks that the loop missed, as it reported: overruns.
    pub missed: u64,
    /// The other ticks: their records were lost.
    pub lost: u64,
}

/// A tick number that is not larger than the previous one, which is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NotIncreasing(pub u64);

/// Counts of ticks, overruns and losses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Continuity {
    first_and_last: Option<(u64, u64)>,
    ticks: u64,
    overruns: u64,
    lost_in_gaps: u64,
    lost_reported: u64,
}

impl Continuity {
    /// Counts the next tick; returns the gap before it, if there is one.
    pub(super) fn tick(&mut self, record: &TickRecord) -> Result<Option<Gap>, NotIncreasing> {
        let gap = match self.first_and_last {
            Some((_, last)) if record.tick <= last => return Err(NotIncreasing(last)),
            Some((_, last)) => gap(last, record),
            None => None,
        };
        let first = self.first_tick().unwrap_or(record.tick);
        self.first_and_last = Some((first, record.tick));
        self.ticks += 1;
        self.overruns += u64::from(record.missed_ticks);
        self.lost_in_gaps += gap.map_or(0, |g| g.lost);
        Ok(gap)
    }

    /// Counts the records that the loop reports as lost.
    pub(super) fn event(&mut self, event: &Event) {
        if let EventKind::Lost { records } = event.kind {
            self.lost_reported = self.lost_reported.saturating_add(records);
        }
    }

    pub(super) fn ticks(&self) -> u64 {
        self.ticks
    }

    pub(super) fn first_tick(&self) -> Option<u64> {
        self.first_and_last.map(|(first, _)| first)
    }

    pub(super) fn last_tick(&self) -> Option<u64> {
        self.first_and_last.map(|(_, last)| last)
    }

    /// Scheduled ticks that were not served, as the loop counts them.
    pub(super) fn overruns(&self) -> u64 {
        self.overruns
    }

    /// Lost records. A loss causes a gap and is reported by the loop, so the larger count is used: lost events and records lost
    /// at the end cause no gap, and a report may itself be lost.
    pub(super) fn lost_records(&self) -> u64 {
        self.lost_in_gaps.max(self.lost_reported)
    }
}

fn gap(last: u64, record: &TickRecord) -> Option<Gap> {
    let absent = record.tick - last - 1;
    let missed = absent.min(u64::from(record.missed_ticks));
    (absent > 0).then_some(Gap {
        after_tick: last,
        before_tick: record.tick,
        missed,
        lost: absent - missed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn follow(ticks: &[(u64, u32)]) -> (Continuity, Vec<Gap>) {
        let mut account = Continuity::default();
        let mut gaps = Vec::new();
        for &(tick, missed_ticks) in ticks {
            let record = TickRecord {
                tick,
                missed_ticks,
                ..TickRecord::default()
            };
            gaps.extend(account.tick(&record).expect("increasing"));
        }
        (account, gaps)
    }

    #[test]
    fn consecutive_ticks_have_no_gap_from_any_first_tick() {
        let (account, gaps) = follow(&[(7, 0), (8, 0), (9, 0)]);
        assert_eq!(
            (account.ticks(), account.overruns(), account.lost_records()),
            (3, 0, 0)
        );
        assert_eq!(
            (account.first_tick(), account.last_tick()),
            (Some(7), Some(9))
        );
        assert!(gaps.is_empty());
    }

    #[test]
    fn gap_reported_by_loop_counts_as_overrun() {
        let (account, gaps) = follow(&[(0, 0), (4, 3)]);
        assert_eq!((account.overruns(), account.lost_records()), (3, 0));
        assert_eq!(
            gaps,
            [Gap {
                after_tick: 0,
                before_tick: 4,
                missed: 3,
                lost: 0
            }]
        );
    }

    #[test]
    fn gap_not_reported_by_loop_counts_as_lost() {
        let (account, gaps) = follow(&[(0, 0), (4, 1), (10, 0)]);
        assert_eq!((account.overruns(), account.lost_records()), (1, 2 + 5));
        assert_eq!(
            gaps[0],
            Gap {
                after_tick: 0,
                before_tick: 4,
                missed: 1,
                lost: 2
            }
        );
        assert_eq!(
            gaps[1],
            Gap {
                after_tick: 4,
                before_tick: 10,
                missed: 0,
                lost: 5
            }
        );
    }

    #[test]
    fn loss_that_is_reported_and_visible_counts_once() {
        let (mut account, _) = follow(&[(0, 0), (6, 0)]);
        account.event(&Event {
            tick: 6,
            kind: EventKind::Lost { records: 5 },
        });
        assert_eq!(account.lost_records(), 5);
        account.event(&Event {
            tick: 6,
            kind: EventKind::Lost { records: 2 },
        });
        assert_eq!(
            account.lost_records(),
            7,
            "two events were lost besides five ticks"
        );
    }

    #[test]
    fn ticks_that_repeat_or_go_back_are_refused() {
        let (mut account, _) = follow(&[(3, 0)]);
        for tick in [3, 2, 0] {
            assert_eq!(
                account.tick(&TickRecord {
                    tick,
                    ..TickRecord::default()
                }),
                Err(NotIncreasing(3))
            );
        }
        assert_eq!(account.ticks(), 1);
    }
}

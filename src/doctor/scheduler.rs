//! What a thread like the loop's is granted: a real-time priority, locked memory, a processor of its own.

use caps::{CapSet, Capability, has_cap};
use nix::sched::{CpuSet, sched_getaffinity};
use nix::sys::resource::{Resource, getrlimit};
use nix::unistd::Pid;

use super::finding::{Finding, Severity, parted};
use super::trial::Trial;
use crate::config::LoopSettings;
use crate::rt::thread::{Pace, Scheduling};

/// What was asked for, what was granted, and by what right.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SchedulerFacts {
    /// What the trial's thread was granted.
    pub scheduling: Scheduling,
    /// The priority asked for.
    pub priority: i32,
    /// The highest that the limit RLIMIT_RTPRIO allows.
    pub priority_limit: u64,
    /// CAP_SYS_NICE, which needs no limit.
    pub may_schedule: bool,
    /// Memory that the limit RLIMIT_MEMLOCK allows to lock, in bytes.
    pub memory_limit_bytes: u64,
    /// CAP_IPC_LOCK, which needs no limit.
    pub may_lock: bool,
    /// The processor asked for.
    pub cpu: Option<usize>,
    /// The processors that this process may use.
    pub allowed: Vec<usize>,
}

/// Asks the system.
pub fn gather(settings: &LoopSettings, trial: &Trial) -> SchedulerFacts {
    let limit = |resource| getrlimit(resource).map_or(0, |(soft, _)| soft);
    let may = |capability| has_cap(None, CapSet::Effective, capability).unwrap_or(false);
    SchedulerFacts {
        scheduling: trial.scheduling.clone(),
        priority: settings.priority,
        priority_limit: limit(Resource::RLIMIT_RTPRIO),
        may_schedule: may(Capability::CAP_SYS_NICE),
        memory_limit_bytes: limit(Resource::RLIMIT_MEMLOCK),
        may_lock: may(Capability::CAP_IPC_LOCK),
        cpu: settings.cpu,
        allowed: allowed(),
    }
}

fn allowed() -> Vec<usize> {
    let set = sched_getaffinity(Pid::from_raw(0)).unwrap_or_else(|_| CpuSet::new());
    (0..CpuSet::count())
        .filter(|&cpu| set.is_set(cpu).unwrap_or(false))
        .collect()
}

/// What that means for a loop at this pace: a run starts without all of it, and says so.
pub fn findings(facts: &SchedulerFacts, pace: Pace) -> Vec<Finding> {
    let worst = if pace == Pace::Virtual {
        Severity::Note
    } else {
        Severity::Warning
    };
    let findings = [Some(priority(facts)), Some(memory(facts)), processor(facts)];
    findings
        .into_iter()
        .flatten()
        .map(|finding| finding.at_most(worst))
        .collect()
}

fn priority(facts: &SchedulerFacts) -> Finding {
    let right = format!(
        "limit rtprio {}, CAP_SYS_NICE {}",
        facts.priority_limit,
        yes(facts.may_schedule)
    );
    if facts.scheduling.policy.starts_with("SCHED_FIFO") {
        return Finding::ok(
            "scheduler",
            format!("{} is granted ({right})", facts.scheduling.policy),
        );
    }
    let (what, remedy) = refusal(&facts.scheduling, "SCHED_FIFO");
    Finding::warning(
        "scheduler",
        format!("{what} for priority {} ({right})", facts.priority),
        remedy,
    )
}

fn memory(facts: &SchedulerFacts) -> Finding {
    let limit = match facts.memory_limit_bytes {
        u64::MAX => "unlimited".to_string(),
        bytes => format!("{} MiB", bytes >> 20),
    };
    let right = format!(
        "limit memlock {limit}, CAP_IPC_LOCK {}",
        yes(facts.may_lock)
    );
    if facts.scheduling.memory_locked {
        return Finding::ok("memory", format!("can be locked ({right})"));
    }
    let (what, remedy) = refusal(&facts.scheduling, "locking memory");
    Finding::warning("memory", format!("{what} ({right})"), remedy)
}

fn processor(facts: &SchedulerFacts) -> Option<Finding> {
    let cpu = facts.cpu?;
    if facts.scheduling.cpu == Some(cpu) {
        return Some(Finding::ok(
            "processor",
            format!("the loop can be bound to processor {cpu}"),
        ));
    }
    let allowed: Vec<String> = facts.allowed.iter().map(usize::to_string).collect();
    Some(Finding::warning(
        "processor",
        format!(
            "loop.cpu is {cpu}, this process may use {}",
            allowed.join(", ")
        ),
        "choose one of these in loop.cpu, or widen the process's affinity (taskset, the service's CPUAffinity=)",
    ))
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

/// What the system refused, and the remedy.
fn refusal(scheduling: &Scheduling, what: &str) -> (String, String) {
    let line = scheduling
        .refused
        .iter()
        .find(|line| line.starts_with(what));
    let (what, remedy) = parted(line.map_or(what, String::as_str));
    (
        what,
        remedy.unwrap_or_else(|| "see \"Two paces\" in the README".into()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn granted() -> SchedulerFacts {
        SchedulerFacts {
            scheduling: Scheduling {
                policy: "SCHED_FIFO 80".into(),
                memory_locked: true,
                cpu: Some(1),
                refused: vec![],
            },
            priority: 80,
            priority_limit: 95,
            memory_limit_bytes: u64::MAX,
            cpu: Some(1),
            allowed: vec![0, 1],
            ..SchedulerFacts::default()
        }
    }

    fn refused() -> SchedulerFacts {
        let scheduling = Scheduling {
            policy: "SCHED_OTHER".into(),
            memory_locked: false,
            cpu: None,
            refused: vec![
                "locking memory: ENOMEM; raise `memlock`".into(),
                "SCHED_FIFO: EPERM: Operation not permitted; raise `rtprio`".into(),
            ],
        };
        SchedulerFacts {
            scheduling,
            priority_limit: 0,
            memory_limit_bytes: 8 << 20,
            cpu: Some(7),
            ..granted()
        }
    }

    #[test]
    fn what_is_granted_is_ok() {
        assert!(
            findings(&granted(), Pace::Realtime)
                .iter()
                .all(|f| f.verdict == Severity::Ok)
        );
        assert_eq!(
            findings(
                &SchedulerFacts {
                    cpu: None,
                    ..granted()
                },
                Pace::Realtime
            )
            .len(),
            2
        );
    }

    #[test]
    fn what_is_refused_is_a_warning_with_limit_and_remedy_and_no_failure() {
        let found = findings(&refused(), Pace::Realtime);
        assert!(
            found.iter().all(|f| f.verdict == Severity::Warning),
            "{found:?}"
        );
        assert!(
            found[0].what.contains("EPERM")
                && found[0]
                    .what
                    .contains("priority 80 (limit rtprio 0, CAP_SYS_NICE no)")
        );
        assert_eq!(found[0].remedy.as_deref(), Some("raise `rtprio`"));
        assert!(
            found[1].what.contains("limit memlock 8 MiB"),
            "{}",
            found[1].what
        );
        assert_eq!(found[2].what, "loop.cpu is 7, this process may use 0, 1");
    }

    #[test]
    fn at_virtual_pace_it_is_only_worth_a_note() {
        assert!(
            findings(&refused(), Pace::Virtual)
                .iter()
                .all(|f| f.verdict == Severity::Note)
        );
    }

    #[test]
    fn this_process_may_use_some_processor() {
        assert!(!allowed().is_empty());
    }
}

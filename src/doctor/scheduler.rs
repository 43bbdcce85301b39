//! The privileges of the loop's thread: real-time priority, locked memory, its own processor.

use caps::{CapSet, Capability, has_cap};
use nix::sched::{CpuSet, sched_getaffinity};
use nix::sys::resource::{Resource, getrlimit};
use nix::unistd::Pid;

use super::finding::{Finding, Severity, Subject};
use super::trial::Trial;
use bench_base::remedy;
use bench_config::LoopSettings;
use bench_rt::thread::{Pace, Scheduling};

/// The requested and the granted scheduling, and the limits that apply.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SchedulerFacts {
    /// The scheduling that the thread of the trial was granted.
    pub scheduling: Scheduling,
    /// The requested priority.
    pub priority: i32,
    /// The limit RLIMIT_RTPRIO.
    pub priority_limit: u64,
    /// CAP_SYS_NICE, which overrides the limit.
    pub cap_sys_nice: bool,
    /// The limit RLIMIT_MEMLOCK, in bytes.
    pub memory_limit_bytes: u64,
    /// CAP_IPC_LOCK, which overrides the limit.
    pub cap_ipc_lock: bool,
    /// The requested processor.
    pub cpu: Option<usize>,
    /// The processors that this process may use.
    pub allowed: Vec<usize>,
}

/// Reads the limits from the system.
pub fn gather(settings: &LoopSettings, trial: &Trial) -> SchedulerFacts {
    let limit = |resource| getrlimit(resource).map_or(0, |(soft, _)| soft);
    let has = |capability| has_cap(None, CapSet::Effective, capability).unwrap_or(false);
    SchedulerFacts {
        scheduling: trial.scheduling.clone(),
        priority: settings.priority,
        priority_limit: limit(Resource::RLIMIT_RTPRIO),
        cap_sys_nice: has(Capability::CAP_SYS_NICE),
        memory_limit_bytes: limit(Resource::RLIMIT_MEMLOCK),
        cap_ipc_lock: has(Capability::CAP_IPC_LOCK),
        cpu: settings.cpu,
        allowed: allowed_processors(),
    }
}

fn allowed_processors() -> Vec<usize> {
    let set = sched_getaffinity(Pid::from_raw(0)).unwrap_or_else(|_| CpuSet::new());
    let is_allowed = |cpu: &usize| set.is_set(*cpu).unwrap_or(false);
    (0..CpuSet::count()).filter(is_allowed).collect()
}

/// Evaluates the facts for a loop at this pace. A run starts without the privileges and reports that.
pub fn findings(facts: &SchedulerFacts, pace: Pace) -> Vec<Finding> {
    let limit = severity_limit(pace);
    let findings = [Some(priority(facts)), Some(memory(facts)), processor(facts)];
    let findings = findings.into_iter().flatten();
    findings.map(|finding| finding.at_most(limit)).collect()
}

/// At virtual pace the loop does not wait for the clock, so its timing is not affected.
pub(super) fn severity_limit(pace: Pace) -> Severity {
    match pace {
        Pace::Virtual => Severity::Note,
        Pace::Realtime => Severity::Warning,
    }
}

fn priority(facts: &SchedulerFacts) -> Finding {
    let limits = format!(
        "limit rtprio {}, CAP_SYS_NICE {}",
        facts.priority_limit,
        yes_or_no(facts.cap_sys_nice)
    );
    let policy = &facts.scheduling.policy;
    if policy.starts_with("SCHED_FIFO") {
        return Subject::Scheduler.ok(format!("{policy} is granted ({limits})"));
    }
    let (what, remedy) = refusal(&facts.scheduling, "SCHED_FIFO");
    let what = format!("{what} for priority {} ({limits})", facts.priority);
    Subject::Scheduler.warning(what, remedy)
}

fn memory(facts: &SchedulerFacts) -> Finding {
    let limit = match facts.memory_limit_bytes {
        u64::MAX => "unlimited".to_string(),
        bytes => format!("{} MiB", bytes >> 20),
    };
    let capability = yes_or_no(facts.cap_ipc_lock);
    let limits = format!("limit memlock {limit}, CAP_IPC_LOCK {capability}");
    if facts.scheduling.memory_locked {
        return Subject::Memory.ok(format!("can be locked ({limits})"));
    }
    let (what, remedy) = refusal(&facts.scheduling, "locking memory");
    Subject::Memory.warning(format!("{what} ({limits})"), remedy)
}

fn processor(facts: &SchedulerFacts) -> Option<Finding> {
    let cpu = facts.cpu?;
    if facts.scheduling.cpu == Some(cpu) {
        let what = format!("the loop can be bound to processor {cpu}");
        return Some(Subject::Processor.ok(what));
    }
    let allowed = listed(&facts.allowed);
    Some(Subject::Processor.warning(
        format!("loop.cpu is {cpu}, this process may use {allowed}"),
        "choose one of these in loop.cpu, or extend the affinity of the process (taskset, CPUAffinity= of the service)",
    ))
}

fn listed(processors: &[usize]) -> String {
    let numbers: Vec<String> = processors.iter().map(usize::to_string).collect();
    numbers.join(", ")
}

fn yes_or_no(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}

/// The refusal of the system, and the remedy.
fn refusal(scheduling: &Scheduling, request: &str) -> (String, String) {
    let refused = scheduling.refused.iter();
    let text = refused.into_iter().find(|text| text.starts_with(request));
    let (what, remedy) = remedy::split(text.map_or(request, String::as_str));
    let remedy = remedy.unwrap_or("see docs/real-time.md");
    (what.into(), remedy.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn granted() -> SchedulerFacts {
        SchedulerFacts {
            scheduling: Scheduling {
                policy: "SCHED_FIFO 80".into(),
                memory_locked: true,
                idle_states_off: true,
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
            idle_states_off: false,
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
    fn granted_privileges_are_ok() {
        let mut facts = granted();
        let found = findings(&facts, Pace::Realtime);
        assert!(found.iter().all(|f| f.severity == Severity::Ok));
        facts.cpu = None;
        assert_eq!(findings(&facts, Pace::Realtime).len(), 2);
    }

    #[test]
    fn refused_privileges_are_warnings_with_limit_and_remedy() {
        let found = findings(&refused(), Pace::Realtime);
        assert!(
            found.iter().all(|f| f.severity == Severity::Warning),
            "{found:?}"
        );
        let what = &found[0].what;
        let limits = "priority 80 (limit rtprio 0, CAP_SYS_NICE no)";
        assert!(what.contains("EPERM") && what.contains(limits), "{what}");
        assert_eq!(found[0].remedy.as_deref(), Some("raise `rtprio`"));
        let memory = &found[1].what;
        assert!(memory.contains("limit memlock 8 MiB"), "{memory}");
        let processor = "loop.cpu is 7, this process may use 0, 1";
        assert_eq!(found[2].what, processor);
    }

    #[test]
    fn refused_privileges_are_notes_at_virtual_pace() {
        let found = findings(&refused(), Pace::Virtual);
        assert!(found.iter().all(|f| f.severity == Severity::Note));
    }

    #[test]
    fn this_process_may_use_a_processor() {
        assert!(!allowed_processors().is_empty());
    }
}

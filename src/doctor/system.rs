//! Properties of kernel, clock and processors that affect the timing of the loop.

use std::path::Path;

use nix::time::{ClockId, clock_getres};

use super::finding::{Finding, Subject, read_line};
use super::scheduler::severity_limit;
use bench_rt::thread::Pace;

/// Facts about the system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemFacts {
    /// The kernel's release.
    pub release: String,
    /// The kernel's preemption model: `PREEMPT_RT`, `PREEMPT_DYNAMIC`, ...
    pub preemption: String,
    /// Resolution of the monotonic clock in nanoseconds.
    pub clock_step_ns: u64,
    /// Slack of timers for threads without real-time scheduling, in nanoseconds.
    pub timer_slack_ns: u64,
    /// The frequency governors in use; empty if the system does not scale frequencies.
    pub governors: Vec<String>,
    /// Time for real-time threads in each period, in microseconds; -1 is no limit.
    pub rt_runtime_us: Option<i64>,
    /// That period in microseconds.
    pub rt_period_us: Option<i64>,
}

/// Reads the facts from the system.
pub fn gather() -> SystemFacts {
    let realtime = read_line("/sys/kernel/realtime");
    let version = read_line("/proc/version").unwrap_or_default();
    let number = |path| read_line(path).and_then(|text| text.parse().ok());
    SystemFacts {
        release: read_line("/proc/sys/kernel/osrelease").unwrap_or_else(|| "unknown".into()),
        preemption: preemption(realtime.as_deref(), &version),
        clock_step_ns: clock_step_ns(),
        timer_slack_ns: nix::sys::prctl::get_timerslack().map_or(0, |slack| slack.max(0) as u64),
        governors: governors(Path::new("/sys/devices/system/cpu/cpufreq")),
        rt_runtime_us: number("/proc/sys/kernel/sched_rt_runtime_us"),
        rt_period_us: number("/proc/sys/kernel/sched_rt_period_us"),
    }
}

fn clock_step_ns() -> u64 {
    match clock_getres(ClockId::CLOCK_MONOTONIC) {
        Ok(step) => step.tv_sec() as u64 * 1_000_000_000 + step.tv_nsec() as u64,
        Err(_) => 0,
    }
}

/// `/sys/kernel/realtime` is 1 on kernels with PREEMPT_RT; the version names the other models.
fn preemption(realtime: Option<&str>, version: &str) -> String {
    if realtime == Some("1") {
        return "PREEMPT_RT".into();
    }
    let mut words = version.split_whitespace();
    let model = words.find(|word| word.starts_with("PREEMPT"));
    model.unwrap_or("no preemption").into()
}

/// Each policy has a folder with a file `scaling_governor`.
fn governors(folder: &Path) -> Vec<String> {
    let policies = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let governors = policies.map(|policy| read_line(policy.path().join("scaling_governor")));
    let mut governors: Vec<String> = governors.flatten().collect();
    governors.sort();
    governors.dedup();
    governors
}

/// Evaluates the facts for a loop at this pace.
pub fn findings(facts: &SystemFacts, pace: Pace) -> [Finding; 4] {
    let limit = severity_limit(pace);
    let findings = [
        kernel(facts),
        clock(facts),
        governor(facts),
        throttling(facts),
    ];
    findings.map(|finding| finding.at_most(limit))
}

fn kernel(facts: &SystemFacts) -> Finding {
    let what = format!("kernel {}, {}", facts.release, facts.preemption);
    if facts.preemption == "PREEMPT_RT" {
        return Subject::Kernel.ok(what);
    }
    let remedy = "if ticks are late, boot a kernel with PREEMPT_RT (Debian: linux-image-rt-amd64)";
    Subject::Kernel.note(what, remedy)
}

fn clock(facts: &SystemFacts) -> Finding {
    let step_ns = facts.clock_step_ns;
    let slack_us = facts.timer_slack_ns as f64 * 1e-3;
    let what = format!(
        "monotonic clock with a resolution of {step_ns} ns; timer slack {slack_us} us without SCHED_FIFO"
    );
    if step_ns <= 1000 {
        return Subject::Clock.ok(what);
    }
    let remedy = "boot with high resolution timers (CONFIG_HIGH_RES_TIMERS, no `highres=off`)";
    Subject::Clock.warning(what, remedy)
}

fn governor(facts: &SystemFacts) -> Finding {
    match facts.governors.as_slice() {
        [] => Subject::Processors.ok("this system does not scale their frequency"),
        [only] if only == "performance" => Subject::Processors.ok("frequency governor performance"),
        governors => {
            let names = governors.join(", ");
            Subject::Processors.warning(
                format!("frequency governor {names}: a low processor frequency delays the wake-up of the loop"),
                "`cpupower frequency-set -g performance`",
            )
        }
    }
}

/// A loop that sleeps in every tick never reaches the default limit of 95 %.
fn throttling(facts: &SystemFacts) -> Finding {
    let (Some(runtime_us), Some(period_us)) = (facts.rt_runtime_us, facts.rt_period_us) else {
        return Subject::Throttling.ok("this kernel does not limit real-time threads");
    };
    if runtime_us < 0 {
        return Subject::Throttling.ok("real-time threads are not limited");
    }
    let share = 100.0 * runtime_us as f64 / period_us.max(1) as f64;
    let what = format!("real-time threads may use {share:.0} % of a processor");
    if share >= 50.0 {
        return Subject::Throttling.ok(what);
    }
    Subject::Throttling.warning(
        format!("{what}; then they are suspended"),
        "`sysctl kernel.sched_rt_runtime_us=950000`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn healthy() -> SystemFacts {
        SystemFacts {
            release: "6.12".into(),
            preemption: "PREEMPT_RT".into(),
            clock_step_ns: 1,
            timer_slack_ns: 50_000,
            governors: vec!["performance".into()],
            rt_runtime_us: Some(950_000),
            rt_period_us: Some(1_000_000),
        }
    }

    fn not_ok(facts: &SystemFacts, pace: Pace) -> Vec<(Subject, Severity)> {
        let findings = findings(facts, pace).into_iter();
        let found = findings.map(|f| (f.subject, f.severity));
        found.filter(|(_, s)| *s != Severity::Ok).collect()
    }

    fn changed(change: fn(&mut SystemFacts)) -> SystemFacts {
        let mut facts = healthy();
        change(&mut facts);
        facts
    }

    #[test]
    fn a_healthy_system_is_ok() {
        assert_eq!(not_ok(&healthy(), Pace::Realtime), []);
        let unscaled = changed(|f| (f.governors, f.rt_runtime_us) = (vec![], Some(-1)));
        assert_eq!(not_ok(&unscaled, Pace::Realtime), []);
        let unlimited = changed(|f| f.rt_runtime_us = None);
        assert_eq!(not_ok(&unlimited, Pace::Realtime), []);
    }

    #[test]
    fn each_defect_is_one_finding_and_a_note_at_virtual_pace() {
        let mixed = || vec!["performance".to_string(), "schedutil".into()];
        let mut several = healthy();
        several.governors = mixed();
        let cases = [
            (
                changed(|f| f.preemption = "PREEMPT_DYNAMIC".into()),
                (Subject::Kernel, Severity::Note),
            ),
            (
                changed(|f| f.clock_step_ns = 4_000_000),
                (Subject::Clock, Severity::Warning),
            ),
            (
                changed(|f| f.governors = vec!["powersave".into()]),
                (Subject::Processors, Severity::Warning),
            ),
            (several, (Subject::Processors, Severity::Warning)),
            (
                changed(|f| f.rt_runtime_us = Some(100_000)),
                (Subject::Throttling, Severity::Warning),
            ),
            (
                changed(|f| f.rt_runtime_us = Some(0)),
                (Subject::Throttling, Severity::Warning),
            ),
        ];
        for (facts, expected) in cases {
            assert_eq!(not_ok(&facts, Pace::Realtime), [expected]);
            let note = (expected.0, Severity::Note);
            assert_eq!(not_ok(&facts, Pace::Virtual), [note]);
        }
    }

    #[test]
    fn reads_the_preemption_model_of_all_kernels() {
        let dynamic = "Linux version 6.18.44 (x@y) (gcc) #1 SMP PREEMPT_DYNAMIC @0";
        let realtime = "Linux version 6.1 #1 SMP PREEMPT_RT Debian";
        assert_eq!(preemption(None, dynamic), "PREEMPT_DYNAMIC");
        assert_eq!(preemption(Some("1"), dynamic), "PREEMPT_RT");
        assert_eq!(preemption(None, realtime), "PREEMPT_RT");
        let none = "Linux version 5.4 #1 SMP";
        assert_eq!(preemption(Some("0"), none), "no preemption");
    }

    #[test]
    fn each_governor_is_named_once() {
        let folder = tempfile::tempdir().unwrap();
        for (policy, governor) in [
            ("policy0", "powersave\n"),
            ("policy1", "performance\n"),
            ("policy2", "powersave\n"),
        ] {
            let policy = folder.path().join(policy);
            std::fs::create_dir(&policy).unwrap();
            std::fs::write(policy.join("scaling_governor"), governor).unwrap();
        }
        assert_eq!(governors(folder.path()), ["performance", "powersave"]);
        assert_eq!(governors(&folder.path().join("none")), [""; 0]);
    }
}

//! Kernel, clock and processors, as far as they decide how punctually a loop is woken.

use std::fs::read_to_string;
use std::path::Path;

use nix::time::{ClockId, clock_getres};

use super::finding::{Finding, Severity};
use crate::rt::thread::Pace;

/// What the system is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SystemFacts {
    /// The kernel's release.
    pub release: String,
    /// How it lets a running thread be interrupted: `PREEMPT_RT`, `PREEMPT_DYNAMIC`, ...
    pub preemption: String,
    /// Step of the monotonic clock in nanoseconds.
    pub clock_step_ns: u64,
    /// By how much the kernel may delay a timer of a thread without real-time scheduling, in nanoseconds.
    pub timer_slack_ns: u64,
    /// Frequency governors of the processors, each once; none where the system does not scale frequencies.
    pub governors: Vec<String>,
    /// Time for real-time threads in each period, in microseconds; -1 is no limit.
    pub rt_runtime_us: Option<i64>,
    /// That period in microseconds.
    pub rt_period_us: Option<i64>,
}

/// Asks the system.
pub fn gather() -> SystemFacts {
    let step = clock_getres(ClockId::CLOCK_MONOTONIC);
    SystemFacts {
        release: line("/proc/sys/kernel/osrelease").unwrap_or_else(|| "unknown".into()),
        preemption: preemption(
            line("/sys/kernel/realtime").as_deref(),
            &line("/proc/version").unwrap_or_default(),
        ),
        clock_step_ns: step.map_or(0, |step| {
            step.tv_sec() as u64 * 1_000_000_000 + step.tv_nsec() as u64
        }),
        timer_slack_ns: nix::sys::prctl::get_timerslack().map_or(0, |slack| slack.max(0) as u64),
        governors: governors(Path::new("/sys/devices/system/cpu/cpufreq")),
        rt_runtime_us: line("/proc/sys/kernel/sched_rt_runtime_us")
            .and_then(|text| text.parse().ok()),
        rt_period_us: line("/proc/sys/kernel/sched_rt_period_us")
            .and_then(|text| text.parse().ok()),
    }
}

/// A file of one line; `None` if it is not there.
pub(super) fn line(path: impl AsRef<Path>) -> Option<String> {
    read_to_string(path)
        .ok()
        .map(|text| text.trim().to_string())
}

/// `/sys/kernel/realtime` is 1 on kernels with PREEMPT_RT; the version names the other kinds.
fn preemption(realtime: Option<&str>, version: &str) -> String {
    let named = version
        .split_whitespace()
        .find(|word| word.starts_with("PREEMPT"));
    match (realtime, named) {
        (Some("1"), _) => "PREEMPT_RT".into(),
        (_, Some(named)) => named.into(),
        _ => "no preemption".into(),
    }
}

/// One folder a policy, each with `scaling_governor`.
fn governors(folder: &Path) -> Vec<String> {
    let policies = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut governors: Vec<String> = policies
        .filter_map(|policy| line(policy.path().join("scaling_governor")))
        .collect();
    governors.sort();
    governors.dedup();
    governors
}

/// What that means for a loop at this pace.
pub fn findings(facts: &SystemFacts, pace: Pace) -> Vec<Finding> {
    let worst = if pace == Pace::Virtual {
        Severity::Note
    } else {
        Severity::Warning
    };
    let findings = [
        kernel(facts),
        clock(facts),
        governor(facts),
        throttling(facts),
    ];
    findings
        .into_iter()
        .map(|finding| finding.at_most(worst))
        .collect()
}

fn kernel(facts: &SystemFacts) -> Finding {
    let what = format!("kernel {}, {}", facts.release, facts.preemption);
    match facts.preemption.as_str() {
        "PREEMPT_RT" => Finding::ok("kernel", what),
        _ => Finding::note(
            "kernel",
            what,
            "where ticks come late, boot a kernel with PREEMPT_RT (Debian: linux-image-rt-amd64)",
        ),
    }
}

fn clock(facts: &SystemFacts) -> Finding {
    let (step_ns, slack_us) = (facts.clock_step_ns, facts.timer_slack_ns as f64 * 1e-3);
    let what = format!(
        "monotonic clock in steps of {step_ns} ns; timer slack {slack_us} us where SCHED_FIFO is not granted"
    );
    if step_ns <= 1000 {
        return Finding::ok("clock", what);
    }
    Finding::warning(
        "clock",
        what,
        "boot with high resolution timers (CONFIG_HIGH_RES_TIMERS, no `highres=off`)",
    )
}

fn governor(facts: &SystemFacts) -> Finding {
    let names = facts.governors.join(", ");
    match facts.governors.as_slice() {
        [] => Finding::ok("processors", "their frequency is not scaled by this system"),
        [only] if only == "performance" => {
            Finding::ok("processors", "frequency governor performance")
        }
        _ => Finding::warning(
            "processors",
            format!(
                "frequency governor {names}: a processor that has slowed down wakes the loop late"
            ),
            "`cpupower frequency-set -g performance`",
        ),
    }
}

/// A loop that sleeps in every tick never uses up the share that is usual, 95 %.
fn throttling(facts: &SystemFacts) -> Finding {
    let (Some(runtime_us), Some(period_us)) = (facts.rt_runtime_us, facts.rt_period_us) else {
        return Finding::ok("throttling", "this kernel does not limit real-time threads");
    };
    let share = 100.0 * runtime_us as f64 / period_us.max(1) as f64;
    match runtime_us {
        ..0 => Finding::ok("throttling", "real-time threads may run without limit"),
        _ if share >= 50.0 => Finding::ok(
            "throttling",
            format!("real-time threads may use {share:.0} % of a processor"),
        ),
        _ => Finding::warning(
            "throttling",
            format!(
                "real-time threads may use only {share:.0} % of a processor; then they stand still"
            ),
            "`sysctl kernel.sched_rt_runtime_us=950000`",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sound() -> SystemFacts {
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

    fn verdicts(facts: &SystemFacts, pace: Pace) -> Vec<(&'static str, Severity)> {
        findings(facts, pace)
            .into_iter()
            .map(|f| (f.subject, f.verdict))
            .filter(|(_, v)| *v != Severity::Ok)
            .collect()
    }

    #[test]
    fn a_sound_system_is_ok_in_everything() {
        assert_eq!(verdicts(&sound(), Pace::Realtime), []);
        let unscaled = SystemFacts {
            governors: vec![],
            rt_runtime_us: Some(-1),
            ..sound()
        };
        assert_eq!(verdicts(&unscaled, Pace::Realtime), []);
        assert_eq!(
            verdicts(
                &SystemFacts {
                    rt_runtime_us: None,
                    ..sound()
                },
                Pace::Realtime
            ),
            []
        );
    }

    #[test]
    fn each_weakness_is_found_by_itself() {
        let cases = [
            (
                SystemFacts {
                    preemption: "PREEMPT_DYNAMIC".into(),
                    ..sound()
                },
                ("kernel", Severity::Note),
            ),
            (
                SystemFacts {
                    clock_step_ns: 4_000_000,
                    ..sound()
                },
                ("clock", Severity::Warning),
            ),
            (
                SystemFacts {
                    governors: vec!["powersave".into()],
                    ..sound()
                },
                ("processors", Severity::Warning),
            ),
            (
                SystemFacts {
                    governors: vec!["performance".into(), "schedutil".into()],
                    ..sound()
                },
                ("processors", Severity::Warning),
            ),
            (
                SystemFacts {
                    rt_runtime_us: Some(100_000),
                    ..sound()
                },
                ("throttling", Severity::Warning),
            ),
            (
                SystemFacts {
                    rt_runtime_us: Some(0),
                    ..sound()
                },
                ("throttling", Severity::Warning),
            ),
        ];
        for (facts, expected) in cases {
            assert_eq!(verdicts(&facts, Pace::Realtime), [expected]);
            assert_eq!(
                verdicts(&facts, Pace::Virtual),
                [(expected.0, Severity::Note)],
                "nobody waits for a clock"
            );
        }
    }

    #[test]
    fn preemption_is_read_as_kernels_write_it() {
        let dynamic = "Linux version 6.18.44 (x@y) (gcc) #1 SMP PREEMPT_DYNAMIC @0";
        assert_eq!(preemption(None, dynamic), "PREEMPT_DYNAMIC");
        assert_eq!(preemption(Some("1"), dynamic), "PREEMPT_RT");
        assert_eq!(
            preemption(None, "Linux version 6.1 #1 SMP PREEMPT_RT Debian"),
            "PREEMPT_RT"
        );
        assert_eq!(
            preemption(Some("0"), "Linux version 5.4 #1 SMP"),
            "no preemption"
        );
    }

    #[test]
    fn governors_are_named_once() {
        let folder = tempfile::tempdir().unwrap();
        for (policy, governor) in [
            ("policy0", "powersave\n"),
            ("policy1", "performance\n"),
            ("policy2", "powersave\n"),
        ] {
            std::fs::create_dir(folder.path().join(policy)).unwrap();
            std::fs::write(
                folder.path().join(policy).join("scaling_governor"),
                governor,
            )
            .unwrap();
        }
        assert_eq!(governors(folder.path()), ["performance", "powersave"]);
        assert_eq!(governors(&folder.path().join("none")), [""; 0]);
    }
}

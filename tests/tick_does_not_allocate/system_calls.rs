//! No tick makes a system call: the loop runs in a child process in which the kernel allows none.
use assert_no_alloc::assert_no_alloc;
use bench_config::{Config, Source, load};
use bench_rt::clock::{Clock, Realtime, TickTiming};
use bench_rt::servo::Request;

use crate::faulty_rig::Fault;
use crate::programs::programs;
use crate::test_loop::{ConstantCurrent, TestLoop};
use crate::{all_trips, stage, weak_motor};

/// How a child process ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Termination {
    Exit(i32),
    Signal(i32),
}

/// Runs `work` in a forked child with a single thread and waits for it. The exit code is 0 if `work` returns.
pub fn in_child_process(work: impl FnOnce()) -> Termination {
    // SAFETY: the child has only this thread. Until `_exit` it takes no lock that another thread may hold: the loop is created
    // before the fork, and its ticks must not lock, which these tests check.
    let child = unsafe { libc::fork() };
    assert!(
        child >= 0,
        "cannot fork: {}",
        std::io::Error::last_os_error()
    );
    if child == 0 {
        work();
        // SAFETY: ends the child at once, without exit handlers of the parent.
        unsafe { libc::_exit(0) };
    }
    let mut status = 0;
    // SAFETY: `status` outlives the call; `child` is a child of this process, and only this call waits for it.
    let waited = unsafe { libc::waitpid(child, &raw mut status, 0) };
    assert_eq!(waited, child, "{}", std::io::Error::last_os_error());
    if libc::WIFSIGNALED(status) {
        Termination::Signal(libc::WTERMSIG(status))
    } else {
        Termination::Exit(libc::WEXITSTATUS(status))
    }
}

/// From now on the kernel kills the process at any system call except `calls`, `exit`, `exit_group` and `rt_sigreturn`. A write is
/// permitted to devices only, not to the standard output and error.
pub fn allow_only(calls: &[libc::c_long]) {
    const LOAD_WORD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const JUMP_IF_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const JUMP_IF_GREATER: u16 = (libc::BPF_JMP | libc::BPF_JGT | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    /// Offset of the low word of the first argument in the filter's data.
    const FIRST_ARGUMENT: u32 = 16;
    let line = |code, jt, jf, k| libc::sock_filter { code, jt, jf, k };
    let mut filter = [line(RETURN, 0, 0, libc::SECCOMP_RET_KILL_PROCESS); 20];
    let always = [libc::SYS_exit, libc::SYS_exit_group, libc::SYS_rt_sigreturn];
    let is_write = |call: &&libc::c_long| **call == libc::SYS_write;
    // The number of the system call is the first word of the filter's data.
    filter[0] = line(LOAD_WORD, 0, 0, 0);
    let mut next = 1;
    for call in always.iter().chain(calls).filter(|call| !is_write(call)) {
        filter[next] = line(JUMP_IF_EQUAL, 0, 1, *call as u32);
        filter[next + 1] = line(RETURN, 0, 0, libc::SECCOMP_RET_ALLOW);
        next += 2;
    }
    if calls.iter().any(|call| is_write(&call)) {
        filter[next] = line(JUMP_IF_EQUAL, 0, 3, libc::SYS_write as u32);
        filter[next + 1] = line(LOAD_WORD, 0, 0, FIRST_ARGUMENT);
        filter[next + 2] = line(JUMP_IF_GREATER, 0, 1, libc::STDERR_FILENO as u32);
        filter[next + 3] = line(RETURN, 0, 0, libc::SECCOMP_RET_ALLOW);
    }
    let program = libc::sock_fprog {
        len: filter.len() as u16,
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: the kernel copies the program, which outlives the call; both calls affect this thread only.
    let refused = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::prctl(
                libc::PR_SET_SECCOMP,
                libc::SECCOMP_MODE_FILTER,
                &raw const program,
            ) != 0
    };
    if refused {
        // SAFETY: ends the child; exit code 99 means that the kernel has no system call filters.
        unsafe { libc::_exit(99) };
    }
}

const TICKS: u64 = 20_000;

/// Signal chains other than the default: a drive that measures its current, delays of several ticks, a free-running probe with
/// its queue, and the stage with quadratic geometry.
fn chains() -> Vec<(&'static str, Config)> {
    let with = |config: Option<&str>, sets: &[&str]| {
        let sets = sets.iter().map(|set| set.to_string()).collect();
        load(&Source {
            config: config.map(str::to_string),
            sets,
            ..Source::default()
        })
        .expect("the profile is valid")
    };
    vec![
        (
            "lab",
            with(
                Some("lab"),
                &["amplifier.latency_s=0.0043", "probe.latency_s=0.0027"],
            ),
        ),
        ("quadratic", with(None, &["sim.geometry=\"quadratic\""])),
    ]
}

#[test]
fn other_signal_chains_do_not_allocate_or_make_system_calls() {
    for (name, config) in chains() {
        let running = || {
            TestLoop::running(
                &config,
                &[(0..TICKS, Fault::MeasuredOffset(0.0))],
                Box::new(ConstantCurrent(0.05)),
            )
        };
        let mut test_loop = running();
        test_loop.run(TICKS);
        assert!(
            test_loop.commands > TICKS - 10 && test_loop.trip.is_none(),
            "{name}: {:?}",
            test_loop.trip
        );
        let mut test_loop = running();
        let termination = in_child_process(|| {
            allow_only(&[]);
            for _ in 0..TICKS {
                test_loop.bare_tick(0);
                test_loop.collect();
            }
        });
        assert_eq!(
            termination,
            Termination::Exit(0),
            "{name}: a signal means a system call in a tick"
        );
    }
}

#[test]
fn programs_make_no_system_calls() {
    let config = stage();
    for (name, program) in programs(&config) {
        let mut test_loop =
            TestLoop::running(&config, &[(6000..6001, Fault::Position(0.00095))], program);
        let termination = in_child_process(|| {
            allow_only(&[]);
            for _ in 0..TICKS {
                test_loop.bare_tick(0);
                test_loop.collect();
            }
            // SAFETY: ends the child; exit code 1 means that the program did not run.
            unsafe { libc::_exit(if test_loop.has_done(&name) { 0 } else { 1 }) };
        });
        assert_eq!(
            termination,
            Termination::Exit(0),
            "{name}: a signal means a system call in a tick"
        );
    }
}

#[test]
fn trips_requests_and_late_ticks_make_no_system_calls() {
    for (reason, fault, current_a) in all_trips() {
        let config = weak_motor();
        let mut test_loop = TestLoop::running(
            &config,
            &[(0..8000, fault)],
            Box::new(ConstantCurrent(current_a)),
        );
        let mut others = [
            Some(Request::Clear),
            Some(Request::Arm),
            Some(Request::Start(Box::new(ConstantCurrent(0.01)))),
            Some(Request::Stop),
        ];
        let termination = in_child_process(|| {
            allow_only(&[]);
            for _ in 0..8000 {
                test_loop.bare_tick(0);
                test_loop.collect();
            }
            for other in &mut others {
                if let Some(request) = other.take() {
                    let _ = test_loop.requests.send(request);
                }
                test_loop.bare_tick(2);
                test_loop.collect();
            }
            // SAFETY: ends the child; exit code 1 means that the trip did not occur.
            unsafe { libc::_exit(if test_loop.trip == Some(reason) { 0 } else { 1 }) };
        });
        assert_eq!(termination, Termination::Exit(0), "{reason}, {fault:?}");
    }
}

#[test]
fn real_time_loop_makes_only_clock_system_calls() {
    let config = weak_motor();
    let mut test_loop = TestLoop::running(&config, &[], Box::new(ConstantCurrent(0.01)));
    let mut clock = Realtime::new(0.002).awake_before_ticks(80e-6);
    let termination = in_child_process(|| {
        allow_only(&[libc::SYS_clock_nanosleep, libc::SYS_clock_gettime]);
        for number in 0..50 {
            let moment = clock.wait(number, test_loop.servo.run().publisher());
            test_loop.servo.tick(
                &TickTiming {
                    missed: 0,
                    ..moment
                },
                &clock,
            );
            test_loop.collect();
        }
        // A panic makes system calls, so a failure ends the child by a signal.
        assert!(test_loop.commands > 0, "the program did not run");
    });
    assert_eq!(termination, Termination::Exit(0));
    assert_eq!(test_loop.commands, 0, "the child runs a copy of the loop");
}

#[test]
fn detects_a_system_call_or_an_allocation() {
    let config = weak_motor();
    let killed = Termination::Signal(libc::SIGSYS);
    let mut test_loop = TestLoop::running(&config, &[], Box::new(ConstantCurrent(0.01)));
    let prints = in_child_process(|| {
        allow_only(&[]);
        test_loop.bare_tick(0);
        // SAFETY: writes zero bytes; the filter must detect the call.
        unsafe { libc::write(2, std::ptr::null(), 0) };
    });
    assert_eq!(prints, killed, "a print is a system call");
    let maps = in_child_process(|| {
        allow_only(&[]);
        // 64 MiB need a system call, because they exceed the free memory of the heap.
        let memory = vec![1u8; 64 << 20];
        std::hint::black_box(&memory);
    });
    assert_eq!(maps, killed, "a large allocation is a system call");
    let waits = in_child_process(|| {
        allow_only(&[]);
        std::thread::sleep(std::time::Duration::from_millis(1));
    });
    assert_eq!(waits, killed, "a sleep is a system call");
    let allocates = in_child_process(|| {
        assert_no_alloc(|| std::hint::black_box(Box::new(1u8)));
    });
    assert_eq!(
        allocates,
        Termination::Signal(libc::SIGABRT),
        "an allocation of one byte aborts"
    );
    assert_eq!(in_child_process(|| ()), Termination::Exit(0));
}

//! No tick makes a system call: the loop runs in a child process in which the kernel allows none.
use assert_no_alloc::assert_no_alloc;
use bench::config::{Config, Source, load};
use bench::rt::clock::{Clock, Realtime, TickTiming};
use bench::rt::servo::Request;

use crate::faulty_rig::Fault;
use crate::programs::programs;
use crate::test_loop::{ConstantCurrent, TestLoop};
use crate::{all_trips, stage, weak_motor};

/// What became of a child.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Termination {
    Exit(i32),
    Signal(i32),
}

/// Runs `work` in a child of one thread and waits for its end; 0 is the exit code of a child that came to it.
fn in_child_process(work: impl FnOnce()) -> Termination {
    // SAFETY: the child has this thread alone. What it does before `_exit` takes no lock that another thread may hold: the
    // loop is made before the fork, and the ticks are here to be shown to need none.
    let child = unsafe { libc::fork() };
    assert!(
        child >= 0,
        "cannot fork: {}",
        std::io::Error::last_os_error()
    );
    if child == 0 {
        work();
        // SAFETY: ends the child at once, without running anything of the parent's.
        unsafe { libc::_exit(0) };
    }
    let mut status = 0;
    // SAFETY: `status` outlives the call; `child` is a child of this process that nobody else waits for.
    let waited = unsafe { libc::waitpid(child, &raw mut status, 0) };
    assert_eq!(waited, child, "{}", std::io::Error::last_os_error());
    if libc::WIFSIGNALED(status) {
        Termination::Signal(libc::WTERMSIG(status))
    } else {
        Termination::Exit(libc::WEXITSTATUS(status))
    }
}

/// From here on the kernel kills the process at any system call but those named (and the ends of a process).
fn allow_only(calls: &[libc::c_long]) {
    const LOAD_WORD: u16 = (libc::BPF_LD | libc::BPF_W | libc::BPF_ABS) as u16;
    const JUMP_IF_EQUAL: u16 = (libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K) as u16;
    const RETURN: u16 = (libc::BPF_RET | libc::BPF_K) as u16;
    let line = |code, jt, jf, k| libc::sock_filter { code, jt, jf, k };
    let mut filter = [line(RETURN, 0, 0, libc::SECCOMP_RET_KILL_PROCESS); 16];
    let always = [libc::SYS_exit, libc::SYS_exit_group, libc::SYS_rt_sigreturn];
    // The system call's number stands first in what a filter sees.
    filter[0] = line(LOAD_WORD, 0, 0, 0);
    let mut next = 1;
    for call in always.iter().chain(calls) {
        filter[next] = line(JUMP_IF_EQUAL, 0, 1, *call as u32);
        filter[next + 1] = line(RETURN, 0, 0, libc::SECCOMP_RET_ALLOW);
        next += 2;
    }
    let program = libc::sock_fprog {
        len: filter.len() as u16,
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: the kernel copies the program, which outlives the call; both calls concern this thread alone.
    let refused = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0
            || libc::prctl(
                libc::PR_SET_SECCOMP,
                libc::SECCOMP_MODE_FILTER,
                &raw const program,
            ) != 0
    };
    if refused {
        // SAFETY: ends the child; 99 tells the parent that the kernel has no filters.
        unsafe { libc::_exit(99) };
    }
}

const TICKS: u64 = 20_000;

/// Other chains than the default: a drive that measures its current, delays of several ticks, a probe of its own clock with
/// its queue, and the stage with its quadratic geometry.
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
            "{name}: a signal is a system call in a tick"
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
            // SAFETY: as in the parent; 1 says that the program did not run.
            unsafe { libc::_exit(if test_loop.has_done(&name) { 0 } else { 1 }) };
        });
        assert_eq!(
            termination,
            Termination::Exit(0),
            "{name}: a signal is a system call in a tick"
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
                    let _ = test_loop.requests.push(request);
                }
                test_loop.bare_tick(2);
                test_loop.collect();
            }
            // SAFETY: as above; 1 says that there was no such trip.
            unsafe { libc::_exit(if test_loop.trip == Some(reason) { 0 } else { 1 }) };
        });
        assert_eq!(termination, Termination::Exit(0), "{reason}, {fault:?}");
    }
}

#[test]
fn real_time_loop_makes_only_clock_system_calls() {
    let config = weak_motor();
    let mut test_loop = TestLoop::running(&config, &[], Box::new(ConstantCurrent(0.01)));
    let mut clock = Realtime::new(0.002);
    let termination = in_child_process(|| {
        allow_only(&[libc::SYS_clock_nanosleep, libc::SYS_clock_gettime]);
        for number in 0..50 {
            let moment = clock.wait(number, test_loop.servo.publisher());
            test_loop.servo.tick(
                &TickTiming {
                    missed: 0,
                    ..moment
                },
                &clock,
            );
            test_loop.collect();
        }
    });
    assert_eq!(termination, Termination::Exit(0));
    assert_eq!(test_loop.commands, 0, "the child ran its own copy");
}

#[test]
fn detects_a_system_call_or_an_allocation() {
    let config = weak_motor();
    let killed = Termination::Signal(libc::SIGSYS);
    let mut test_loop = TestLoop::running(&config, &[], Box::new(ConstantCurrent(0.01)));
    let prints = in_child_process(|| {
        allow_only(&[]);
        test_loop.bare_tick(0);
        // SAFETY: an empty text; the call itself is what the filter must see.
        unsafe { libc::write(2, std::ptr::null(), 0) };
    });
    assert_eq!(prints, killed, "a print is one system call");
    let maps = in_child_process(|| {
        allow_only(&[]);
        // 64 MiB come from the system, never from what the process already has.
        let memory = vec![1u8; 64 << 20];
        std::hint::black_box(&memory);
    });
    assert_eq!(maps, killed, "so is a large allocation");
    let waits = in_child_process(|| {
        allow_only(&[]);
        std::thread::sleep(std::time::Duration::from_millis(1));
    });
    assert_eq!(waits, killed, "so is a sleep");
    let allocates = in_child_process(|| {
        assert_no_alloc(|| std::hint::black_box(Box::new(1u8)));
    });
    assert_eq!(
        allocates,
        Termination::Signal(libc::SIGABRT),
        "and a single byte from the heap is an abort"
    );
    assert_eq!(in_child_process(|| ()), Termination::Exit(0));
}

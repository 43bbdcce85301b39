//! A person may stop what takes its time, and files stay whole.

use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};

use super::run_error::RunError;

/// Interrupt (Ctrl-C) and terminate, from now on for the whole process.
pub(super) fn signals() -> std::io::Result<(Signal, Signal)> {
    Ok((
        signal(SignalKind::interrupt())?,
        signal(SignalKind::terminate())?,
    ))
}

/// Does `work` in a thread of its own and returns what it made; `None` if a person stops it before it is done. The thread
/// is then left behind, and ends with the process: `work` must not hold what has to be closed in order.
pub fn abandon_on_signal<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, RunError> {
    runtime()?.block_on(async {
        let (mut interrupt, mut terminate) = signals().map_err(system)?;
        let (tell, told) = tokio::sync::oneshot::channel();
        let thread = std::thread::Builder::new().name("bench-analysis".into());
        thread
            .spawn(move || drop(tell.send(work())))
            .map_err(system)?;
        tokio::select! {
            result = told => result.map(Some).map_err(died),
            _ = interrupt.recv() => Ok(None),
            _ = terminate.recv() => Ok(None),
        }
    })
}

/// Does `work` in a thread of its own and waits until it ends. A person who stops it sets the flag that `work` is given; it
/// then comes to an end in order.
pub fn stop_on_signal<T: Send>(work: impl FnOnce(&AtomicBool) -> T + Send) -> Result<T, RunError> {
    let (runtime, stop) = (runtime()?, AtomicBool::new(false));
    std::thread::scope(|scope| {
        runtime.block_on(async {
            let (mut interrupt, mut terminate) = signals().map_err(system)?;
            let (tell, mut told) = tokio::sync::oneshot::channel();
            let thread = std::thread::Builder::new().name("bench-analysis".into());
            thread
                .spawn_scoped(scope, || drop(tell.send(work(&stop))))
                .map_err(system)?;
            loop {
                tokio::select! {
                    result = &mut told => return result.map_err(died),
                    _ = interrupt.recv() => stop.store(true, Ordering::Relaxed),
                    _ = terminate.recv() => stop.store(true, Ordering::Relaxed),
                }
            }
        })
    })
}

fn runtime() -> Result<Runtime, RunError> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(system)
}

fn system(e: std::io::Error) -> RunError {
    RunError::System {
        what: "start the analysis",
        why: e.to_string(),
    }
}

fn died(_: tokio::sync::oneshot::error::RecvError) -> RunError {
    RunError::System {
        what: "finish the analysis",
        why: "its thread died of a panic".into(),
    }
}

#[cfg(test)]
#[allow(unsafe_code, reason = "the tests raise signals")]
mod tests {
    use super::*;

    #[test]
    fn work_that_ends_gives_its_result() {
        assert_eq!(abandon_on_signal(|| 7).unwrap(), Some(7));
    }

    #[test]
    fn ctrl_c_and_sigterm_end_the_wait_and_not_the_process() {
        for number in [libc::SIGINT, libc::SIGTERM] {
            let (release, held) = std::sync::mpsc::channel::<()>();
            let outcome = abandon_on_signal(move || {
                // SAFETY: no memory is touched; the handlers were installed before this thread began.
                unsafe { libc::raise(number) };
                held.recv()
            });
            assert!(outcome.unwrap().is_none());
            drop(release);
        }
    }

    #[test]
    fn ctrl_c_and_sigterm_set_the_flag_and_wait_for_the_work() {
        for number in [libc::SIGINT, libc::SIGTERM] {
            let ended = stop_on_signal(|stop| {
                // SAFETY: no memory is touched; the handlers were installed before this thread began.
                unsafe { libc::raise(number) };
                while !stop.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
                "in order"
            });
            assert_eq!(ended.unwrap(), "in order");
        }
        assert!(!stop_on_signal(|stop| stop.load(Ordering::Relaxed)).unwrap());
    }

    #[test]
    fn work_that_panics_is_an_error() {
        let outcome = abandon_on_signal(|| std::panic::panic_any("no one's fault"));
        assert!(outcome.unwrap_err().to_string().contains("panic"));
    }
}

//! Interrupt and terminate signals: a long computation can be stopped, and files stay complete.

use std::sync::atomic::{AtomicBool, Ordering};

use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot::error::RecvError;

use super::run_error::RunError;

const START: &str = "start the analysis";

/// Installs process-wide handlers for SIGINT (Ctrl-C) and SIGTERM.
pub(super) fn signals() -> std::io::Result<(Signal, Signal)> {
    Ok((
        signal(SignalKind::interrupt())?,
        signal(SignalKind::terminate())?,
    ))
}

/// Does `work` on a thread and returns its result; `None` if a signal arrives before it is done. The thread is then
/// abandoned and ends with the process: `work` must not hold anything that has to be closed.
pub fn abandon_on_signal<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, RunError> {
    let runtime = runtime().map_err(RunError::system(START))?;
    runtime.block_on(async {
        let (mut interrupt, mut terminate) = signals().map_err(RunError::system(START))?;
        let (sender, result) = tokio::sync::oneshot::channel();
        let thread = analysis_thread().spawn(move || drop(sender.send(work())));
        thread.map_err(RunError::system(START))?;
        tokio::select! {
            result = result => result.map(Some).map_err(thread_panicked),
            _ = interrupt.recv() => Ok(None),
            _ = terminate.recv() => Ok(None),
        }
    })
}

/// Does `work` on a thread and waits until it ends. A signal sets the flag that `work` receives; `work` must then end in order.
pub fn stop_on_signal<T: Send>(work: impl FnOnce(&AtomicBool) -> T + Send) -> Result<T, RunError> {
    let runtime = runtime().map_err(RunError::system(START))?;
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        runtime.block_on(async {
            let (mut interrupt, mut terminate) = signals().map_err(RunError::system(START))?;
            let (sender, mut result) = tokio::sync::oneshot::channel();
            let send = || drop(sender.send(work(&stop)));
            let thread = analysis_thread().spawn_scoped(scope, send);
            thread.map_err(RunError::system(START))?;
            loop {
                tokio::select! {
                    result = &mut result => return result.map_err(thread_panicked),
                    _ = interrupt.recv() => stop.store(true, Ordering::Relaxed),
                    _ = terminate.recv() => stop.store(true, Ordering::Relaxed),
                }
            }
        })
    })
}

fn analysis_thread() -> std::thread::Builder {
    std::thread::Builder::new().name("bench-analysis".into())
}

/// A runtime on the calling thread.
pub(super) fn runtime() -> std::io::Result<Runtime> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
}

fn thread_panicked(_: RecvError) -> RunError {
    RunError::System {
        what: "finish the analysis",
        why: "its thread panicked; please report this with the command and its input".into(),
    }
}

#[cfg(test)]
#[allow(unsafe_code, reason = "the tests raise signals")]
mod tests {
    use std::sync::{Mutex, MutexGuard, PoisonError};

    use super::*;

    /// Held by each test: a raised signal reaches every listener of the process, also that of a test beside it.
    fn one_at_a_time() -> MutexGuard<'static, ()> {
        static LISTENERS: Mutex<()> = Mutex::new(());
        LISTENERS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    #[test]
    fn returns_the_result_of_finished_work() {
        let _alone = one_at_a_time();
        assert_eq!(abandon_on_signal(|| 7).unwrap(), Some(7));
    }

    #[test]
    fn ctrl_c_and_sigterm_end_the_wait_and_not_the_process() {
        let _alone = one_at_a_time();
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
        let _alone = one_at_a_time();
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
        let _alone = one_at_a_time();
        let outcome = abandon_on_signal(|| std::panic::panic_any("no one's fault"));
        assert!(outcome.unwrap_err().to_string().contains("panic"));
    }
}

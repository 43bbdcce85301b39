//! A person may stop what takes its time, and files stay whole.

use tokio::signal::unix::{Signal, SignalKind, signal};

use super::SessionError;

/// Interrupt (Ctrl-C) and terminate, from now on for the whole process.
pub(super) fn signals() -> std::io::Result<(Signal, Signal)> {
    Ok((signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?))
}

/// Does `work` in a thread of its own and returns what it made; `None` if a person stops it before it is done. The thread
/// is then left behind, and ends with the process: `work` must not hold what has to be closed in order.
pub fn unless_stopped<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<Option<T>, SessionError> {
    let system = |e: std::io::Error| SessionError::System { what: "start the analysis", why: e.to_string() };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(system)?;
    runtime.block_on(async {
        let (mut interrupt, mut terminate) = signals().map_err(system)?;
        let (tell, told) = tokio::sync::oneshot::channel();
        let thread = std::thread::Builder::new().name("bench-analysis".into());
        thread.spawn(move || drop(tell.send(work()))).map_err(system)?;
        let died = |_| SessionError::System { what: "finish the analysis", why: "its thread died of a panic".into() };
        tokio::select! {
            result = told => result.map(Some).map_err(died),
            _ = interrupt.recv() => Ok(None),
            _ = terminate.recv() => Ok(None),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_ends_gives_its_result() {
        assert_eq!(unless_stopped(|| 7).unwrap(), Some(7));
    }

    #[test]
    fn ctrl_c_and_sigterm_end_the_wait_and_not_the_process() {
        for number in [libc::SIGINT, libc::SIGTERM] {
            let (release, held) = std::sync::mpsc::channel::<()>();
            let outcome = unless_stopped(move || {
                // SAFETY: no memory is touched; the handlers were installed before this thread began.
                unsafe { libc::raise(number) };
                held.recv()
            });
            assert!(outcome.unwrap().is_none());
            drop(release);
        }
    }

    #[test]
    fn work_that_panics_is_an_error() {
        let outcome = unless_stopped(|| std::panic::panic_any("no one's fault"));
        assert!(outcome.unwrap_err().to_string().contains("panic"));
    }
}

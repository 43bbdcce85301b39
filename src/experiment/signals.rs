//! Signals that end a run or a long computation, so that the motor is off and files are complete.

use std::future::poll_fn;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::Poll;

use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot::error::RecvError;

use super::run_error::RunError;
use crate::util::thread_priority::lower;

const START: &str = "start the analysis";
/// Nice value of an analysis: less urgent than the recorder and everything else.
const ANALYSIS_NICE: i32 = 19;

/// The signals that end a run: SIGINT (Ctrl-C), SIGTERM, SIGQUIT (Ctrl-\\) and SIGHUP (a closed terminal or connection).
/// SIGHUP is left alone where it is ignored, as by `nohup`.
pub struct StopSignals(Vec<Signal>);

impl StopSignals {
    /// Installs process-wide handlers. Must be called within a tokio runtime.
    pub fn listen() -> std::io::Result<StopSignals> {
        let mut kinds = vec![
            SignalKind::interrupt(),
            SignalKind::terminate(),
            SignalKind::quit(),
        ];
        if !is_ignored(SignalKind::hangup()) {
            kinds.push(SignalKind::hangup());
        }
        let signals: std::io::Result<_> = kinds.into_iter().map(signal).collect();
        Ok(StopSignals(signals?))
    }

    /// Waits for the next of the signals.
    pub async fn received(&mut self) {
        poll_fn(|context| {
            let mut signals = self.0.iter_mut();
            match signals.any(|signal| signal.poll_recv(context).is_ready()) {
                true => Poll::Ready(()),
                false => Poll::Pending,
            }
        })
        .await
    }
}

/// Lets a write beyond the limit of the file size (`ulimit -f`) fail with an error. By default, SIGXFSZ would kill the process.
///
/// # Errors
/// When the system refuses the handler.
pub fn survive_file_size_limit() -> std::io::Result<()> {
    let runtime = runtime()?;
    let _within = runtime.enter();
    // The handler stays installed for the life of the process.
    signal(SignalKind::from_raw(libc::SIGXFSZ)).map(drop)
}

/// Whether this process ignores a signal: bit `number - 1` of `SigIgn` [Linux, proc_pid_status(5)].
fn is_ignored(kind: SignalKind) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mut lines = status.lines();
    let mask = lines.find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|hex| u64::from_str_radix(hex.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (kind.as_raw_value() - 1) & 1 == 1)
}

/// Does `work` on a thread of low priority and returns its result; `None` if a signal arrives before it is done. The thread is then
/// abandoned and ends with the process: `work` must not hold anything that has to be closed.
pub fn abandon_on_signal<T: Send + 'static>(
    work: impl FnOnce() -> T + Send + 'static,
) -> Result<Option<T>, RunError> {
    let runtime = runtime().map_err(RunError::system(START))?;
    runtime.block_on(async {
        let mut signals = StopSignals::listen().map_err(RunError::system(START))?;
        let (sender, result) = tokio::sync::oneshot::channel();
        let work = move || {
            lower(ANALYSIS_NICE);
            drop(sender.send(work()));
        };
        let thread = analysis_thread().spawn(work);
        thread.map_err(RunError::system(START))?;
        tokio::select! {
            result = result => result.map(Some).map_err(thread_panicked),
            () = signals.received() => Ok(None),
        }
    })
}

/// Does `work` on a thread and waits until it ends. A signal sets the flag that `work` receives; `work` must then end in order.
pub fn stop_on_signal<T: Send>(work: impl FnOnce(&AtomicBool) -> T + Send) -> Result<T, RunError> {
    let runtime = runtime().map_err(RunError::system(START))?;
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        runtime.block_on(async {
            let mut signals = StopSignals::listen().map_err(RunError::system(START))?;
            let (sender, mut result) = tokio::sync::oneshot::channel();
            let send = || drop(sender.send(work(&stop)));
            let thread = analysis_thread().spawn_scoped(scope, send);
            thread.map_err(RunError::system(START))?;
            loop {
                tokio::select! {
                    result = &mut result => return result.map_err(thread_panicked),
                    () = signals.received() => stop.store(true, Ordering::Relaxed),
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
    RunError::AnalysisDied
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
    fn each_stop_signal_ends_the_wait_and_not_the_process() {
        let _alone = one_at_a_time();
        for number in [libc::SIGINT, libc::SIGTERM, libc::SIGQUIT] {
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
    fn each_stop_signal_sets_the_flag_and_waits_for_the_work() {
        let _alone = one_at_a_time();
        for number in [libc::SIGINT, libc::SIGTERM, libc::SIGQUIT] {
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
    fn analysis_has_the_lowest_priority() {
        let _alone = one_at_a_time();
        // Field 19 [Linux, proc_pid_stat(5)]; the name in field 2 ends with the last parenthesis.
        let nice = abandon_on_signal(|| {
            let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
            let (_, from_field_3) = stat.rsplit_once(") ").unwrap();
            from_field_3.split(' ').nth(16).unwrap().to_string()
        });
        assert_eq!(nice.unwrap().unwrap(), "19");
    }

    #[test]
    fn work_that_panics_is_an_error() {
        let _alone = one_at_a_time();
        let outcome = abandon_on_signal(|| std::panic::panic_any("no one's fault"));
        assert!(outcome.unwrap_err().to_string().contains("panic"));
    }
}

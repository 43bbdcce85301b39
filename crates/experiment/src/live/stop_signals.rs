//! Signals that end a run or a long computation, so that the motor is off and files are complete.

use std::future::poll_fn;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Poll;

use signal_hook::SigId;
use signal_hook::flag::{register, register_conditional_default};
use signal_hook::low_level::unregister;
use tokio::runtime::Runtime;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot::error::RecvError;

use crate::errors::RunError;
use bench_base::thread_priority::lower;
use bench_rt::supervision::StopFlags;

const START: &str = "start the analysis";
/// Nice value of an analysis: less urgent than the recorder and everything else.
const ANALYSIS_NICE: i32 = 19;

/// The signals that end a run: SIGINT (Ctrl-C), SIGTERM, SIGQUIT (Ctrl-\\) and SIGHUP (a closed terminal or connection).
/// SIGHUP is left alone where it is ignored, as by `nohup`.
pub struct StopSignals {
    signals: Vec<Signal>,
    _listener: Listener,
}

impl StopSignals {
    /// Installs process-wide handlers. Must be called within a tokio runtime.
    pub fn listen() -> std::io::Result<StopSignals> {
        Listeners::lock().install_default()?;
        let kinds = stop_signals().map(SignalKind::from_raw);
        let signals: std::io::Result<_> = kinds.map(signal).collect();
        Ok(StopSignals {
            signals: signals?,
            _listener: Listener::begin(),
        })
    }

    /// Waits for the next of the signals.
    pub async fn received(&mut self) {
        poll_fn(|context| {
            let mut signals = self.signals.iter_mut();
            if signals.any(|signal| signal.poll_recv(context).is_ready()) {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await
    }
}

/// Sets the stop flags of a loop in the signal handler itself, until it is dropped.
pub(super) struct SignalFlags {
    // Dropped in this order.
    _actions: Actions,
    _listener: Listener,
}

/// Actions of signal handlers, until they are dropped.
struct Actions(Vec<SigId>);

impl SignalFlags {
    /// Each stop signal sets a flag of its own.
    ///
    /// # Errors
    /// When the system refuses a handler.
    pub(super) fn set(flags: &StopFlags) -> std::io::Result<SignalFlags> {
        Listeners::lock().install_default()?;
        let mut actions = Actions(Vec::new());
        for (number, flag) in stop_signals().zip(flags.flags()) {
            actions.0.push(register(number, Arc::clone(flag))?);
        }
        Ok(SignalFlags {
            _actions: actions,
            _listener: Listener::begin(),
        })
    }
}

impl Drop for Actions {
    fn drop(&mut self) {
        for action in self.0.drain(..) {
            unregister(action);
        }
    }
}

/// Part of the program that waits for a stop signal. Without one, a stop signal ends the process as it does without handlers.
///
/// It begins when its handlers are installed: a signal that arrives before ends the process. In the other order it would be lost. The
/// default action is installed before them ([`Listeners::install_default`]).
struct Listener;

/// Whether nothing in the program waits for a stop signal.
static NO_LISTENER: AtomicBool = AtomicBool::new(false);

static LISTENERS: Mutex<Listeners> = Mutex::new(Listeners {
    count: 0,
    have_default: false,
});

struct Listeners {
    count: usize,
    /// Whether the stop signals have their default action without a listener.
    have_default: bool,
}

impl Listener {
    fn begin() -> Listener {
        let mut listeners = Listeners::lock();
        NO_LISTENER.store(false, Ordering::SeqCst);
        listeners.count += 1;
        Listener
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let mut listeners = Listeners::lock();
        listeners.count -= 1;
        NO_LISTENER.store(listeners.count == 0, Ordering::SeqCst);
    }
}

impl Listeners {
    fn lock() -> MutexGuard<'static, Listeners> {
        LISTENERS.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A handler stays installed after its listener has gone, and would swallow the signal.
    ///
    /// Actions of a signal run in the order of their installation, and this one before those that wake a listener: a thread that is woken
    /// may end its listener while the actions still run, and the default action after that would end the process.
    fn install_default(&mut self) -> std::io::Result<()> {
        if self.have_default {
            return Ok(());
        }
        NO_LISTENER.store(true, Ordering::SeqCst);
        for number in stop_signals() {
            register_conditional_default(number, &NO_LISTENER)?;
        }
        self.have_default = true;
        Ok(())
    }
}

/// The numbers of the signals that end a run.
fn stop_signals() -> impl Iterator<Item = i32> {
    let hang_up = (!is_ignored(libc::SIGHUP)).then_some(libc::SIGHUP);
    let always = [libc::SIGINT, libc::SIGTERM, libc::SIGQUIT];
    always.into_iter().chain(hang_up)
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
fn is_ignored(number: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mut lines = status.lines();
    let mask = lines.find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|hex| u64::from_str_radix(hex.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (number - 1) & 1 == 1)
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
fn runtime() -> std::io::Result<Runtime> {
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
    use std::os::unix::process::ExitStatusExt;
    use std::process::Output;

    use super::*;

    const CHILD: &str = "BENCH_TEST_SIGNAL_CHILD";

    /// Does `body` in a process that runs the test `name` only: a raised signal reaches every listener of the process, also the
    /// runs of the tests beside it. `None` within that process.
    fn in_own_process(name: &str, body: fn()) -> Option<Output> {
        if std::env::var_os(CHILD).is_some() {
            body();
            return None;
        }
        let mut child = std::process::Command::new(std::env::current_exe().unwrap());
        let (_, module) = module_path!().split_once("::").unwrap();
        child.args(["--exact", &format!("{module}::{name}")]);
        child.args(["--nocapture", "--test-threads=1"]);
        Some(child.env(CHILD, "1").output().unwrap())
    }

    fn assert_passed(output: Option<Output>) {
        if let Some(output) = output {
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(output.status.success(), "{text}");
            assert!(text.contains("1 passed"), "{text}");
        }
    }

    #[test]
    fn returns_the_result_of_finished_work() {
        assert_eq!(abandon_on_signal(|| 7).unwrap(), Some(7));
    }

    #[test]
    fn each_stop_signal_ends_the_wait_and_not_the_process() {
        let name = "each_stop_signal_ends_the_wait_and_not_the_process";
        assert_passed(in_own_process(name, stop_the_wait));
    }

    fn stop_the_wait() {
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
        let name = "each_stop_signal_sets_the_flag_and_waits_for_the_work";
        assert_passed(in_own_process(name, stop_the_work));
    }

    fn stop_the_work() {
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
        // Field 19 [Linux, proc_pid_stat(5)]; the name in field 2 ends with the last parenthesis.
        let nice = abandon_on_signal(|| {
            let stat = std::fs::read_to_string("/proc/thread-self/stat").unwrap();
            let (_, from_field_3) = stat.rsplit_once(") ").unwrap();
            from_field_3.split(' ').nth(16).unwrap().to_string()
        });
        assert_eq!(nice.unwrap().unwrap(), "19");
    }

    #[test]
    fn a_signal_sets_the_flags_of_a_run_and_ends_the_process_afterwards() {
        let name = "a_signal_sets_the_flags_of_a_run_and_ends_the_process_afterwards";
        let Some(output) = in_own_process(name, signal_during_and_after_a_run) else {
            return;
        };
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let signal = output.status.signal();
        assert_eq!(signal, Some(libc::SIGINT), "{text}");
        assert!(text.contains("the run is over"), "{text}");
    }

    /// Ends the process by the second signal.
    fn signal_during_and_after_a_run() {
        let flags = StopFlags::default();
        let during = SignalFlags::set(&flags).unwrap();
        // SAFETY: no memory is touched; the handlers were installed before.
        unsafe { libc::raise(libc::SIGINT) };
        let set = flags.flags().iter().filter(|f| f.load(Ordering::SeqCst));
        assert_eq!(set.count(), 1);
        drop(during);
        println!("the run is over");
        // SAFETY: no memory is touched.
        unsafe { libc::raise(libc::SIGINT) };
        println!("the signal was swallowed");
    }

    #[test]
    fn work_that_panics_is_an_error() {
        let outcome = abandon_on_signal(|| std::panic::panic_any("no one's fault"));
        assert!(outcome.unwrap_err().to_string().contains("panic"));
    }
}

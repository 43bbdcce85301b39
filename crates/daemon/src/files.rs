//! Calls of the file system for clients. On a network folder whose server does not answer, a call may take for ever: it must block neither
//! the tasks that serve clients nor the threads that serve runs.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::sync::oneshot;

/// Threads that make the calls. A call that does not return keeps its thread.
const THREADS: usize = 4;
/// Stack of a thread that serves clients. The memory of the daemon is locked, also what a stack does not use.
pub const STACK_BYTES: usize = 1 << 20;
/// Time in which a call returns, with its wait for a thread.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Why there is no result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FolderError {
    /// A call, or those before it, did not return.
    #[error(
        "the folder of the recordings does not answer within {} s; check its disk or its network, then ask again", ANSWER_TIME.as_secs()
    )]
    NoAnswer,
    /// A panic, which has been printed.
    #[error("reading the folder failed; report this with the log of the daemon")]
    Panicked,
}

type Call = Box<dyn FnOnce() + Send>;

/// The calls for clients. They have threads of their own: a pool that grows with the number of requests would let a flood of them cost
/// a locked stack each.
#[derive(Debug)]
pub struct Files {
    calls: Sender<Call>,
    answer_time: Duration,
}

impl Default for Files {
    fn default() -> Files {
        let (calls, waiting) = channel();
        let waiting = Arc::new(Mutex::new(waiting));
        for _ in 0..THREADS {
            let waiting = Arc::clone(&waiting);
            let builder = std::thread::Builder::new().name("bench-files".into());
            let begun = builder
                .stack_size(STACK_BYTES)
                .spawn(move || make_calls(&waiting));
            if let Err(error) = begun {
                tracing::error!("a thread for the calls of the file system was refused: {error}");
            }
        }
        Files {
            calls,
            answer_time: ANSWER_TIME,
        }
    }
}

impl Files {
    /// The result of work on files.
    ///
    /// # Errors
    /// When it does not end in time; its thread is left alone.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, FolderError> {
        let (answer, answered) = oneshot::channel();
        let call = Box::new(move || {
            // Nobody waits for the result of a call that was late already.
            if !answer.is_closed() {
                // After a panic nobody sees what the call owned.
                let _ = answer.send(catch_unwind(AssertUnwindSafe(work)));
            }
        });
        self.calls.send(call).map_err(|_| FolderError::NoAnswer)?;
        match tokio::time::timeout(self.answer_time, answered).await {
            Ok(Ok(Ok(result))) => Ok(result),
            Ok(Ok(Err(_)) | Err(_)) => Err(FolderError::Panicked),
            Err(_) => Err(FolderError::NoAnswer),
        }
    }
}

/// Makes the calls one after the other until nobody can send any.
fn make_calls(waiting: &Mutex<Receiver<Call>>) {
    loop {
        let next = waiting
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .recv();
        let Ok(call) = next else { return };
        call();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(answer_time: Duration) -> Files {
        Files {
            answer_time,
            ..Files::default()
        }
    }

    #[tokio::test]
    async fn calls_that_do_not_return_are_few_and_refused_in_time() {
        let files = files(Duration::from_millis(50));
        let (dead, blocked) = channel::<()>();
        let blocked = Arc::new(Mutex::new(blocked));
        let (begun, begins) = channel();
        for _ in 0..3 * THREADS {
            let (blocked, begun) = (Arc::clone(&blocked), begun.clone());
            let call = files.run(move || {
                let _ = begun.send(());
                let _ = blocked.lock().map(|blocked| blocked.recv());
            });
            assert_eq!(call.await, Err(FolderError::NoAnswer));
        }
        assert!(begins.try_iter().count() <= THREADS, "threads are limited");
        // The folder answers again: the calls return, and others are served.
        drop(dead);
        let patient = Files {
            calls: files.calls.clone(),
            answer_time: Duration::from_secs(60),
        };
        assert_eq!(patient.run(|| 7).await, Ok(7));
    }

    #[tokio::test]
    async fn a_panic_is_an_error_and_its_thread_goes_on() {
        let files = files(Duration::from_secs(60));
        for _ in 0..2 * THREADS {
            let failed = files.run(|| panic!("a call that fails")).await;
            assert_eq!(failed, Err::<(), _>(FolderError::Panicked));
        }
        assert_eq!(files.run(|| 7).await, Ok(7));
    }
}

//! Calls of the file system for clients. On a network folder whose server does not answer, a call may take for ever: it must block neither
//! the tasks that serve clients nor the threads that serve runs.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::Semaphore;

/// Calls at the same time. A call that does not return keeps its place.
const CALLS: usize = 4;
/// Time in which a call returns, with its wait for a place.
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

/// The calls for clients.
#[derive(Debug)]
pub struct Files {
    places: Arc<Semaphore>,
    answer_time: Duration,
}

impl Default for Files {
    fn default() -> Files {
        Files {
            places: Arc::new(Semaphore::new(CALLS)),
            answer_time: ANSWER_TIME,
        }
    }
}

impl Files {
    /// The result of work on files, on a thread of its own.
    ///
    /// # Errors
    /// When it does not end in time; its thread is left alone.
    pub async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, FolderError> {
        let done = async {
            let place = Arc::clone(&self.places).acquire_owned().await;
            let place = place.map_err(|_| FolderError::NoAnswer)?;
            // The place returns with the result: then the thread is free for the next call. With the place given back by the call
            // itself, the next call begins another thread, and the locked memory grows by a stack each time.
            let done = tokio::task::spawn_blocking(move || (work(), place));
            let (result, _place) = done.await.map_err(|_| FolderError::Panicked)?;
            Ok(result)
        };
        let in_time = tokio::time::timeout(self.answer_time, done).await;
        in_time.unwrap_or(Err(FolderError::NoAnswer))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

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
        let blocked = Arc::new(std::sync::Mutex::new(blocked));
        let (begun, begins) = channel();
        for _ in 0..3 * CALLS {
            let (blocked, begun) = (Arc::clone(&blocked), begun.clone());
            let call = files.run(move || {
                let _ = begun.send(());
                let _ = blocked.lock().map(|blocked| blocked.recv());
            });
            assert_eq!(call.await, Err(FolderError::NoAnswer));
        }
        assert!(begins.try_iter().count() <= CALLS, "threads are limited");
        // The folder answers again: the calls return, and others are served.
        drop(dead);
        let patient = Files {
            places: Arc::clone(&files.places),
            answer_time: Duration::from_secs(60),
        };
        assert_eq!(patient.run(|| 7).await, Ok(7));
    }
}

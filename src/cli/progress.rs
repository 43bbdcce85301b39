//! Progress on standard error, on a terminal only.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use bench_base::progress::{Progress, Snapshot};

/// Interval between two updates of the line.
const INTERVAL: Duration = Duration::from_millis(100);

/// Shows a [`Progress`] until it is dropped, if standard error is a terminal.
pub(super) struct ProgressLine {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl ProgressLine {
    pub(super) fn show(progress: &Progress) -> ProgressLine {
        let is_over = Arc::new(AtomicBool::new(false));
        let (progress, ends) = (progress.clone(), Arc::clone(&is_over));
        let thread = std::thread::Builder::new().name("bench-progress".into());
        // If the thread cannot be started, the line is omitted.
        let thread = std::io::stderr()
            .is_terminal()
            .then(|| thread.spawn(move || draw_until(&ends, &progress)).ok());
        ProgressLine {
            is_over,
            thread: thread.flatten(),
        }
    }
}

impl Drop for ProgressLine {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

fn draw_until(is_over: &AtomicBool, progress: &Progress) {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    while !is_over.load(Ordering::Relaxed) {
        draw(&bar, &progress.snapshot());
        std::thread::park_timeout(INTERVAL);
    }
    bar.finish_and_clear();
}

fn draw(bar: &ProgressBar, seen: &Snapshot) {
    let template = match seen.total {
        0 => "{spinner} {prefix}  {msg}",
        _ => "{prefix} [{bar:24}] {percent:>3} %  {msg}",
    };
    let style = ProgressStyle::with_template(template);
    bar.set_style(
        style
            .unwrap_or_else(|_| ProgressStyle::default_bar())
            .progress_chars("=> "),
    );
    bar.set_length(seen.total.max(1));
    bar.set_position(seen.done);
    bar.set_prefix(seen.stage);
    bar.set_message(times(seen));
    bar.tick();
}

/// `12 s, 30 s left`, or the elapsed time alone if the remaining time is unknown.
fn times(seen: &Snapshot) -> String {
    let elapsed = seconds(seen.elapsed);
    match seen.remaining() {
        Some(left) => format!("{elapsed}, {} left", seconds(left)),
        None => elapsed,
    }
}

fn seconds(time: Duration) -> String {
    match time.as_secs() {
        0 => "<1 s".into(),
        seconds @ 1..120 => format!("{seconds} s"),
        seconds @ 120..7200 => format!("{} min", seconds / 60),
        seconds => format!("{} h {} min", seconds / 3600, seconds % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shows_no_remaining_time_before_the_first_step() {
        let after = |done, total, seconds| Snapshot {
            stage: "figures",
            done,
            total,
            elapsed: Duration::from_secs(seconds),
        };
        assert_eq!(times(&after(0, 10, 7)), "7 s");
        assert_eq!(times(&after(5, 10, 7)), "7 s, 7 s left");
        assert_eq!(times(&after(9, 10, 600)), "10 min, 66 s left");
    }
}

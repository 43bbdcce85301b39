//! Progress with time left, on a terminal only.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A line on standard error that shows how far a run is; silent where nobody watches.
pub(super) struct Progress(ProgressBar);

impl Progress {
    pub(super) fn new(what: &'static str) -> Self {
        let shown = std::io::stderr().is_terminal();
        let target = if shown {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let template = "{msg} [{bar:40}] {percent:>3} %  {elapsed} gone, {eta} left";
        let style =
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        Progress(
            ProgressBar::with_draw_target(Some(1), target)
                .with_style(style.progress_chars("=> "))
                .with_message(what),
        )
    }

    pub(super) fn show(&self, done: u64, total: u64) {
        self.0.set_length(total.max(1));
        self.0.set_position(done);
    }

    pub(super) fn close(&self) {
        self.0.finish_and_clear();
    }
}

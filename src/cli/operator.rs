//! The operator at the terminal: questions go to standard error, answers come from standard input.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use super::error::CliError;
use super::output::print_message;
use super::table::wrap;
use bench_base::quantity::Quantity;
use bench_experiment::campaign::{Operator, Question, Reply};

/// Interval of checks for Ctrl-C while waiting for an answer.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);

/// Asks at the terminal. The end of the input, or `stop` being set, is the answer `stop`.
pub(super) struct TerminalOperator<'a> {
    stop: &'a AtomicBool,
    beam_length_m: Option<f64>,
    lines: Receiver<String>,
}

impl<'a> TerminalOperator<'a> {
    pub fn new(
        stop: &'a AtomicBool,
        beam_length_m: Option<f64>,
    ) -> Result<TerminalOperator<'a>, CliError> {
        TerminalOperator::of(stop, beam_length_m, || {
            std::io::stdin().lines().map_while(Result::ok)
        })
    }

    /// An operator who types these lines. A thread reads each line when it is typed, so that a line typed before a question
    /// can be distinguished from an answer.
    fn of<L: Iterator<Item = String>>(
        stop: &'a AtomicBool,
        beam_length_m: Option<f64>,
        typed: impl FnOnce() -> L + Send + 'static,
    ) -> Result<TerminalOperator<'a>, CliError> {
        let (sender, lines) = channel();
        // The thread ends with the input or with the process: a read cannot be interrupted.
        let read = move || drop(typed().try_for_each(|line| sender.send(line)));
        let thread = std::thread::Builder::new().name("bench-answers".into());
        thread.spawn(read).map_err(|e| {
            CliError::Failed(format!(
                "cannot wait for answers: {e}; start the command again"
            ))
        })?;
        Ok(TerminalOperator {
            stop,
            beam_length_m,
            lines,
        })
    }

    /// A line; none at the end of the input, or if the operator stops the command.
    fn line(&self) -> Option<String> {
        while !self.stop.load(Ordering::Relaxed) {
            match self.lines.recv_timeout(CHECK_INTERVAL) {
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        None
    }
}

impl Operator for TerminalOperator<'_> {
    fn ask(&mut self, question: &Question) -> Reply {
        // Lines typed during a run are not answers.
        while self.lines.try_recv().is_ok() {}
        self.report(&question.text);
        loop {
            print_message(&format!("{}: ", wrap(&choices(question), 2).trim_end()));
            let Some(line) = self.line() else {
                return Reply::Stop;
            };
            match reply(&line, question, self.beam_length_m) {
                Ok(reply) => return reply,
                Err(why) => print_message(&wrap(&why, 2)),
            }
        }
    }

    fn report(&mut self, text: &str) {
        print_message(&wrapped(&format!("bench: {text}")));
    }
}

/// Each line wrapped below its own indentation.
fn wrapped(text: &str) -> String {
    let indent = |line: &str| line.len() - line.trim_start().len();
    text.lines().map(|line| wrap(line, indent(line))).collect()
}

/// The answers that a question accepts.
fn choices(question: &Question) -> String {
    let mut choices = vec!["Enter when done"];
    if question.may_read {
        choices.push("instead the displacement in Y, if you measured it (for example 3.80mm)");
    }
    if question.may_confirm {
        choices.push("`right` to confirm the load");
    }
    if question.may_skip {
        choices.push("`skip` to leave this point out");
    }
    choices.push("`stop` to end the campaign and continue it later");
    choices.join(", ")
}

/// The meaning of an answer, or why it is not accepted.
fn reply(line: &str, question: &Question, beam_length_m: Option<f64>) -> Result<Reply, String> {
    let line = line.trim();
    let reply = match line.to_ascii_lowercase().as_str() {
        "" => Some(Reply::Done(None)),
        "stop" => Some(Reply::Stop),
        "skip" if question.may_skip => Some(Reply::Skip),
        "right" if question.may_confirm => Some(Reply::Right),
        _ if question.may_read => displacement_m(line, beam_length_m).map(|m| Reply::Done(Some(m))),
        _ => None,
    };
    reply.ok_or_else(|| refusal(line, question))
}

/// Why a line is not an answer.
fn refusal(line: &str, question: &Question) -> String {
    let is_number = line.parse::<f64>().is_ok_and(f64::is_finite);
    if question.may_read && is_number {
        return format!("`{line}` has no unit; type {line}mm or {line}um");
    }
    format!(
        "`{line}` is not an answer to this question; give {}",
        choices(question)
    )
}

/// A displacement with its unit. A bare number is refused: it may be in millimetres or in metres.
fn displacement_m(text: &str, beam_length_m: Option<f64>) -> Option<f64> {
    let typed: Quantity = text.parse().ok()?;
    if typed.is_bare() {
        return None;
    }
    typed.operating_point_m(beam_length_m).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn question(all: bool) -> Question {
        Question {
            text: String::new(),
            may_read: all,
            may_confirm: all,
            may_skip: all,
        }
    }

    #[test]
    fn ignores_lines_typed_before_the_question() {
        let (ended, all_read) = channel();
        let (input, open) = channel::<()>();
        let lines = (0..5).map(|_| String::new());
        let end = std::iter::from_fn(move || {
            let sent = ended.send(());
            // Until the input ends.
            sent.ok().and(open.recv().ok()).map(|()| String::new())
        });
        let stop = AtomicBool::new(false);
        let mut operator =
            TerminalOperator::of(&stop, None, || lines.chain(end)).expect("a thread");
        let patience = Duration::from_secs(60);
        all_read
            .recv_timeout(patience)
            .expect("each line is taken when it is typed");
        drop(input);
        assert_eq!(
            operator.ask(&question(true)),
            Reply::Stop,
            "five times Enter, and then the end of the input"
        );
    }

    #[test]
    fn accepts_offered_answers_only() {
        let open = |line| reply(line, &question(true), Some(0.05));
        let done = |m| Ok(Reply::Done(Some(m)));
        assert_eq!(
            [open(""), open(" "), open("stop")],
            [
                Ok(Reply::Done(None)),
                Ok(Reply::Done(None)),
                Ok(Reply::Stop)
            ]
        );
        assert_eq!(
            [open("Skip"), open(" right ")],
            [Ok(Reply::Skip), Ok(Reply::Right)]
        );
        assert_eq!(
            [open("3.5mm"), open("-2mm"), open("8%")],
            [done(0.0035), done(-0.002), done(0.004)]
        );
        let error = open("3.8").unwrap_err();
        assert_eq!(error, "`3.8` has no unit; type 3.8mm or 3.8um");
        for line in ["yes", "nan", "infmm", "skip it"] {
            assert!(
                open(line)
                    .unwrap_err()
                    .contains("is not an answer to this question; give Enter when done"),
                "{line}"
            );
        }
        for line in ["skip", "right", "3.5mm"] {
            assert!(
                reply(line, &question(false), Some(0.05)).is_err(),
                "{line} is not offered"
            );
        }
    }
}

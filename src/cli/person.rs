//! The person at the terminal: questions go to standard error, answers come from standard input.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use super::error::CliError;
use crate::experiment::campaign::{Person, Question, Reply};
use crate::util::quantity::Quantity;

/// Ctrl-C is looked for so often while an answer is waited for.
const LOOK: Duration = Duration::from_millis(100);

/// Asks at the terminal. An end of input, or `stop` being set, is the answer `stop`.
pub(super) struct AtTerminal<'a> {
    stop: &'a AtomicBool,
    beam_length_m: Option<f64>,
    lines: Receiver<String>,
}

impl<'a> AtTerminal<'a> {
    pub fn new(
        stop: &'a AtomicBool,
        beam_length_m: Option<f64>,
    ) -> Result<AtTerminal<'a>, CliError> {
        AtTerminal::of(stop, beam_length_m, || {
            std::io::stdin().lines().map_while(Result::ok)
        })
    }

    /// Of these lines, which a thread of its own takes as they come, asked for or not: what waits to be taken could not be told
    /// from an answer.
    fn of<L: Iterator<Item = String>>(
        stop: &'a AtomicBool,
        beam_length_m: Option<f64>,
        typed: impl FnOnce() -> L + Send + 'static,
    ) -> Result<AtTerminal<'a>, CliError> {
        let (tell, lines) = channel();
        // Ends with the input, or with the process: a read cannot be broken off.
        let read = move || typed().try_for_each(|line| tell.send(line));
        let thread = std::thread::Builder::new().name("bench-answers".into());
        let started = thread.spawn(move || drop(read()));
        started.map_err(|e| {
            CliError::Failed(format!("cannot wait for answers: {e}; start it again"))
        })?;
        Ok(AtTerminal {
            stop,
            beam_length_m,
            lines,
        })
    }

    /// A line; none at the end of input, or where the person stops the command.
    fn line(&self) -> Option<String> {
        while !self.stop.load(Ordering::Relaxed) {
            match self.lines.recv_timeout(LOOK) {
                Ok(line) => return Some(line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return None,
            }
        }
        None
    }
}

impl Person for AtTerminal<'_> {
    fn ask(&mut self, question: &Question) -> Reply {
        // What was typed during a run answers nothing.
        while self.lines.try_recv().is_ok() {}
        self.tell(&question.text);
        loop {
            eprint!("  {}: ", choices(question));
            // An answer can be given all the same.
            let _ = std::io::stderr().flush();
            let Some(line) = self.line() else {
                return Reply::Stop;
            };
            match reply(&line, question, self.beam_length_m) {
                Ok(reply) => return reply,
                Err(why) => eprintln!("  {why}"),
            }
        }
    }

    fn tell(&mut self, text: &str) {
        eprintln!("bench: {text}");
    }
}

fn choices(question: &Question) -> String {
    let choices = [
        (true, "Enter when it is done"),
        (
            question.may_read,
            "with the displacement in Y if you can read it, as 3.80mm",
        ),
        (question.may_confirm, "`right` if it is right all the same"),
        (question.may_skip, "`skip` to leave the point out"),
        (true, "`stop`"),
    ];
    choices
        .into_iter()
        .filter(|(offered, _)| *offered)
        .map(|(_, words)| words)
        .collect::<Vec<_>>()
        .join(", ")
}

/// An answer; why it is none.
fn reply(line: &str, question: &Question, beam_length_m: Option<f64>) -> Result<Reply, String> {
    let line = line.trim();
    match line {
        "" => return Ok(Reply::Done(None)),
        "stop" => return Ok(Reply::Stop),
        "skip" if question.may_skip => return Ok(Reply::Skip),
        "right" if question.may_confirm => return Ok(Reply::Right),
        _ => {}
    }
    // A bare number may be millimetres or metres.
    let read: Option<Quantity> = line.parse().ok();
    let read = read.filter(|read| question.may_read && !read.is_bare());
    let read_m = read.and_then(|read| read.operating_point_m(beam_length_m).ok());
    read_m
        .map(|m| Reply::Done(Some(m)))
        .ok_or_else(|| format!("`{line}` is no answer here; {}", choices(question)))
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
    fn what_was_typed_during_a_run_answers_no_question_however_much_it_was() {
        let (ended, all_read) = channel();
        let (input, open) = channel::<()>();
        let lines = (0..5).map(|_| String::new());
        let end = std::iter::from_fn(move || {
            let told = ended.send(());
            // Until the input ends.
            told.ok().and(open.recv().ok()).map(|()| String::new())
        });
        let stop = AtomicBool::new(false);
        let mut person = AtTerminal::of(&stop, None, || lines.chain(end)).expect("a thread");
        let patience = Duration::from_secs(60);
        all_read
            .recv_timeout(patience)
            .expect("each line is taken when it is typed");
        drop(input);
        assert_eq!(
            person.ask(&question(true)),
            Reply::Stop,
            "five times Enter, and then the end of the input"
        );
    }

    #[test]
    fn an_answer_is_taken_where_it_is_offered_and_nothing_else_is() {
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
            [open("skip"), open(" right ")],
            [Ok(Reply::Skip), Ok(Reply::Right)]
        );
        assert_eq!(
            [open("3.5mm"), open("-2mm"), open("8%")],
            [done(0.0035), done(-0.002), done(0.004)]
        );
        for line in ["3.8", "yes", "nan", "infmm", "skip it"] {
            assert!(
                open(line)
                    .unwrap_err()
                    .contains("is no answer here; Enter when it is done"),
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

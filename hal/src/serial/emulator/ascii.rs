//! A pretend probe that writes its values: sends a line at each measurement, or at each request.

use super::fault::{Ailing, Fault};
use super::{EmulatedProbe, Sampler};
use crate::serial::ascii::{Statement, Writing};

/// Longest request worth remembering: what is longer is not known.
const HEARD_MAX: usize = 64;

/// The device's side of [`crate::serial::ascii`].
#[derive(Debug)]
pub struct AsciiDevice {
    writing: Writing,
    sampler: Sampler,
    newest_m: f64,
    heard: Vec<u8>,
    ailing: Ailing,
    /// The next line loses its first half: the probe has restarted in the middle of it.
    cut: bool,
}

impl AsciiDevice {
    /// A probe just switched on.
    pub fn new(writing: Writing, rate_hz: f64) -> Self {
        let (sampler, ailing) = (Sampler::new(rate_hz), Ailing::default());
        Self {
            writing,
            sampler,
            newest_m: 0.0,
            heard: Vec::new(),
            ailing,
            cut: false,
        }
    }

    /// Makes the measurements that are due; returns their lines if the probe speaks by itself.
    fn measure(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        let mut lines = Vec::new();
        let (lower_m, upper_m) = (self.writing.settings.lower_m, self.writing.settings.upper_m);
        for _ in 0..self.sampler.due(now_ns) {
            self.newest_m = self
                .ailing
                .measure(position_m, upper_m + 2.0 * (upper_m - lower_m));
            if self.writing.request().is_none() {
                lines.extend(self.line());
            }
        }
        lines
    }

    fn line(&mut self) -> Vec<u8> {
        let line = self.writing.write(Statement::Metres(self.newest_m));
        let lost = if std::mem::take(&mut self.cut) {
            line.len() / 2
        } else {
            0
        };
        line[lost..].to_vec()
    }

    /// The answers to what the host sent: a line to each request, the error of an unknown command to anything else.
    fn answer(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut answers = Vec::new();
        for &byte in bytes {
            self.heard.push(byte);
            if self.writing.request() == Some(&self.heard) {
                answers.extend(self.line());
                self.heard.clear();
            } else if byte == b'\r' || byte == b'\n' || self.heard.len() >= HEARD_MAX {
                answers.extend(self.writing.write(Statement::Error(0)));
                self.heard.clear();
            }
        }
        answers
    }
}

impl EmulatedProbe for AsciiDevice {
    fn handle(&mut self, bytes: &[u8], now_ns: u64, position_m: f64) -> Vec<u8> {
        let mut lines = self.measure(now_ns, position_m);
        lines.extend(self.answer(bytes));
        self.ailing.send(lines, now_ns)
    }

    fn poll(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        let lines = self.measure(now_ns, position_m);
        self.ailing.send(lines, now_ns)
    }

    fn due_ns(&self) -> Option<u64> {
        self.sampler.next_ns
    }

    fn inject_fault(&mut self, fault: Fault) {
        if fault == Fault::Reset {
            self.heard.clear();
            self.cut = true;
        }
        self.ailing.ask(fault);
    }
}

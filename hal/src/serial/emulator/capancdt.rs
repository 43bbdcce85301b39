//! A pretend capaNCDT 61xx: measures at its rate, keeps the newest twenty, hands them over when asked.

use std::collections::VecDeque;

use super::fault::{Ailing, Fault};
use super::{EmulatedProbe, Sampler};
use crate::serial::capancdt::{BATCH_MAX, CounterMeaning, Settings};

/// The device's side of [`crate::serial::capancdt`].
#[derive(Debug)]
pub struct CapancdtDevice {
    settings: Settings,
    sampler: Sampler,
    /// Number of the next measurement.
    counter: u16,
    unsent: VecDeque<i32>,
    /// The end of what the host sent, as long as a request.
    heard: VecDeque<u8>,
    ailing: Ailing,
}

impl CapancdtDevice {
    /// A probe just switched on.
    pub fn new(settings: Settings, rate_hz: f64) -> Self {
        let (unsent, heard) = (VecDeque::new(), VecDeque::new());
        Self {
            settings,
            sampler: Sampler::new(rate_hz),
            counter: 0,
            unsent,
            heard,
            ailing: Ailing::default(),
        }
    }

    fn measure(&mut self, now_ns: u64, position_m: f64) {
        for _ in 0..self.sampler.due(now_ns) {
            let measured_m = self.ailing.measure(position_m, 2.0 * self.settings.range_m);
            self.unsent.push_back(self.settings.counts(measured_m));
            keep_newest(&mut self.unsent, BATCH_MAX);
            self.counter = self.counter.wrapping_add(1);
        }
    }

    fn is_asked(&mut self, byte: u8) -> bool {
        let request = self.settings.request();
        self.heard.push_back(byte);
        keep_newest(&mut self.heard, request.len());
        self.heard.iter().eq(&request)
    }

    fn answer(&mut self) -> Vec<u8> {
        let values = Vec::from(std::mem::take(&mut self.unsent));
        let number = match self.settings.counter {
            CounterMeaning::NewestValue => self.counter.wrapping_sub(1),
            CounterMeaning::OldestValue => self.counter.wrapping_sub(values.len() as u16),
        };
        self.settings.answer(number, &values)
    }
}

/// Drops the oldest until `len` are left.
fn keep_newest<T>(queue: &mut VecDeque<T>, len: usize) {
    queue.drain(..queue.len().saturating_sub(len));
}

impl EmulatedProbe for CapancdtDevice {
    fn handle(&mut self, bytes: &[u8], now_ns: u64, position_m: f64) -> Vec<u8> {
        self.measure(now_ns, position_m);
        let mut answers = Vec::new();
        for &byte in bytes {
            if self.is_asked(byte) {
                answers.extend(self.answer());
            }
        }
        self.ailing.send(answers, now_ns)
    }

    fn poll(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        self.measure(now_ns, position_m);
        self.ailing.send(Vec::new(), now_ns)
    }

    fn due_ns(&self) -> Option<u64> {
        self.sampler.next_ns
    }

    fn inject_fault(&mut self, fault: Fault) {
        if fault == Fault::Reset {
            self.counter = 0;
            self.unsent.clear();
            self.heard.clear();
        }
        self.ailing.ask(fault);
    }
}

//! Requests to the loop.

use std::error::Error;

use bench_rt::program::Program;
use bench_rt::request::{Request, RequestSender};
use rtrb::Consumer;

use super::faults::Period;
use super::programs::Programs;

/// Starts the runs, and frees the programs that have ended.
pub struct Supervisor {
    pub requests: RequestSender,
    pub retired: Consumer<Box<dyn Program>>,
    pub programs: Programs,
}

impl Supervisor {
    /// Clears the trip of the period before and starts the first run.
    pub fn begin_period(&mut self, period: &Period) -> Result<(), Box<dyn Error>> {
        self.send(Request::Clear)?;
        let program = self.programs.first(period)?;
        self.start(program)
    }

    /// Starts the run that the fault of the period ends.
    pub fn begin_second_run(&mut self, period: &Period) -> Result<(), Box<dyn Error>> {
        let program = self.programs.second(period)?;
        self.start(program)
    }

    fn start(&mut self, program: Box<dyn Program>) -> Result<(), Box<dyn Error>> {
        while self.retired.pop().is_ok() {}
        self.send(Request::Arm)?;
        self.send(Request::Start(program))
    }

    fn send(&mut self, request: Request) -> Result<(), Box<dyn Error>> {
        let sent = self.requests.send(request);
        sent.map_err(|_| "the ring of requests is full: the loop does not take them")?;
        Ok(())
    }
}

//! The recorder thread: writes each period into a file, checks it, and removes it.

use std::collections::BTreeMap;
use std::error::Error;
use std::hash::{DefaultHasher, Hasher};
use std::thread::JoinHandle;
use std::time::Duration;

use bench_config::Config;
use bench_recording::{Header, Recorder, RecordingError};
use bench_rt::arming::State;
use bench_rt::record::{Event, EventKind, LoopMessage, Origin, RequestEvent, TickRecord};
use bench_rt::thread::Pace;
use rtrb::Consumer;
use tempfile::TempDir;

use super::faults::{Period, Schedule};
use super::resources::Resources;

/// Pause when the ring is empty.
const PAUSE: Duration = Duration::from_millis(1);
/// Time between two lines of the report, in seconds of the loop.
const REPORT_S: f64 = 3600.0;
/// In real time, other programs may delay the loop: accepted share of periods that end early by missed ticks.
const MAX_DISTURBED_RATIO: f64 = 0.1;

/// What happened in the open period.
#[derive(Default)]
struct Observed {
    completed: u64,
    ticks_with_current: u64,
    ticks_with_wrong_current: u64,
    trips: Vec<(u64, &'static str)>,
    /// Requests that were refused, or that the loop made itself.
    unusual: Vec<(u64, RequestEvent)>,
}

/// The results of a soak.
#[derive(Default)]
pub struct Report {
    ticks: u64,
    periods: u64,
    disturbed: u64,
    trips: BTreeMap<&'static str, u64>,
    digest: DefaultHasher,
    warm: Resources,
    last: Resources,
    failures: Vec<String>,
}

/// The recorder.
pub struct SoakRecorder {
    schedule: Schedule,
    header: Header,
    folder: TempDir,
    pace: Pace,
    report: Report,
}

/// A period with its file.
struct OpenPeriod {
    period: Period,
    recorder: Recorder,
    observed: Observed,
}

/// The report of a recorder that has ended.
pub fn joined(recorder: JoinHandle<Report>) -> Result<Report, Box<dyn Error>> {
    Ok(recorder.join().map_err(|_| "the recorder panicked")?)
}

impl SoakRecorder {
    /// A recorder with a folder for its files, which it removes.
    pub fn new(
        config: &Config,
        schedule: Schedule,
        pace: Pace,
    ) -> Result<SoakRecorder, Box<dyn Error>> {
        let header = Header {
            period_s: config.servo.period_s(),
            ..Header::default()
        };
        Ok(SoakRecorder {
            schedule,
            header,
            folder: tempfile::tempdir()?,
            pace,
            report: Report::default(),
        })
    }

    /// Empties the ring until the loop has ended.
    pub fn run(mut self, ring: Consumer<LoopMessage>) -> Report {
        if let Err(error) = self.record_all(ring) {
            self.report.fail(format!("recording: {error}"));
        }
        self.report
    }

    fn record_all(&mut self, mut ring: Consumer<LoopMessage>) -> Result<(), Box<dyn Error>> {
        let mut open = self.open(0)?;
        loop {
            let ended = ring.is_abandoned();
            while let Ok(message) = ring.pop() {
                let number = self.schedule.number(tick_of(&message));
                if number != open.period.number {
                    self.close(std::mem::replace(&mut open, self.open(number)?))?;
                }
                open.take(&message)?;
            }
            if ended {
                return self.close(open);
            }
            std::thread::sleep(PAUSE);
        }
    }

    fn open(&self, number: u64) -> Result<OpenPeriod, RecordingError> {
        let path = self.folder.path().join(format!("{number}.mcap"));
        Ok(OpenPeriod {
            period: self.schedule.period(number),
            recorder: Recorder::create(&path, &self.header)?,
            observed: Observed::default(),
        })
    }

    fn close(&mut self, open: OpenPeriod) -> Result<(), Box<dyn Error>> {
        let totals = open.recorder.finish(&[])?;
        std::fs::remove_file(&totals.path)?;
        self.report.digest.write_u64(totals.loop_digest);
        self.report.ticks += totals.ticks;
        if totals.lost_records > 0 {
            let lost = totals.lost_records;
            let number = open.period.number;
            self.report
                .fail(format!("period {number}: {lost} records lost"));
        }
        self.report.judge(&open.period, &open.observed, self.pace);
        self.measure()
    }

    /// Measures the resources. Except at the end, the file of the next period is open.
    fn measure(&mut self) -> Result<(), Box<dyn Error>> {
        let report = &mut self.report;
        report.periods += 1;
        report.last = Resources::now()?;
        if report.periods <= self.schedule.periods.div_ceil(10) {
            report.warm = report.warm.max(report.last);
        } else if let Some(growth) = report.last.growth_since(report.warm) {
            report.fail(format!("period {}: {growth}", report.periods - 1));
        }
        let per_line = (REPORT_S / self.schedule.period_s()).max(1.0) as u64;
        if report.periods.is_multiple_of(per_line) {
            report.print_line(self.schedule.period_s());
        }
        Ok(())
    }
}

fn tick_of(message: &LoopMessage) -> u64 {
    match message {
        LoopMessage::Tick(record) => record.tick,
        LoopMessage::Event(event) => event.tick,
    }
}

impl OpenPeriod {
    fn take(&mut self, message: &LoopMessage) -> Result<(), RecordingError> {
        match message {
            LoopMessage::Tick(record) => self.observed.tick(record),
            LoopMessage::Event(event) => self.observed.event(event),
        }
        self.recorder.record(message)
    }
}

impl Observed {
    fn tick(&mut self, record: &TickRecord) {
        let has_current = record.command_a != 0.0;
        let may_have = matches!(record.state, State::Running | State::Settling);
        self.ticks_with_current += u64::from(has_current);
        self.ticks_with_wrong_current += u64::from(has_current && !may_have);
    }

    fn event(&mut self, event: &Event) {
        match event.kind {
            EventKind::Completed => self.completed += 1,
            EventKind::Trip(trip) => self.trips.push((event.tick, trip.reason())),
            EventKind::Request(request)
                if request.refusal.is_some() || request.origin != Origin::Supervisor =>
            {
                self.unusual.push((event.tick, request));
            }
            EventKind::Request(_)
            | EventKind::State { .. }
            | EventKind::Lost { .. }
            | EventKind::ResetFailed { .. }
            | EventKind::Override
            | EventKind::Clock(_) => {}
        }
    }

    /// What differs from the expectation, as text.
    fn defect(&self, period: &Period) -> Option<String> {
        let is_expected = |(tick, reason): &(u64, &str)| {
            period.trip.contains(tick) && *reason == period.case.reason
        };
        if self.trips.len() != 1 || !self.trips.iter().all(is_expected) {
            let (reason, ticks) = (period.case.reason, &period.trip);
            return Some(format!(
                "trips {:?} instead of one by {reason} in the ticks {ticks:?}; requests {:?}",
                self.trips, self.unusual
            ));
        }
        if self.completed != 1 || self.ticks_with_current == 0 {
            let (completed, ticks) = (self.completed, self.ticks_with_current);
            return Some(format!(
                "{completed} runs completed instead of one, {ticks} ticks with current"
            ));
        }
        let wrong = self.ticks_with_wrong_current;
        (wrong > 0).then(|| format!("{wrong} ticks with current without a run"))
    }

    /// Whether missed ticks ended a run that should have ended otherwise.
    fn is_disturbed(&self, period: &Period) -> bool {
        let late = self.trips.iter().any(|(_, reason)| *reason == "overruns");
        late && (self.trips.len() > 1 || period.case.reason != "overruns")
    }
}

impl Report {
    fn fail(&mut self, failure: String) {
        eprintln!("FAILED: {failure}");
        self.failures.push(failure);
    }

    fn judge(&mut self, period: &Period, observed: &Observed, pace: Pace) {
        for (_, reason) in &observed.trips {
            *self.trips.entry(reason).or_default() += 1;
        }
        let Some(defect) = observed.defect(period) else {
            return;
        };
        let defect = format!("period {}: {defect}", period.number);
        match pace {
            Pace::Realtime if observed.is_disturbed(period) => {
                eprintln!("the machine was too slow: {defect}");
                self.disturbed += 1;
            }
            Pace::Realtime | Pace::Virtual => self.fail(defect),
        }
    }

    fn print_line(&self, period_s: f64) {
        println!(
            "{:8.2} h  {} ticks  {}  trips {:?}",
            self.periods as f64 * period_s / 3600.0,
            self.ticks,
            self.last,
            self.trips
        );
    }

    /// Prints the results; returns whether everything went as required.
    pub fn print(mut self, is_realtime: bool) -> bool {
        if self.disturbed as f64 > MAX_DISTURBED_RATIO * self.periods as f64 {
            let disturbed = self.disturbed;
            self.fail(format!(
                "missed ticks ended {disturbed} periods early; run on an idle machine"
            ));
        }
        let trips: u64 = self.trips.values().sum();
        println!(
            "{} ticks, {} periods, {trips} trips:",
            self.ticks, self.periods
        );
        for (reason, count) in &self.trips {
            println!("  {reason:<24}{count:>6}");
        }
        println!("after the warm-up  {}", self.warm);
        println!("at the end         {}", self.last);
        if !is_realtime {
            println!("digest {:016x}", self.digest.finish());
        }
        println!("{} failures", self.failures.len());
        self.failures.is_empty()
    }
}

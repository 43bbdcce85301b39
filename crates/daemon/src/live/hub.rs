//! The thread that follows the loop and serves all clients: it reads the rings, and publishes samples, events and the status.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use bytes::Bytes;
use tokio::sync::broadcast;

use super::event_text::EventView;
use super::frame::{Frame, Sample, sample};
use super::history::History;
use super::response::ResponseView;
use super::status::{LatenessTotals, Status};
pub use super::status::{LoopView, Share, TripView};
use bench_base::thread_priority::lower;
use bench_base::timestamp::unix_ns;
use bench_config::Config;
use bench_experiment::{Feed, FeedSender, FeedSource, RunKind};
use bench_identify::GrowingResponse;
use bench_recording::{EncodedMessage, LiveEncoder};
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord, flag};

/// Period of the thread.
const PERIOD: Duration = Duration::from_millis(5);
/// Time between two frames of samples.
const FRAME: Duration = Duration::from_millis(50);
/// Time between two views of the status.
const STATUS: Duration = Duration::from_millis(200);
/// Messages that a slow client may be behind: 12 s of frames.
const BACKLOG: usize = 256;
/// Events that a new client gets.
const KEPT_EVENTS: usize = 200;
/// Less urgent than the recorder's source, the loop, and as urgent as the recorder.
const NICE: i32 = 10;

/// Somebody who takes the messages of the recordings while the loop goes on. It must not block.
pub trait Viewer: Send {
    /// Takes a message.
    fn show(&self, message: &EncodedMessage);
}

/// A message to all clients.
#[derive(Clone, Debug)]
pub enum LiveMessage {
    /// Samples, encoded as in [`Frame::encode`].
    Samples(Bytes),
    /// An event.
    Event(Arc<EventView>),
    /// The response of the stage so far.
    Response(Arc<ResponseView>),
}

/// The status at one moment.
#[derive(Clone, Debug, Default)]
pub struct LiveSnapshot {
    /// The loop.
    pub servo: LoopView,
    /// Shares of the interlocks.
    pub shares: Vec<Share>,
    /// The last trip that is not acknowledged.
    pub trip: Option<TripView>,
    /// Lateness of all ticks.
    pub lateness: LatenessTotals,
    /// Trips by reason.
    pub trips: BTreeMap<&'static str, u64>,
    /// The last events, oldest first.
    pub events: VecDeque<Arc<EventView>>,
    /// The response of the stage during the last chirp.
    pub response: Option<Arc<ResponseView>>,
}

/// The run to which the next messages belong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LiveRun {
    /// Its number.
    pub number: u32,
    /// Its kind.
    pub kind: RunKind,
}

/// The hub. Dropping it ends its thread.
pub struct LiveHub {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    snapshot: Mutex<LiveSnapshot>,
    messages: broadcast::Sender<LiveMessage>,
    history: Mutex<History>,
    ticks: AtomicU64,
    run: Mutex<Option<LiveRun>>,
    ends: AtomicBool,
}

impl LiveHub {
    /// Starts the thread. `sender` counts the messages that it could not take. `viewer` takes what recordings contain.
    ///
    /// # Errors
    /// When the system refuses the thread.
    pub fn start(
        config: &Config,
        feeds: Receiver<Feed>,
        sender: FeedSender,
        viewer: Option<Box<dyn Viewer>>,
    ) -> std::io::Result<LiveHub> {
        let shared = Arc::new(Shared {
            snapshot: Mutex::default(),
            messages: broadcast::Sender::new(BACKLOG),
            history: Mutex::default(),
            ticks: AtomicU64::new(0),
            run: Mutex::default(),
            ends: AtomicBool::new(false),
        });
        let mut follower = Follower::new(config, sender, viewer, Arc::clone(&shared));
        follower.show();
        let builder = std::thread::Builder::new().name("bench-live".into());
        let thread = builder.spawn(move || follower.serve(&feeds))?;
        Ok(LiveHub {
            shared,
            thread: Some(thread),
        })
    }

    /// The status at this moment.
    pub fn snapshot(&self) -> LiveSnapshot {
        self.shared.snapshot().clone()
    }

    /// Messages from now on.
    pub fn messages(&self) -> broadcast::Receiver<LiveMessage> {
        self.shared.messages.subscribe()
    }

    /// The last ten minutes as messages with samples, oldest first.
    pub fn history(&self) -> Vec<Bytes> {
        lock(&self.shared.history).encode()
    }

    /// Ticks of the loop so far, to see whether it goes on.
    pub fn ticks(&self) -> u64 {
        self.shared.ticks.load(Ordering::Relaxed)
    }

    /// Sets the run to which the next messages belong.
    pub fn set_run(&self, run: LiveRun) {
        *lock(&self.shared.run) = Some(run);
    }

    /// The operator has seen the trip.
    pub fn acknowledge_trip(&self) {
        self.shared.snapshot().trip = None;
    }
}

impl Drop for LiveHub {
    fn drop(&mut self) {
        self.shared.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic has been printed
        }
    }
}

impl Shared {
    fn snapshot(&self) -> MutexGuard<'_, LiveSnapshot> {
        lock(&self.snapshot)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A feed that is being read, with its place in the time of the daemon.
struct OpenFeed {
    feed: Feed,
    /// `None` between two runs.
    run: Option<LiveRun>,
    /// Time of its tick 0 in seconds since the daemon started; `None` before its first tick.
    begin_s: Option<f64>,
    /// Encodes its messages for the viewer.
    encoder: LiveEncoder,
}

impl OpenFeed {
    /// Number of the run; 0 between two runs.
    fn number(&self) -> u32 {
        self.run.map_or(0, |run| run.number)
    }

    /// Whether its ring is empty and will remain so.
    fn has_ended(&self) -> bool {
        // In this order: what was pushed before the ring was abandoned is then in it.
        self.feed.messages.is_abandoned() && self.feed.messages.is_empty()
    }

    fn is_of(&self, kind: RunKind) -> bool {
        self.run.is_some_and(|run| run.kind == kind)
    }
}

/// The state of the thread.
struct Follower {
    status: Status,
    sender: FeedSender,
    viewer: Option<Box<dyn Viewer>>,
    shared: Arc<Shared>,
    started: Instant,
    feeds: Vec<OpenFeed>,
    frame: Option<Frame>,
    /// The response of the stage during a chirp.
    growing: Option<GrowingResponse>,
    /// End of the last tick in seconds since the daemon started.
    end_s: f64,
    framed: Instant,
    shown: Instant,
}

impl Follower {
    fn new(
        config: &Config,
        sender: FeedSender,
        viewer: Option<Box<dyn Viewer>>,
        shared: Arc<Shared>,
    ) -> Follower {
        let started = Instant::now();
        Follower {
            status: Status::new(config),
            sender,
            viewer,
            shared,
            started,
            feeds: Vec::new(),
            frame: None,
            growing: None,
            end_s: 0.0,
            framed: started,
            shown: started,
        }
    }

    fn serve(&mut self, feeds: &Receiver<Feed>) {
        lower(NICE);
        while !self.shared.ends.load(Ordering::Relaxed) {
            self.take_feeds(feeds);
            self.read_feeds();
            self.publish();
            std::thread::sleep(PERIOD);
        }
    }

    fn take_feeds(&mut self, feeds: &Receiver<Feed>) {
        loop {
            match feeds.try_recv() {
                Ok(feed) => self.open(feed),
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return,
            }
        }
    }

    fn open(&mut self, feed: Feed) {
        let run = match feed.source {
            FeedSource::Run => *lock(&self.shared.run),
            FeedSource::Idle => None,
        };
        let feed = OpenFeed {
            encoder: LiveEncoder::new(feed.period_s, unix_ns(SystemTime::now())),
            feed,
            run,
            begin_s: None,
        };
        if feed.is_of(RunKind::Chirp) {
            self.growing = Some(GrowingResponse::new(1.0 / feed.feed.period_s));
            self.shared.snapshot().response = None;
        }
        self.feeds.push(feed);
    }

    /// Reads everything that is in the rings. A ring that is empty and abandoned is closed.
    fn read_feeds(&mut self) {
        let mut feeds = std::mem::take(&mut self.feeds);
        for feed in &mut feeds {
            while let Ok(message) = feed.feed.messages.pop() {
                self.show_viewer(&message, feed);
                match message {
                    LoopMessage::Tick(tick) => self.tick(&tick, feed),
                    LoopMessage::Event(event) => self.event(&event, feed),
                }
            }
        }
        for mut ended in feeds.extract_if(.., |feed| feed.has_ended()) {
            self.show_last(&mut ended);
        }
        self.feeds = feeds;
    }

    fn show_viewer(&self, message: &LoopMessage, feed: &mut OpenFeed) {
        let Some(viewer) = &self.viewer else {
            return;
        };
        for encoded in feed.encoder.encode(message) {
            viewer.show(&encoded);
        }
    }

    /// Shows what a recording contains after its last tick.
    fn show_last(&self, feed: &mut OpenFeed) {
        let (Some(viewer), Some(last)) = (&self.viewer, feed.encoder.finish()) else {
            return;
        };
        viewer.show(&last);
    }

    /// The time of a tick since the daemon started. Each run counts its ticks from 0: its first tick has the time of its arrival, or
    /// follows the tick before it. Afterwards the ticks count, so that a missing tick is a gap.
    fn time_s(&self, number: u64, feed: &mut OpenFeed) -> f64 {
        let period_s = feed.feed.period_s;
        let arrival_s = self.started.elapsed().as_secs_f64();
        let first_s = self.end_s.max(arrival_s) - number as f64 * period_s;
        let begin_s = feed.begin_s.get_or_insert(first_s);
        *begin_s + number as f64 * period_s
    }

    fn tick(&mut self, tick: &TickRecord, feed: &mut OpenFeed) {
        if tick.tick == 0 {
            self.status.begin();
        }
        let mut time_s = self.time_s(tick.tick, feed);
        if time_s < self.end_s - 0.5 * feed.feed.period_s {
            // The loop between two runs begins to count anew after each run.
            feed.begin_s = None;
            time_s = self.time_s(tick.tick, feed);
        }
        let is_closed = feed.is_of(RunKind::Control);
        self.status.tick(tick, is_closed);
        self.add_sample(sample(tick, is_closed), time_s, feed);
        if feed.is_of(RunKind::Chirp) {
            self.add_to_response(tick, feed.number());
        }
        self.end_s = time_s + feed.feed.period_s;
    }

    /// Adds a tick to the frame; a gap or another run begins a new frame.
    fn add_sample(&mut self, sample: Sample, time_s: f64, feed: &OpenFeed) {
        let (period_s, run) = (feed.feed.period_s, feed.number());
        lock(&self.shared.history).push(sample, time_s, period_s, run);
        let frame = self.frame.as_ref();
        if !frame.is_some_and(|frame| frame.continues(time_s, run)) {
            self.send_frame();
        }
        let frame = self
            .frame
            .get_or_insert_with(|| Frame::new(time_s, period_s, run));
        frame.push(sample);
    }

    /// Adds a tick of a chirp to the response, while the excitation is on.
    fn add_to_response(&mut self, tick: &TickRecord, run: u32) {
        let Some(growing) = self.growing.as_mut() else {
            return;
        };
        let is_usable = tick.flags & flag::ACTIVE != 0 && tick.position_m.is_finite();
        if !is_usable || !growing.push(tick.command_a, tick.position_m) {
            return;
        }
        let view = Arc::new(ResponseView::of(&growing.points(), run));
        self.shared.snapshot().response = Some(Arc::clone(&view));
        let _ = self.shared.messages.send(LiveMessage::Response(view));
    }

    fn send_frame(&mut self) {
        if let Some(frame) = self.frame.take().filter(|frame| !frame.is_empty()) {
            // Without clients there is no receiver.
            let _ = self
                .shared
                .messages
                .send(LiveMessage::Samples(frame.encode().into()));
        }
    }

    fn event(&mut self, event: &Event, feed: &mut OpenFeed) {
        let time_s = self.time_s(event.tick, feed);
        match event.kind {
            EventKind::Trip(trip) => {
                let mut snapshot = self.shared.snapshot();
                *snapshot.trips.entry(trip.reason()).or_default() += 1;
                snapshot.trip = Some(TripView::of(&trip, time_s, feed.number()));
            }
            // Between two runs nothing is recorded.
            EventKind::Lost { records } if feed.feed.source == FeedSource::Run => {
                self.status.lose(records);
            }
            EventKind::Lost { .. }
            | EventKind::Request(_)
            | EventKind::State { .. }
            | EventKind::ResetFailed { .. }
            | EventKind::Completed
            | EventKind::Override
            | EventKind::Clock(_) => {}
        }
        let Some(view) = EventView::of(event, time_s, feed.number()).map(Arc::new) else {
            return;
        };
        let _ = self
            .shared
            .messages
            .send(LiveMessage::Event(Arc::clone(&view)));
        let mut snapshot = self.shared.snapshot();
        snapshot.events.push_back(view);
        if snapshot.events.len() > KEPT_EVENTS {
            snapshot.events.pop_front();
        }
    }

    fn publish(&mut self) {
        self.shared
            .ticks
            .store(self.status.ticks(), Ordering::Relaxed);
        if self.framed.elapsed() >= FRAME {
            self.framed = Instant::now();
            self.send_frame();
        }
        if self.shown.elapsed() >= STATUS {
            self.shown = Instant::now();
            self.show();
        }
    }

    /// Renews the status.
    fn show(&mut self) {
        let servo = LoopView {
            live_dropped: self.sender.dropped(),
            ..self.status.view()
        };
        let shares = self.status.take_shares();
        let mut snapshot = self.shared.snapshot();
        (snapshot.servo, snapshot.shares) = (servo, shares);
        snapshot.lateness = self.status.lateness_totals();
    }
}

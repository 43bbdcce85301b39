//! Commands: start, list, stop, output; and changes of the run in progress.

use std::convert::Infallible;
use std::sync::Arc;

use axum::Json;
use axum::body::Body as HttpBody;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, NoContent, Response};
use bytes::Bytes;
use futures_util::stream;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::{Body, FromJson};
use super::error::ApiError;
use super::extract::{Client, InPath, LeaseHeader, StopBody};
use super::file_check::check_files;
use super::lease::random;
use super::reply::{Accepted, Reply};
use super::texts::check_texts;
use super::views::RunView;
use crate::output::{OutputPiece, RunOutput};
use crate::run_entry::{Carrier, Phase, RunRequest};
use crate::schedule::{NewEntry, ScheduleError, StopKind};
use crate::secret::Secret;
use crate::shared::{Daemon, now};
use crate::worker;
use bench_experiment::{ErrorKind, Stage, TuneRefusal, check_tune};
use bench_order::Order;
use bench_rt::tuning::{Factors, Tune};

/// The part of a path that names a command.
#[derive(Debug, Deserialize, JsonSchema)]
pub struct RunId {
    /// Number of the command.
    id: u64,
}

/// All commands since the daemon started.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Runs {
    /// The one that has its turn.
    current: Option<RunView>,
    /// Those that wait.
    queue: Vec<RunView>,
    /// Those that have ended, newest first.
    finished: Vec<RunView>,
}

/// Lists the commands.
pub async fn list(State(daemon): State<Arc<Daemon>>) -> Json<Runs> {
    Json(daemon.read(|schedule| Runs {
        current: schedule.current().map(RunView::from),
        queue: schedule.queue().map(RunView::from).collect(),
        finished: schedule.finished().map(RunView::from).collect(),
    }))
}

/// One command.
pub async fn one(
    State(daemon): State<Arc<Daemon>>,
    InPath(RunId { id }): InPath<RunId>,
) -> Result<Json<RunView>, ApiError> {
    let view = daemon.read(|schedule| schedule.entry(id).map(RunView::from))?;
    Ok(Json(view))
}

/// Queues a command under the lease of the client.
pub async fn start(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
    Body(request): Body<RunRequest>,
) -> Result<Accepted<RunView>, ApiError> {
    check_texts(&request.name, &request.note)?;
    let operator = daemon.read(|schedule| {
        let lease = schedule.require_lease(&lease, now())?;
        Ok::<_, ApiError>(lease.operator.clone())
    })?;
    check_files(&daemon, request.order.files()).await?;
    let order = request.order.clone();
    let new = NewEntry {
        request,
        carrier: Carrier::Started { ticket: random()? },
        operator,
        lease: Some(Secret::known(lease)),
    };
    let view = daemon.change(|schedule, now| {
        let id = schedule.enqueue(new, now)?;
        schedule.entry(id).map(RunView::from)
    })?;
    tokio::spawn(estimate(daemon, view.id, order));
    Ok(Reply(view))
}

/// Adds the length of a command by its plan. A command without a plan has none.
async fn estimate(daemon: Arc<Daemon>, id: u64, order: Order) {
    let plan = worker::plan(&daemon, order).await.unwrap_or_default();
    let length_s = plan["expected"]["duration_s"].as_f64();
    daemon.change(|schedule, _| {
        if let Ok(entry) = schedule.open_entry(id) {
            entry.estimated_s = entry.estimated_s.or(length_s);
        }
    });
}

/// Stops one command.
pub async fn stop(
    State(daemon): State<Arc<Daemon>>,
    InPath(RunId { id }): InPath<RunId>,
    Client(by): Client,
    body: StopBody,
) -> Result<Json<RunView>, ApiError> {
    let stop = |how| {
        daemon.change(|schedule, now| {
            schedule.stop(id, how, &by, now)?;
            schedule.entry(id).map(RunView::from)
        })
    };
    let (view, how) = body.carry_out(stop).await;
    tracing::warn!(run = id, ?how, by, "the run was stopped");
    Ok(Json(view?))
}

/// What was stopped.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Stopped {
    /// Number of the run; `null` if nothing had its turn.
    run: Option<u64>,
    /// How it was stopped.
    how: StopKind,
}

/// Stops whatever runs, and holds the bench. Needs neither lease nor token.
pub async fn stop_all(
    State(daemon): State<Arc<Daemon>>,
    Client(by): Client,
    body: StopBody,
) -> Json<Stopped> {
    let stop = |how| daemon.change(|schedule, now| schedule.stop_bench(how, &by, now));
    let (run, how) = body.carry_out(stop).await;
    tracing::warn!(run, ?how, by, "the bench was stopped");
    Json(Stopped { run, how })
}

/// Releases the bench after a stop or a trip, and acknowledges the trip.
pub async fn resume(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
) -> Result<NoContent, ApiError> {
    let released = daemon.change(|schedule, now| {
        let released = schedule.resume(&lease, now)?;
        daemon.live.acknowledge_trip();
        Ok::<_, ScheduleError>(released)
    })?;
    if let Some(hold) = released {
        tracing::warn!("the bench was resumed; it was {hold}");
    }
    Ok(NoContent)
}

/// Acknowledges a trip; the bench stays held.
pub async fn clear(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
) -> Result<NoContent, ApiError> {
    daemon.read(|schedule| schedule.require_lease(&lease, now()).map(drop))?;
    daemon.live.acknowledge_trip();
    Ok(NoContent)
}

/// Predicts travel, current, heat and duration. Moves nothing.
pub async fn plan(
    State(daemon): State<Arc<Daemon>>,
    Body(order): Body<Order>,
) -> Result<Json<serde_json::Value>, ApiError> {
    check_files(&daemon, order.files()).await?;
    let computed = worker::plan(&daemon, order).await?;
    match computed.get("error") {
        Some(_) => Err(ApiError::of_command(&computed)),
        None => Ok(Json(computed)),
    }
}

/// New factors of the loop in progress.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TuneRequest {
    /// Factor of the reference, relative to the rest position.
    #[serde(default = "one_factor")]
    reference: f64,
    /// Factor of the loop gain.
    #[serde(default = "one_factor")]
    gain: f64,
    /// Length of the ramp to the new factors.
    #[serde(default = "half_second")]
    ramp_s: f64,
}

impl FromJson for TuneRequest {}

fn one_factor() -> f64 {
    1.0
}

fn half_second() -> f64 {
    0.5
}

/// Longest ramp to new factors.
const MAX_RAMP_S: f64 = 3600.0;

/// Changes reference and gain of the loop in progress, along a ramp. The margins of the new gain are checked first; an unstable loop is
/// refused on the simulated stage as well.
pub async fn tune(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
    Body(request): Body<TuneRequest>,
) -> Result<NoContent, ApiError> {
    daemon.read(|schedule| schedule.require_lease(&lease, now()).map(drop))?;
    let Some(plan) = daemon.plan() else {
        return Err(ApiError::conflict(
            "no run goes on; start `control` first, then change its reference or gain",
        ));
    };
    if !(request.ramp_s > 0.0 && request.ramp_s <= MAX_RAMP_S) {
        return Err(ApiError::bad_request(format!(
            "ramp_s is {}; choose a time above 0, up to {MAX_RAMP_S} s",
            request.ramp_s
        )));
    }
    let factors = Factors {
        reference: request.reference,
        gain: request.gain,
    };
    let ticks = (request.ramp_s * plan.config.servo.rate_hz).ceil() as u64;
    let tune =
        Tune::new(factors, ticks).map_err(|error| ApiError::bad_request(error.to_string()))?;
    let checked = tokio::task::spawn_blocking(move || check_tune(&plan, factors, Stage::Devices));
    match checked.await {
        Ok(Ok(())) => {}
        Ok(Err(refusal @ TuneRefusal::Margin(_))) => {
            return Err(ApiError::refused(ErrorKind::Margin, refusal.to_string()));
        }
        Ok(Err(refusal)) => return Err(ApiError::refused(ErrorKind::Plan, refusal.to_string())),
        Err(_) => {
            let message = "the check of the margins failed; report this with the log of the daemon";
            return Err(ApiError::refused(ErrorKind::Failed, message));
        }
    }
    // Checked again after the computation: the lease may have ended.
    daemon.read(|schedule| schedule.require_lease(&lease, now()).map(drop))?;
    let _ = daemon.owner.tuner().send(tune); // without a receiver nothing runs
    Ok(NoContent)
}

/// Follows what a command prints, as one JSON object a line. The last line is its exit code.
pub async fn output(
    State(daemon): State<Arc<Daemon>>,
    InPath(RunId { id }): InPath<RunId>,
) -> Result<Response, ApiError> {
    daemon.read(|schedule| schedule.entry(id).map(drop))?;
    let follower = Follower {
        output: daemon.output(id),
        daemon,
        id,
        next: 0,
        is_done: false,
    };
    let lines = stream::unfold(follower, |mut follower| async {
        let bytes = follower.lines().await?;
        Some((Ok::<_, Infallible>(bytes), follower))
    });
    let media_type = [(header::CONTENT_TYPE, "application/x-ndjson")];
    Ok((media_type, HttpBody::from_stream(lines)).into_response())
}

/// A client that follows the output of a command.
struct Follower {
    daemon: Arc<Daemon>,
    id: u64,
    output: Arc<RunOutput>,
    next: usize,
    is_done: bool,
}

impl Follower {
    /// Whether the command has ended. One that was cancelled, or that another process carried out, has no exit code.
    fn has_ended(&self) -> bool {
        self.daemon.read(|schedule| {
            let entry = schedule.entry(self.id);
            entry.map_or(true, |entry| {
                entry.phase == Phase::Finished && !entry.has_process
            })
        })
    }

    /// The next lines; `None` after the exit code, or when the command has ended without one.
    async fn lines(&mut self) -> Option<Bytes> {
        if self.is_done {
            return None;
        }
        let mut printed = self.output.changes();
        let mut changes = self.daemon.changes();
        loop {
            // Before the pieces are read: the exit code is the last of them.
            let has_ended = self.has_ended();
            let pieces = self.output.from(self.next);
            if !pieces.is_empty() {
                self.next += pieces.len();
                self.is_done = pieces
                    .iter()
                    .any(|piece| matches!(piece, OutputPiece::Exit(_)));
                let lines = pieces
                    .iter()
                    .filter_map(|piece| serde_json::to_string(piece).ok());
                let text: String = lines.map(|line| line + "\n").collect();
                return Some(text.into());
            }
            if has_ended {
                return None;
            }
            tokio::select! {
                changed = printed.changed() => changed.ok()?,
                changed = changes.changed() => changed.ok()?,
            }
        }
    }
}

//! One command of the queue, from its entry to its end.

use std::borrow::Cow;
use std::time::Instant;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::{Map, Value};

use super::hold::StopKind;
use super::secret::Secret;
use bench_base::progress::Progress;
use bench_experiment::{Description, EndKind, operator_name, run_name, run_note};
use bench_order::{Order, OrderError, order_schema};
use bench_rt::supervision::StopFlags;

/// What happens to a run whose client disappears.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnDisconnect {
    /// A closed loop settles to zero current, everything else goes on to its end.
    #[default]
    Default,
    /// The run settles to zero current.
    Stop,
    /// The run goes on to its end.
    Continue,
}

/// What a client asks for: an order, and what the bench keeps with it. As JSON it is one object with the fields of both.
#[derive(Clone, Debug, Serialize)]
pub struct RunRequest {
    /// The order.
    #[serde(flatten)]
    pub order: Order,
    /// A name for the list of recordings.
    pub name: String,
    /// A note of the operator.
    pub note: String,
    /// What happens if the client disappears.
    pub on_disconnect: OnDisconnect,
}

/// A JSON value that is no request.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RequestError {
    /// Its order is refused.
    #[error(transparent)]
    Order(#[from] OrderError),
    /// A field beside the order is refused.
    #[error("`{field}` cannot be used: {why}; see /api/v1/openapi.json for its form")]
    Remark {
        /// The field.
        field: &'static str,
        /// Why.
        why: String,
    },
}

impl RequestError {
    /// The field that is wrong, as in the JSON object of the request; `None` if it is not a single one.
    pub fn field(&self) -> Option<String> {
        match self {
            RequestError::Order(error) => error.field(),
            RequestError::Remark { field, .. } => Some((*field).into()),
        }
    }
}

/// The fields of a request beside its order.
#[derive(Default, JsonSchema)]
#[serde(default)]
struct Remarks {
    /// A name for the list of recordings.
    name: String,
    /// A note of the operator.
    note: String,
    /// What happens if the client disappears.
    on_disconnect: OnDisconnect,
}

impl Remarks {
    /// Takes them out of the fields of a request; what remains is its order.
    fn take_from(fields: &mut Map<String, Value>) -> Result<Remarks, RequestError> {
        Ok(Remarks {
            name: taken(fields, "name")?,
            note: taken(fields, "note")?,
            on_disconnect: taken(fields, "on_disconnect")?,
        })
    }
}

/// The value of a field, which is removed; that of an absent field is the default value of its type.
fn taken<T: DeserializeOwned + Default>(
    fields: &mut Map<String, Value>,
    field: &'static str,
) -> Result<T, RequestError> {
    let Some(value) = fields.shift_remove(field) else {
        return Ok(T::default());
    };
    T::deserialize(value).map_err(|error| RequestError::Remark {
        field,
        why: error.to_string(),
    })
}

impl<'de> Deserialize<'de> for RunRequest {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<RunRequest, D::Error> {
        let value = Value::deserialize(deserializer)?;
        RunRequest::from_json(value).map_err(D::Error::custom)
    }
}

impl JsonSchema for RunRequest {
    fn schema_name() -> Cow<'static, str> {
        "RunRequest".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let remarks = Remarks::json_schema(generator).remove("properties");
        let remarks = remarks.and_then(|fields| fields.as_object().cloned());
        order_schema(generator, &remarks.unwrap_or_default())
    }
}

impl RunRequest {
    /// Reads a request from a JSON object.
    ///
    /// # Errors
    /// When it is no request; the message says which field is wrong.
    pub fn from_json(value: Value) -> Result<RunRequest, RequestError> {
        let Value::Object(mut fields) = value else {
            return Err(OrderError::NoObject.into());
        };
        let remarks = Remarks::take_from(&mut fields)?;
        Ok(RunRequest {
            order: Order::from_json(Value::Object(fields))?,
            name: remarks.name,
            note: remarks.note,
            on_disconnect: remarks.on_disconnect,
        })
    }

    /// Whether the run settles when its client disappears.
    pub fn ends_with_client(&self) -> bool {
        match (self.on_disconnect, &self.order) {
            (OnDisconnect::Stop, _) | (OnDisconnect::Default, Order::Control(_)) => true,
            (OnDisconnect::Continue, _)
            | (
                OnDisconnect::Default,
                Order::Chirp(_)
                | Order::Calibrate(_)
                | Order::Linearity(_)
                | Order::Campaign(_)
                | Order::Identify(_),
            ) => false,
        }
    }
}

/// Who carries out the command.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// A process of this machine, which waits for its turn.
    Attached,
    /// A process that the daemon starts. It shows its ticket.
    Started {
        /// The ticket.
        ticket: Secret,
    },
}

/// How far a command is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// It waits for the commands before it.
    Queued,
    /// It waits until the bench is resumed after a stop or a trip.
    Held,
    /// It is next, but another operator holds the lease.
    WaitingForLease,
    /// It has its turn and prepares its run.
    Starting,
    /// Its run goes on.
    Running,
    /// Its process analyses the recording.
    Analysing,
    /// It has ended.
    Finished,
}

/// One command of the queue.
#[derive(Clone, Debug)]
pub struct RunEntry {
    /// Number, from 1.
    pub id: u64,
    /// What the client asked for.
    pub request: RunRequest,
    /// Who carries it out.
    pub carrier: Carrier,
    /// The operator.
    pub operator: String,
    /// The lease with which it was queued; an attached process takes a lease at its turn.
    pub lease: Option<Secret>,
    /// How far it is.
    pub phase: Phase,
    /// When it was queued, in seconds since 1970.
    pub queued_unix_s: f64,
    /// When its turn began.
    pub started_unix_s: Option<f64>,
    /// When it ended.
    pub ended_unix_s: Option<f64>,
    /// Its length by the plan, in seconds; `None` if it is not known.
    pub estimated_s: Option<f64>,
    /// Ends the run in progress.
    pub stop: StopFlags,
    /// Whether somebody stopped it.
    pub is_stopped: bool,
    /// When its turn ends at the latest, because it was stopped and has no run.
    pub turn_ends: Option<Instant>,
    /// Whether a process that the daemon started for it still works, perhaps after the end of its turn.
    pub has_process: bool,
    /// Whether its client has disappeared.
    pub is_orphan: bool,
    /// How it ended.
    pub outcome: Option<EndKind>,
    /// Exit code of its process.
    pub exit_code: Option<i32>,
    /// The error, if it has one.
    pub message: Option<String>,
    /// File name of its last recording.
    pub recording: Option<String>,
    /// Progress of its run.
    pub progress: Option<Progress>,
}

impl RunEntry {
    /// Name, note and operator for the recording. An attached process states its operator itself, if it knows one.
    pub fn description(&self) -> Description {
        Description {
            name: run_name(&self.request.name).ok(),
            note: run_note(&self.request.note).ok(),
            operator: match self.carrier {
                Carrier::Attached => None,
                Carrier::Started { .. } => operator_name(&self.operator).ok(),
            },
            invocation: None,
        }
    }

    /// Whether its turn has begun and not ended.
    pub fn is_current(&self) -> bool {
        match self.phase {
            Phase::Starting | Phase::Running | Phase::Analysing => true,
            Phase::Queued | Phase::Held | Phase::WaitingForLease | Phase::Finished => false,
        }
    }

    /// Raises the stop flags of the run: once to settle it, twice to cut the current. Without a run, the turn ends at `turn_ends`.
    pub fn stop(&mut self, kind: StopKind, turn_ends: Instant) {
        if self.phase != Phase::Running {
            self.turn_ends.get_or_insert(turn_ends);
        }
        let was_stopped = std::mem::replace(&mut self.is_stopped, true);
        match (kind, was_stopped) {
            // A second request to settle does not cut the current.
            (StopKind::Settle, true) => {}
            (StopKind::Settle, false) => self.stop.raise(),
            (StopKind::Cut, true) => self.stop.raise(),
            (StopKind::Cut, false) => {
                self.stop.raise();
                self.stop.raise();
            }
        }
    }
}

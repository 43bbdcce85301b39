//! Parts of a request; what cannot be read is answered with an error object.

use std::convert::Infallible;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use aide::OperationInput;
use aide::generate::GenContext;
use aide::openapi::{Operation, ReferenceOr};
use axum::Json;
use axum::body::Body as HttpBody;
use axum::extract::{ConnectInfo, FromRequest, FromRequestParts, Path, Query, Request};
use axum::http::request::Parts;
use bytes::Bytes;
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::error::ApiError;
use crate::schedule::StopKind;
use crate::shared::{Daemon, now};

/// Longest time in which the body of a stop arrives.
const STOP_BODY_TIME: Duration = Duration::from_secs(2);
/// Largest body of a stop: anyone may send one.
const MAX_STOP_BYTES: usize = 1 << 10;

/// How a run is stopped.
#[derive(Debug, Default, Deserialize, JsonSchema)]
pub struct Stop {
    /// `settle`: current to zero along a ramp. `cut`: zero current at once.
    #[serde(default)]
    how: StopKind,
}

/// The body of a stop. It says how to stop; it is not read before the stop has begun.
pub struct StopBody(HttpBody);

impl StopBody {
    /// Stops when the head of the request has arrived, whatever follows it: `stop` is called to settle at once, and once more if the
    /// body says `cut`. Without a body, or with one that cannot be read, it settles. Returns the result of the first call, and how the
    /// bench was stopped.
    pub async fn carry_out<T>(self, mut stop: impl FnMut(StopKind) -> T) -> (T, StopKind) {
        let stopped = stop(StopKind::Settle);
        let how = self.how().await;
        if how == StopKind::Cut {
            stop(how);
        }
        (stopped, how)
    }

    async fn how(self) -> StopKind {
        let read = axum::body::to_bytes(self.0, MAX_STOP_BYTES);
        let body = match tokio::time::timeout(STOP_BODY_TIME, read).await {
            Ok(Ok(body)) => body,
            Ok(Err(_)) | Err(_) => Bytes::new(),
        };
        let stop: Stop = serde_json::from_slice(&body).unwrap_or_default();
        stop.how
    }
}

impl<S: Send + Sync> FromRequest<S> for StopBody {
    type Rejection = Infallible;

    async fn from_request(request: Request, _state: &S) -> Result<Self, Infallible> {
        Ok(StopBody(request.into_body()))
    }
}

impl OperationInput for StopBody {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Json::<Stop>::operation_input(context, operation);
        if let Some(ReferenceOr::Item(body)) = &mut operation.request_body {
            body.required = false;
        }
    }
}

/// Who makes a request, in words: the operator of the lease that it contains, or from where it comes.
pub struct Client(pub String);

impl FromRequestParts<Arc<Daemon>> for Client {
    type Rejection = Infallible;

    async fn from_request_parts(
        parts: &mut Parts,
        daemon: &Arc<Daemon>,
    ) -> Result<Self, Infallible> {
        let LeaseHeader(lease) = LeaseHeader::of(parts);
        let operator = daemon.read(|schedule| {
            let lease = schedule.require_lease(&lease, now()).ok();
            lease.map(|lease| lease.operator.clone())
        });
        let address = parts.extensions.get::<ConnectInfo<SocketAddr>>();
        Ok(Client(match (operator, address) {
            (Some(operator), _) => operator,
            (None, Some(ConnectInfo(address))) => format!("a client at {}", address.ip()),
            (None, None) => "a client of this machine".into(),
        }))
    }
}

impl OperationInput for Client {}

/// Parts of the path.
pub struct InPath<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for InPath<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        match Path::<T>::from_request_parts(parts, state).await {
            Ok(Path(value)) => Ok(InPath(value)),
            Err(rejection) => Err(ApiError::not_found(format!(
                "the path cannot be used: {}; see /api/v1/openapi.json",
                rejection.body_text()
            ))),
        }
    }
}

impl<T: JsonSchema> OperationInput for InPath<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Path::<T>::operation_input(context, operation);
    }
}

/// Parts of the query, after `?`.
pub struct InQuery<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for InQuery<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        match Query::<T>::from_request_parts(parts, state).await {
            Ok(Query(value)) => Ok(InQuery(value)),
            Err(rejection) => Err(ApiError::bad_request(format!(
                "the query cannot be used: {}; see /api/v1/openapi.json for its form",
                rejection.body_text()
            ))),
        }
    }
}

impl<T: JsonSchema> OperationInput for InQuery<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Query::<T>::operation_input(context, operation);
    }
}

/// The address of the client; `None` on this machine.
pub struct ClientAddress(pub Option<IpAddr>);

impl<S: Send + Sync> FromRequestParts<S> for ClientAddress {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Infallible> {
        let client = parts.extensions.get::<ConnectInfo<SocketAddr>>();
        Ok(ClientAddress(client.map(|client| client.0.ip())))
    }
}

impl OperationInput for ClientAddress {}

/// The header `Bench-Lease`; empty if it is absent.
pub struct LeaseHeader(pub String);

impl LeaseHeader {
    fn of(parts: &Parts) -> LeaseHeader {
        let value = parts.headers.get(LEASE_HEADER);
        let text = value.and_then(|value| value.to_str().ok());
        LeaseHeader(text.unwrap_or_default().into())
    }
}

/// Name of the header with the lease.
pub const LEASE_HEADER: &str = "Bench-Lease";

impl<S: Send + Sync> FromRequestParts<S> for LeaseHeader {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, ApiError> {
        Ok(LeaseHeader::of(parts))
    }
}

impl OperationInput for LeaseHeader {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        let schema = context.schema.subschema_for::<String>();
        let parameter = aide::openapi::Parameter::Header {
            parameter_data: aide::openapi::ParameterData {
                name: LEASE_HEADER.into(),
                description: Some("The arm lease, from POST /api/v1/lease.".into()),
                required: true,
                deprecated: None,
                format: aide::openapi::ParameterSchemaOrContent::Schema(
                    aide::openapi::SchemaObject {
                        json_schema: schema,
                        example: None,
                        external_docs: None,
                    },
                ),
                example: None,
                examples: Default::default(),
                explode: None,
                extensions: Default::default(),
            },
            style: aide::openapi::HeaderStyle::Simple,
        };
        aide::operation::add_parameters(context, operation, [parameter]);
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::pin::pin;

    use futures_util::{FutureExt, stream};
    use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

    use super::*;

    async fn next(
        mut parts: UnboundedReceiver<&'static str>,
    ) -> Option<(
        Result<&'static str, Infallible>,
        UnboundedReceiver<&'static str>,
    )> {
        let part = parts.recv().await?;
        Some((Ok(part), parts))
    }

    #[tokio::test]
    async fn stop_acts_before_its_body_has_arrived() {
        for (body, expected) in [
            ("{\"how\":\"cut\"}", StopKind::Cut),
            ("{\"how\":", StopKind::Settle),
            ("", StopKind::Settle),
        ] {
            let (sender, parts) = unbounded_channel();
            let stop = StopBody(HttpBody::from_stream(stream::unfold(parts, next)));
            let calls = RefCell::new(Vec::new());
            let mut carried_out = pin!(stop.carry_out(|how| calls.borrow_mut().push(how)));
            assert!(carried_out.as_mut().now_or_never().is_none());
            assert_eq!(*calls.borrow(), [StopKind::Settle], "before the body");
            sender.send(body).unwrap();
            drop(sender);
            assert_eq!(carried_out.await.1, expected, "{body}");
            assert_eq!(calls.borrow().last(), Some(&expected));
        }
    }

    #[tokio::test]
    async fn long_body_of_a_stop_is_not_read() {
        let long = " ".repeat(MAX_STOP_BYTES) + "{\"how\":\"cut\"}";
        let stop = StopBody(HttpBody::from(long));
        assert_eq!(stop.carry_out(|_| ()).await.1, StopKind::Settle);
    }
}

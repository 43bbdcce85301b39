//! All requests of the interface, and its description.

use std::sync::Arc;

use aide::axum::ApiRouter;
use aide::axum::routing::{get_with, post_with, put_with};
use aide::openapi::{
    Info, MediaType, OpenApi, Operation, ReferenceOr, Response, SecurityScheme, StatusCode,
};
use aide::transform::TransformOperation;
use axum::extract::DefaultBodyLimit;
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::IntoResponse;
use axum::routing::get;
use axum::{Extension, Router};
use bytes::Bytes;

use super::error::ApiError;
use super::{lease, live, page, recordings, runs, tools};
use crate::client::SESSION_PATH;
use crate::metrics;
use crate::shared::Daemon;

/// Largest body of a request in bytes.
const MAX_BODY: usize = 1 << 20;

/// From where requests come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// The socket of this machine: commands may order runs.
    Machine,
    /// TCP.
    Network,
}

/// The requests of the interface.
pub fn router(daemon: Arc<Daemon>, reach: Reach) -> Router {
    let mut description = OpenApi {
        info: Info {
            title: "bench".into(),
            version: env!("CARGO_PKG_VERSION").into(),
            description: Some(DESCRIPTION.into()),
            ..Info::default()
        },
        ..OpenApi::default()
    };
    let api = api().finish_api_with(&mut description, |api| api.security_scheme(TOKEN, token()));
    // Serialising it does not fail: its keys are texts.
    let written = Written(serde_json::to_vec(&description).unwrap_or_default().into());
    let mut router = api
        .route("/", get(page::index))
        .route("/metrics", get(metrics))
        .route("/page/{name}", get(page::file));
    if reach == Reach::Machine {
        router = router.route(SESSION_PATH, get(live::command));
    }
    router
        .fallback(unknown)
        .method_not_allowed_fallback(wrong_method)
        .layer(Extension(written))
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .with_state(daemon)
}

const DESCRIPTION: &str = "Controller daemon of a precision-motion test bench. Over TCP every request that changes something needs the header `Authorization: Bearer TOKEN`, except POST /api/v1/stop: anyone may stop. What moves or tunes also needs the arm lease in the header `Bench-Lease`. Errors are objects `{ \"error\": { message, kind, where, remedy } }`.";

async fn metrics(State(daemon): State<Arc<Daemon>>) -> impl IntoResponse {
    (
        [(CONTENT_TYPE, metrics::MEDIA_TYPE)],
        metrics::text(&daemon).await,
    )
}

async fn unknown() -> ApiError {
    ApiError::not_found("there is no such request; see /api/v1/openapi.json")
}

async fn wrong_method() -> ApiError {
    ApiError::new(
        axum::http::StatusCode::METHOD_NOT_ALLOWED,
        bench_experiment::ErrorKind::Usage,
        "this path does not know the method; see /api/v1/openapi.json",
    )
}

/// The description as JSON, written once.
#[derive(Clone)]
struct Written(Bytes);

async fn description(Extension(written): Extension<Written>) -> impl IntoResponse {
    ([(CONTENT_TYPE, "application/json")], written.0)
}

/// Name of the security scheme of the token.
const TOKEN: &str = "token";

fn token() -> SecurityScheme {
    SecurityScheme::Http {
        scheme: "bearer".into(),
        bearer_format: None,
        description: Some("The token that the daemon prints. Only TCP needs it.".into()),
        extensions: Default::default(),
    }
}

/// Name and summary of a request that needs no token.
fn named(
    id: &'static str,
    summary: &'static str,
) -> impl FnOnce(TransformOperation<'_>) -> TransformOperation<'_> {
    move |operation| with_errors(operation.id(id).summary(summary))
}

/// Name and summary of a request that needs the token over TCP.
fn change(
    id: &'static str,
    summary: &'static str,
) -> impl FnOnce(TransformOperation<'_>) -> TransformOperation<'_> {
    move |operation| named(id, summary)(operation).security_requirement(TOKEN)
}

/// Every request may be refused: for its rate, its host or its form, or because others are served.
fn with_errors(operation: TransformOperation<'_>) -> TransformOperation<'_> {
    let mut operation = operation.response::<503, ApiError>();
    let responses = operation.inner_mut().responses.as_ref();
    let errors = StatusCode::Range(4);
    if responses.is_some_and(|responses| responses.responses.contains_key(&errors)) {
        operation
    } else {
        operation.response_range::<4, ApiError>()
    }
}

/// Adds an answer whose body is not JSON.
fn answers(operation: &mut Operation, status: u16, description: &str, media_type: Option<&str>) {
    let content = media_type.map(|media_type| (media_type.into(), MediaType::default()));
    let response = Response {
        description: description.into(),
        content: content.into_iter().collect(),
        ..Response::default()
    };
    let responses = operation.responses.get_or_insert_default();
    let code = StatusCode::Code(status);
    responses
        .responses
        .insert(code, ReferenceOr::Item(response));
}

fn web_socket(mut operation: TransformOperation<'_>) -> TransformOperation<'_> {
    answers(operation.inner_mut(), 101, "The WebSocket is open.", None);
    operation
}

fn event_stream(mut operation: TransformOperation<'_>) -> TransformOperation<'_> {
    let media_type = Some("text/event-stream");
    answers(
        operation.inner_mut(),
        200,
        "Events until the client closes the connection.",
        media_type,
    );
    operation
}

fn json_lines(mut operation: TransformOperation<'_>) -> TransformOperation<'_> {
    let media_type = Some("application/x-ndjson");
    answers(
        operation.inner_mut(),
        200,
        "One JSON object a line until the command has ended.",
        media_type,
    );
    operation
}

fn file(mut operation: TransformOperation<'_>) -> TransformOperation<'_> {
    let any = Some("*/*");
    answers(operation.inner_mut(), 200, "The file.", any);
    answers(operation.inner_mut(), 206, "A part of the file.", any);
    answers(
        operation.inner_mut(),
        304,
        "The file has not changed.",
        None,
    );
    operation
}

fn api() -> ApiRouter<Arc<Daemon>> {
    ApiRouter::new()
        .api_route(
            "/api/v1/state",
            get_with(live::now, named("state", "Everything at one moment")),
        )
        .api_route(
            "/api/v1/live",
            get_with(live::web_socket, |operation| {
                web_socket(named(
                    "live",
                    "WebSocket: states and events as text, samples as binary messages",
                )(operation))
            }),
        )
        .api_route(
            "/api/v1/events",
            get_with(live::events, |operation| {
                event_stream(named("events", "States and events as server-sent events")(
                    operation,
                ))
            }),
        )
        .api_route(
            "/api/v1/response",
            get_with(
                live::response,
                named(
                    "response",
                    "The response of the stage during the last chirp, as it grows",
                ),
            ),
        )
        .api_route(
            "/api/v1/lease",
            post_with(lease::take, change("takeLease", "Take the arm lease"))
                .put_with(lease::renew, change("renewLease", "Renew the arm lease"))
                .delete_with(
                    lease::release,
                    change("releaseLease", "Release the arm lease"),
                ),
        )
        .api_route(
            "/api/v1/runs",
            get_with(runs::list, named("runs", "List the commands")).post_with(
                runs::start,
                change("startRun", "Queue a command; needs the lease"),
            ),
        )
        .api_route(
            "/api/v1/runs/{id}",
            get_with(runs::one, named("run", "One command")),
        )
        .api_route(
            "/api/v1/runs/{id}/stop",
            post_with(
                runs::stop,
                change(
                    "stopRun",
                    "Stop the command that has its turn, and hold the bench; cancel one that waits",
                ),
            ),
        )
        .api_route(
            "/api/v1/runs/{id}/output",
            get_with(runs::output, |operation| {
                json_lines(named(
                    "runOutput",
                    "What a command prints, as one JSON object a line",
                )(operation))
            }),
        )
        .api_route(
            "/api/v1/stop",
            post_with(
                runs::stop_all,
                named(
                    "stop",
                    "Stop whatever runs, and hold the bench until the holder of the lease resumes; needs neither lease nor token",
                ),
            ),
        )
        .api_route(
            "/api/v1/resume",
            post_with(
                runs::resume,
                change(
                    "resume",
                    "Release the bench after a stop or a trip, and acknowledge the trip; needs the lease",
                ),
            ),
        )
        .api_route(
            "/api/v1/clear",
            post_with(
                runs::clear,
                change(
                    "clear",
                    "Acknowledge a trip; the bench stays held; needs the lease",
                ),
            ),
        )
        .api_route(
            "/api/v1/plan",
            post_with(
                runs::plan,
                change(
                    "plan",
                    "Predict travel, current, heat and duration, without motion",
                ),
            ),
        )
        .api_route(
            "/api/v1/tune",
            post_with(
                runs::tune,
                change(
                    "tune",
                    "Change reference and gain of the running loop; needs the lease",
                ),
            ),
        )
        .api_route(
            "/api/v1/recordings",
            get_with(recordings::list, named("recordings", "List the recordings")),
        )
        .api_route(
            "/api/v1/report",
            get_with(
                recordings::report,
                named(
                    "report",
                    "Page (HTML) with the frequency responses and steps of recordings",
                ),
            ),
        )
        .api_route(
            "/api/v1/recordings/{file}",
            get_with(recordings::download, |operation| {
                file(named("download", "Download a file; understands Range")(
                    operation,
                ))
            })
            .delete_with(
                recordings::remove,
                change(
                    "removeRecording",
                    "Remove a recording and the files computed from it",
                ),
            ),
        )
        .api_route(
            "/api/v1/recordings/{file}/note",
            put_with(
                recordings::note,
                change("noteRecording", "Change name and note of a recording"),
            ),
        )
        .api_route(
            "/api/v1/recordings/{file}/results",
            get_with(
                recordings::results,
                named("results", "The results in a recording"),
            ),
        )
        .api_route(
            "/api/v1/config",
            get_with(tools::in_use, named("config", "The configuration in use")),
        )
        .api_route(
            "/api/v1/config/check",
            post_with(
                tools::check,
                change("checkConfig", "Check settings; nothing is changed"),
            ),
        )
        .api_route(
            "/api/v1/config/schema",
            get_with(
                tools::schema,
                named("configSchema", "The JSON schema of the settings"),
            ),
        )
        .api_route(
            "/api/v1/doctor",
            get_with(tools::doctor, named("doctor", "Findings of bench doctor")),
        )
        .api_route(
            "/api/v1/model",
            get_with(
                tools::model,
                named("model", "Modes, residues and zeros of the model"),
            ),
        )
        .route("/api/v1/openapi.json", get(description))
}

//! The recordings: list, download, note, delete, results.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, NoContent, Response};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tower::ServiceExt;
use tower_http::services::ServeFile;

use super::error::ApiError;
use super::extract::{Body, InPath, InQuery};
use super::texts::check_texts;
use crate::daemon::catalogue::{ListedRecording, RecordingInfo};
use crate::daemon::shared::Daemon;
use crate::daemon::worker;
use crate::experiment::ErrorKind;
use crate::recording::Recording;

/// Most recordings on one page: the curves of more cannot be distinguished.
const MAX_COMPARED: usize = 12;
/// The script of a report gets no access to the token of the page.
const REPORT_POLICY: &str = "sandbox allow-scripts";

/// The part of a path that names a file.
#[derive(Debug, Deserialize, JsonSchema)]
pub struct FileName {
    /// Name of a file in the folder of the recordings.
    file: String,
}

/// The recordings, newest first.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Recordings {
    recordings: Vec<ListedRecording>,
}

/// Lists the recordings.
pub async fn list(State(daemon): State<Arc<Daemon>>) -> Result<Json<Recordings>, ApiError> {
    let recordings = on_files(move || {
        let listed = daemon.catalogue().list();
        listed.map_err(|error| {
            file_error(format!(
                "the folder of the recordings cannot be read: {error}; check its permissions"
            ))
        })
    });
    Ok(Json(Recordings {
        recordings: recordings.await?,
    }))
}

/// Downloads a recording or a file computed from it. Understands `Range`.
pub async fn download(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
    request: Request,
) -> Result<Response, ApiError> {
    let path = daemon
        .catalogue()
        .path(&file)
        .ok_or_else(|| unknown(&file))?;
    let served = ServeFile::new(path).oneshot(request).await;
    let mut response = match served {
        Ok(response) => response.map(axum::body::Body::new).into_response(),
        Err(never) => match never {},
    };
    if let Some(error) = unserved(response.status(), &file) {
        return Ok(with_range(error.into_response(), &response));
    }
    // The script of a report cannot use the token of the page.
    let policy = HeaderValue::from_static(REPORT_POLICY);
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    Ok(response)
}

/// Which recordings are drawn.
#[derive(Debug, Deserialize, JsonSchema)]
pub struct ReportQuery {
    /// File names of recordings, separated by commas.
    files: String,
}

/// A page with the frequency responses and steps of one or several recordings, as `bench report`.
pub async fn report(
    State(daemon): State<Arc<Daemon>>,
    InQuery(query): InQuery<ReportQuery>,
) -> Result<Response, ApiError> {
    let files: Vec<String> = query.files.split(',').map(String::from).collect();
    if files.len() > MAX_COMPARED {
        return Err(ApiError::bad_request(format!(
            "{} recordings are too many for one page; choose at most {MAX_COMPARED}",
            files.len()
        )));
    }
    for file in &files {
        require(&daemon, file)?;
    }
    let page = worker::page(&daemon, &files).await?;
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, REPORT_POLICY),
    ];
    Ok((headers, page).into_response())
}

/// The error of an answer without the file.
fn unserved(status: StatusCode, file: &str) -> Option<ApiError> {
    let message = match status {
        StatusCode::NOT_FOUND => return Some(unknown(file)),
        StatusCode::RANGE_NOT_SATISFIABLE => {
            format!("{file} does not contain this range; ask for one range within the file")
        }
        StatusCode::PRECONDITION_FAILED => {
            format!("{file} has changed since; ask for it without a condition")
        }
        status if status.is_server_error() => {
            return Some(file_error(format!(
                "{file} cannot be read; look at the log of the system"
            )));
        }
        status if status.is_client_error() => format!("{file} cannot be sent: {status}"),
        _ => return None,
    };
    Some(ApiError::new(status, ErrorKind::Usage, message))
}

/// An error with the length of the file [RFC 9110, 15.5.17].
fn with_range(mut error: Response, served: &Response) -> Response {
    if let Some(range) = served.headers().get(header::CONTENT_RANGE) {
        let headers = error.headers_mut();
        headers.insert(header::CONTENT_RANGE, range.clone());
    }
    error
}

/// Removes a recording and the files computed from it.
pub async fn remove(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
) -> Result<NoContent, ApiError> {
    let is_open = daemon.read(|schedule| {
        let current = schedule.current();
        current.is_some_and(|entry| entry.recording.as_ref().is_none_or(|name| *name == file))
    });
    if is_open {
        return Err(ApiError::conflict(
            "a run goes on, and this may be its recording; wait for its end",
        ));
    }
    require(&daemon, &file)?;
    on_files(move || {
        let removed = daemon.catalogue().remove(&file);
        removed.map_err(|error| {
            file_error(format!(
                "{file} cannot be removed: {error}; check the permissions of the folder"
            ))
        })
    })
    .await?;
    Ok(NoContent)
}

/// Name and note of a recording.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Note {
    /// Name.
    #[serde(default)]
    name: String,
    /// Note.
    #[serde(default)]
    note: String,
}

/// Changes name and note of a recording.
pub async fn note(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
    Body(note): Body<Note>,
) -> Result<NoContent, ApiError> {
    check_texts(&note.name, &note.note)?;
    require(&daemon, &file)?;
    on_files(move || {
        let catalogue = daemon.catalogue();
        let info = RecordingInfo {
            name: note.name,
            note: note.note,
            ..catalogue.info(&file)
        };
        let stored = catalogue.set_info(&file, &info);
        stored.map_err(|error| {
            file_error(format!(
                "the note cannot be stored: {error}; check the permissions of the folder"
            ))
        })
    })
    .await?;
    Ok(NoContent)
}

/// The results that the command added to the recording.
pub async fn results(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
) -> Result<Json<serde_json::Value>, ApiError> {
    let path = daemon
        .catalogue()
        .recording(&file)
        .ok_or_else(|| unknown(&file))?;
    let results = on_files(move || {
        let opened = Recording::open(&path);
        let recording =
            opened.map_err(|error| ApiError::refused(ErrorKind::Recording, error.to_string()))?;
        let attachment = recording.attachment("results.json");
        let results = attachment.and_then(|found| serde_json::from_slice(&found.data).ok());
        results.ok_or_else(|| {
            ApiError::not_found(format!(
                "{file} contains no results; analyse it with `bench identify`"
            ))
        })
    });
    Ok(Json(results.await?))
}

fn require(daemon: &Daemon, file: &str) -> Result<(), ApiError> {
    let found = daemon.catalogue().recording(file);
    found.map(drop).ok_or_else(|| unknown(file))
}

fn unknown(file: &str) -> ApiError {
    ApiError::not_found(format!(
        "there is no recording {file}; GET /api/v1/recordings lists all"
    ))
}

fn file_error(message: String) -> ApiError {
    ApiError::refused(ErrorKind::Failed, message)
}

/// Work on files, outside the tasks that serve clients.
async fn on_files<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ApiError> + Send + 'static,
) -> Result<T, ApiError> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|_| {
        Err(file_error(
            "reading the folder failed; report this with the log of the daemon".into(),
        ))
    })
}

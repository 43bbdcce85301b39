//! The recordings: list, download, note, delete, results.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tower::ServiceExt;
use tower_http::services::ServeFile;

use super::error::ApiError;
use super::extract::{Body, InPath, InQuery};
use crate::daemon::catalogue::{ListedRecording, RecordingInfo};
use crate::daemon::shared::Daemon;
use crate::daemon::worker;
use crate::experiment::ErrorKind;
use crate::recording::Recording;

/// Longest name and note in bytes.
const MAX_TEXT: usize = 10_000;
/// Most recordings on one page: the curves of more cannot be told apart.
const MAX_COMPARED: usize = 12;
/// The script of a report gets no access to the token of the page.
const REPORT_POLICY: &str = "sandbox allow-scripts";

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
    InPath(file): InPath<String>,
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

/// Removes a recording and the files computed from it.
pub async fn remove(
    State(daemon): State<Arc<Daemon>>,
    InPath(file): InPath<String>,
) -> Result<StatusCode, ApiError> {
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
    Ok(StatusCode::NO_CONTENT)
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
    InPath(file): InPath<String>,
    Body(note): Body<Note>,
) -> Result<StatusCode, ApiError> {
    if note.name.len().max(note.note.len()) > MAX_TEXT {
        return Err(ApiError::bad_request(format!(
            "name or note has more than {MAX_TEXT} bytes; shorten it"
        )));
    }
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
    Ok(StatusCode::NO_CONTENT)
}

/// The results that the command added to the recording.
pub async fn results(
    State(daemon): State<Arc<Daemon>>,
    InPath(file): InPath<String>,
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

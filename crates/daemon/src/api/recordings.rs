//! The recordings: list, download, note, delete, results.

use std::io;
use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, header};
use axum::response::{IntoResponse, NoContent, Response};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::{Body, FromJson};
use super::download::OpenFile;
use super::error::ApiError;
use super::extract::{ClientAddress, InPath, InQuery};
use super::texts::check_texts;
use crate::catalogue::{Catalogue, ListedRecording, RecordingInfo};
use crate::computations::Purpose;
use crate::shared::Daemon;
use crate::worker;
use bench_experiment::ErrorKind;
use bench_recording::Recording;

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
    let catalogue = daemon.catalogue();
    let recordings = daemon.files.run(move || {
        let listed = catalogue.list();
        listed.map_err(|error| {
            file_error(format!(
                "the folder of the recordings cannot be read: {error}; check its permissions"
            ))
        })
    });
    Ok(Json(Recordings {
        recordings: recordings.await??,
    }))
}

/// Downloads a recording or a file computed from it. Understands `Range`.
pub async fn download(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let catalogue = daemon.catalogue();
    let open = daemon.files.run(move || {
        let opened = catalogue.open(&file);
        let opened =
            opened.and_then(|found| found.map(|it| OpenFile::new(file.clone(), it)).transpose());
        opened
            .map_err(|error| unreadable(&file, &error))?
            .ok_or_else(|| unknown(&file))
    });
    let mut response = open.await??.answer(daemon, &headers);
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
    ClientAddress(client): ClientAddress,
    InQuery(query): InQuery<ReportQuery>,
) -> Result<Response, ApiError> {
    let files: Vec<String> = query.files.split(',').map(String::from).collect();
    if files.len() > MAX_COMPARED {
        return Err(ApiError::bad_request(format!(
            "{} recordings are too many for one page; choose at most {MAX_COMPARED}",
            files.len()
        )));
    }
    require_all(&daemon, files.clone()).await?;
    let page = worker::page(&daemon, Purpose::View(client), &files).await?;
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, REPORT_POLICY),
    ];
    Ok((headers, page).into_response())
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
    let catalogue = daemon.catalogue();
    let removed = daemon.files.run(move || {
        require(&catalogue, &file)?;
        catalogue.remove(&file).map_err(|error| {
            file_error(format!(
                "{file} cannot be removed: {error}; check the permissions of the folder"
            ))
        })
    });
    removed.await??;
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

impl FromJson for Note {}

/// Changes name and note of a recording.
pub async fn note(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
    Body(note): Body<Note>,
) -> Result<NoContent, ApiError> {
    check_texts(&note.name, &note.note)?;
    let catalogue = daemon.catalogue();
    let stored = daemon.files.run(move || {
        require(&catalogue, &file)?;
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
    });
    stored.await??;
    Ok(NoContent)
}

/// The results that the command added to the recording.
pub async fn results(
    State(daemon): State<Arc<Daemon>>,
    InPath(FileName { file }): InPath<FileName>,
) -> Result<Json<serde_json::Value>, ApiError> {
    let catalogue = daemon.catalogue();
    let results = daemon.files.run(move || {
        let path = catalogue.recording(&file).ok_or_else(|| unknown(&file))?;
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
    Ok(Json(results.await??))
}

fn require(catalogue: &Catalogue, file: &str) -> Result<(), ApiError> {
    let found = catalogue.recording(file);
    found.map(drop).ok_or_else(|| unknown(file))
}

async fn require_all(daemon: &Daemon, files: Vec<String>) -> Result<(), ApiError> {
    let catalogue = daemon.catalogue();
    let found = move || files.iter().try_for_each(|file| require(&catalogue, file));
    daemon.files.run(found).await?
}

fn unknown(file: &str) -> ApiError {
    ApiError::not_found(format!(
        "there is no recording {file}; GET /api/v1/recordings lists all"
    ))
}

fn file_error(message: String) -> ApiError {
    ApiError::refused(ErrorKind::Failed, message)
}

fn unreadable(file: &str, error: &io::Error) -> ApiError {
    file_error(format!(
        "{file} cannot be read: {error}; check its permissions"
    ))
}

//! A file as the body of an answer: whole, or one range of it [RFC 9110, 13 and 14]. It is read in small parts as the client takes them.

use std::fs::File;
use std::io;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use axum::body::Body;
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::stream;

use super::error::ApiError;
use crate::files::FolderError;
use crate::shared::Daemon;
use bench_experiment::ErrorKind;

/// Bytes that are read at a time: what a client that takes nothing costs.
const PART_BYTES: u64 = 8 << 10;

/// A file that is open.
pub struct OpenFile {
    /// Its name.
    pub name: String,
    /// The file.
    pub file: File,
    /// Its length in bytes.
    pub length: u64,
    /// Its last change, in whole seconds.
    pub changed: SystemTime,
}

impl OpenFile {
    /// The file with its length and its last change.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn new(name: String, file: File) -> io::Result<OpenFile> {
        let found = file.metadata()?;
        let since = found.modified()?.duration_since(SystemTime::UNIX_EPOCH);
        let seconds = since.map_or(0, |since| since.as_secs());
        Ok(OpenFile {
            name,
            file,
            length: found.len(),
            changed: SystemTime::UNIX_EPOCH + Duration::from_secs(seconds),
        })
    }

    /// The answer to a request with these headers.
    pub fn answer(self, daemon: Arc<Daemon>, headers: &HeaderMap) -> Response {
        if date(headers, header::IF_UNMODIFIED_SINCE).is_some_and(|date| self.changed > date) {
            return self.refused(StatusCode::PRECONDITION_FAILED);
        }
        if date(headers, header::IF_MODIFIED_SINCE).is_some_and(|date| self.changed <= date) {
            return StatusCode::NOT_MODIFIED.into_response();
        }
        match range(headers, self.length) {
            Asked::All => {
                let all = 0..self.length;
                self.sent(daemon, StatusCode::OK, all)
            }
            Asked::Part(range) => self.sent(daemon, StatusCode::PARTIAL_CONTENT, range),
            Asked::Nothing => self.refused(StatusCode::RANGE_NOT_SATISFIABLE),
        }
    }

    fn sent(self, daemon: Arc<Daemon>, status: StatusCode, range: Range<u64>) -> Response {
        let (Range { start, end }, length) = (range, self.length);
        let own = [
            (header::CONTENT_TYPE, media_type(&self.name).to_string()),
            (header::CONTENT_LENGTH, (end - start).to_string()),
            (header::ACCEPT_RANGES, "bytes".into()),
            (header::LAST_MODIFIED, httpdate::fmt_http_date(self.changed)),
        ];
        let parts = Parts {
            daemon,
            file: Arc::new(self.file),
            next: start,
            end,
        };
        let body = stream::try_unfold(parts, Parts::next);
        let mut response = (status, own, Body::from_stream(body)).into_response();
        if status == StatusCode::PARTIAL_CONTENT {
            let range = format!("bytes {start}-{}/{length}", end - 1);
            insert(&mut response, header::CONTENT_RANGE, &range);
        }
        response
    }

    /// An error with the length of the file [RFC 9110, 15.5.17].
    fn refused(&self, status: StatusCode) -> Response {
        let file = &self.name;
        let message = match status {
            StatusCode::PRECONDITION_FAILED => {
                format!("{file} has changed since; ask for it without a condition")
            }
            _ => format!("{file} does not contain this range; ask for one range within the file"),
        };
        let mut response = ApiError::new(status, ErrorKind::Usage, message).into_response();
        if status == StatusCode::RANGE_NOT_SATISFIABLE {
            let range = format!("bytes */{}", self.length);
            insert(&mut response, header::CONTENT_RANGE, &range);
        }
        response
    }
}

fn insert(response: &mut Response, name: HeaderName, text: &str) {
    if let Ok(value) = HeaderValue::from_str(text) {
        response.headers_mut().insert(name, value);
    }
}

/// The rest of a range.
struct Parts {
    daemon: Arc<Daemon>,
    file: Arc<File>,
    next: u64,
    end: u64,
}

impl Parts {
    /// The next part; the answer breaks off if the file became shorter or its folder does not answer.
    async fn next(mut self) -> Result<Option<(Bytes, Parts)>, PartError> {
        if self.next >= self.end {
            return Ok(None);
        }
        let (file, at) = (Arc::clone(&self.file), self.next);
        let bytes = PART_BYTES.min(self.end - self.next) as usize; // at most `PART_BYTES`
        let read = self.daemon.files.run(move || part(&file, at, bytes));
        let part = read.await??;
        self.next += part.len() as u64;
        Ok(Some((part, self)))
    }
}

fn part(file: &File, at: u64, bytes: usize) -> io::Result<Bytes> {
    let mut buffer = vec![0; bytes];
    file.read_exact_at(&mut buffer, at)?;
    Ok(buffer.into())
}

/// Why an answer breaks off.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
enum PartError {
    Folder(#[from] FolderError),
    File(#[from] io::Error),
}

/// What a client asks for.
#[derive(Debug, PartialEq, Eq)]
enum Asked {
    All,
    Part(Range<u64>),
    /// Several ranges, or none that is in the file.
    Nothing,
}

fn range(headers: &HeaderMap, length: u64) -> Asked {
    let Some(text) = headers.get(header::RANGE) else {
        return Asked::All;
    };
    let parsed = text.to_str().ok().and_then(|text| {
        let ranges = http_range_header::parse_range_header(text).ok()?;
        ranges.validate(length).ok()
    });
    match parsed.as_deref() {
        // The library takes a range of an empty file as its first byte.
        Some([only]) if *only.end() < length => Asked::Part(*only.start()..*only.end() + 1),
        Some(_) | None => Asked::Nothing,
    }
}

fn date(headers: &HeaderMap, name: HeaderName) -> Option<SystemTime> {
    httpdate::parse_http_date(headers.get(name)?.to_str().ok()?).ok()
}

fn media_type(name: &str) -> &'static str {
    match name.rsplit('.').next() {
        Some("csv") => "text/csv",
        Some("svg") => "image/svg+xml",
        Some("html") => "text/html",
        Some("json") => "application/json",
        Some("toml") => "text/x-toml",
        Some(_) | None => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(text: &str, length: u64) -> Asked {
        let mut headers = HeaderMap::new();
        headers.insert(header::RANGE, text.parse().unwrap());
        range(&headers, length)
    }

    #[test]
    fn serves_one_range_within_the_file() {
        assert_eq!(asked("bytes=0-3", 10), Asked::Part(0..4));
        assert_eq!(asked("bytes=7-", 10), Asked::Part(7..10));
        assert_eq!(asked("bytes=-4", 10), Asked::Part(6..10));
        assert_eq!(asked("bytes=0-99", 10), Asked::Part(0..10));
        for text in ["bytes=10-", "bytes=0-1,3-4", "bytes=5-2", "lines=1-2", ""] {
            assert_eq!(asked(text, 10), Asked::Nothing, "{text}");
        }
        assert_eq!(asked("bytes=0-", 0), Asked::Nothing, "an empty file");
        assert_eq!(range(&HeaderMap::new(), 10), Asked::All);
    }
}

//! The files of the live page.

use axum::extract::Path;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::page::{PageFile, find};

/// What the page may load: its own files only.
const POLICY: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'; form-action 'self'";

/// The page.
pub async fn index() -> Response {
    served(find("index.html"))
}

/// A file of the page.
pub async fn file(Path(name): Path<String>) -> Response {
    served(find(&name))
}

fn served(file: Option<&PageFile>) -> Response {
    let Some(file) = file else {
        return (StatusCode::NOT_FOUND, "there is no such file of the page").into_response();
    };
    let headers = [
        (header::CONTENT_TYPE, file.media_type),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-cache"),
    ];
    (headers, file.text).into_response()
}

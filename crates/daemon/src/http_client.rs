//! Requests to a daemon, over its socket or over TCP.

use std::path::PathBuf;

use bytes::Bytes;
use http_body_util::{BodyExt, Full};
use hyper::body::Incoming;
use hyper::client::conn::http1::handshake;
use hyper::{Request, Response};
use hyper_util::rt::TokioIo;
use serde_json::Value;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpStream, UnixStream};

/// Where a daemon listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A socket of this machine.
    Socket(PathBuf),
    /// Host and port, and the token.
    Tcp {
        /// `HOST:PORT`.
        address: String,
        /// The token.
        token: Option<String>,
    },
}

impl Target {
    /// The daemon at `HOST:PORT`, or `HOST` for the port 80.
    pub fn tcp(address: &str, token: Option<String>) -> Target {
        let address = address.trim_end_matches('/');
        let has_port = address
            .rsplit_once(':')
            .is_some_and(|(_, port)| port.parse::<u16>().is_ok());
        Target::Tcp {
            address: if has_port {
                address.into()
            } else {
                format!("{address}:80")
            },
            token,
        }
    }
}

/// A request that failed.
#[derive(Debug, thiserror::Error)]
pub enum HttpError {
    /// The daemon cannot be reached.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The connection broke, or the answer is not HTTP.
    #[error("{0}")]
    Http(#[from] hyper::Error),
    /// The request cannot be built.
    #[error("{0}")]
    Request(#[from] hyper::http::Error),
    /// The answer is not JSON.
    #[error("the answer cannot be read: {0}")]
    Json(#[from] serde_json::Error),
}

/// What is asked of the daemon.
#[derive(Clone, Debug)]
pub struct Ask<'a> {
    /// Method.
    pub method: hyper::Method,
    /// Path.
    pub path: &'a str,
    /// The arm lease.
    pub lease: Option<&'a str>,
    /// The body.
    pub body: Option<Value>,
}

impl<'a> Ask<'a> {
    /// A request to read something.
    pub fn get(path: &'a str) -> Ask<'a> {
        Ask {
            method: hyper::Method::GET,
            path,
            lease: None,
            body: None,
        }
    }
}

/// Sends a request; the body of the answer may be read as it comes.
///
/// # Errors
/// When the daemon cannot be reached.
pub async fn send(target: &Target, ask: &Ask<'_>) -> Result<Response<Incoming>, HttpError> {
    match target {
        Target::Socket(path) => {
            let stream = UnixStream::connect(path).await?;
            exchange(stream, "localhost", None, ask).await
        }
        Target::Tcp { address, token } => {
            let stream = TcpStream::connect(address).await?;
            exchange(stream, address, token.as_deref(), ask).await
        }
    }
}

/// Sends a request; returns the status and the JSON of the answer.
///
/// # Errors
/// When the daemon cannot be reached, or answers with something else.
pub async fn json(target: &Target, ask: &Ask<'_>) -> Result<(u16, Value), HttpError> {
    let response = send(target, ask).await?;
    let status = response.status().as_u16();
    let body = response.into_body().collect().await?.to_bytes();
    if body.is_empty() {
        Ok((status, Value::Null))
    } else {
        Ok((status, serde_json::from_slice(&body)?))
    }
}

/// A file.
///
/// # Errors
/// When the daemon cannot be reached, or refuses the request.
pub async fn download(target: &Target, path: &str) -> Result<Bytes, HttpError> {
    let response = send(target, &Ask::get(path)).await?;
    let status = response.status();
    let body = response.into_body().collect().await?.to_bytes();
    if status.is_success() {
        Ok(body)
    } else {
        Err(std::io::Error::other(format!("status {status}")).into())
    }
}

async fn exchange(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    host: &str,
    token: Option<&str>,
    ask: &Ask<'_>,
) -> Result<Response<Incoming>, HttpError> {
    let (mut sender, connection) = handshake(TokioIo::new(stream)).await?;
    // It ends with the answer, or breaks it.
    tokio::spawn(connection);
    let mut request = Request::builder()
        .method(ask.method.clone())
        .uri(ask.path)
        .header("Host", host);
    if let Some(token) = token {
        request = request.header("Authorization", format!("Bearer {token}"));
    }
    if let Some(lease) = ask.lease {
        request = request.header("Bench-Lease", lease);
    }
    let body = match &ask.body {
        None => Bytes::new(),
        Some(body) => {
            request = request.header("Content-Type", "application/json");
            serde_json::to_vec(body)?.into()
        }
    };
    let answer = sender.send_request(request.body(Full::new(body))?).await?;
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn port_of_an_address_is_80_unless_it_is_given() {
        for (text, expected) in [
            ("lab:8020/", "lab:8020"),
            ("lab", "lab:80"),
            ("10.0.0.1/", "10.0.0.1:80"),
        ] {
            let Target::Tcp { address, .. } = Target::tcp(text, None) else {
                panic!("{text}");
            };
            assert_eq!(address, expected);
        }
    }
}

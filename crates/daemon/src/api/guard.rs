//! What a request over TCP must fulfil: token, origin, host, rate.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use axum::extract::{ConnectInfo, Request, State};
use axum::http::{HeaderMap, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::error::ApiError;
use crate::secret::Secret;
use bench_experiment::ErrorKind;

/// Requests per second that all clients over TCP together may make in the long run, and at once.
const RATE_PER_S: f64 = 500.0;
const BURST: f64 = 1000.0;
/// The request that needs neither a token nor a place: anyone may stop.
const STOP_PATH: &str = "/api/v1/stop";

/// The guard of one TCP address.
#[derive(Debug)]
pub struct Guard {
    token: Secret,
    address: SocketAddr,
    tokens: Mutex<Bucket>,
}

/// Tokens that are filled at a rate; each request takes one.
#[derive(Debug)]
struct Bucket {
    tokens: f64,
    filled: Instant,
}

impl Bucket {
    fn take(&mut self, now: Instant) -> bool {
        let elapsed_s = now.saturating_duration_since(self.filled).as_secs_f64();
        self.tokens = (self.tokens + elapsed_s * RATE_PER_S).min(BURST);
        self.filled = now;
        let has_token = self.tokens >= 1.0;
        if has_token {
            self.tokens -= 1.0;
        }
        has_token
    }
}

impl Guard {
    /// The guard of a listener.
    pub fn new(token: Secret, address: SocketAddr) -> Guard {
        Guard {
            token,
            address,
            tokens: Mutex::new(Bucket {
                tokens: BURST,
                filled: Instant::now(),
            }),
        }
    }

    fn check(&self, method: &Method, path: &str, headers: &HeaderMap) -> Result<(), ApiError> {
        // A stop is never refused because of other requests, nor for want of a token.
        let is_stop = is_stop(method, path);
        let mut bucket = self.tokens.lock().unwrap_or_else(PoisonError::into_inner);
        if !bucket.take(Instant::now()) && !is_stop {
            let message =
                format!("more than {RATE_PER_S} requests per second; wait, then ask less often");
            return Err(ApiError::new(
                StatusCode::TOO_MANY_REQUESTS,
                ErrorKind::Usage,
                message,
            ));
        }
        drop(bucket);
        self.check_host(headers)?;
        self.check_origin(headers)?;
        let only_reads = matches!(*method, Method::GET | Method::HEAD | Method::OPTIONS);
        if only_reads || is_stop {
            Ok(())
        } else {
            self.check_token(headers)
        }
    }

    /// The name under which the daemon was asked must be an address or a local name: a page of another host whose name points here
    /// cannot use the daemon (DNS rebinding).
    fn check_host(&self, headers: &HeaderMap) -> Result<(), ApiError> {
        let host = text(headers, header::HOST).unwrap_or_default();
        if is_own_name(host) {
            Ok(())
        } else {
            Err(ApiError::forbidden(format!(
                "the host `{host}` is not this daemon; use its address, for example http://{}",
                self.address
            )))
        }
    }

    /// A browser states which page makes a request; only the page of the daemon may.
    fn check_origin(&self, headers: &HeaderMap) -> Result<(), ApiError> {
        let Some(origin) = headers.get(header::ORIGIN) else {
            return Ok(());
        };
        let origin = String::from_utf8_lossy(origin.as_bytes());
        let host = text(headers, header::HOST).unwrap_or_default();
        if origin.strip_prefix("http://") == Some(host) {
            Ok(())
        } else {
            Err(ApiError::forbidden(format!(
                "a page of {origin} may not use the daemon; open the page of the daemon itself"
            )))
        }
    }

    fn check_token(&self, headers: &HeaderMap) -> Result<(), ApiError> {
        let given = text(headers, header::AUTHORIZATION);
        let given = given.and_then(|text| text.strip_prefix("Bearer "));
        if given.is_some_and(|given| self.token.is(given)) {
            Ok(())
        } else {
            Err(ApiError::unauthorized(
                "this request needs the token of the daemon; send the header `Authorization: Bearer TOKEN` (the daemon prints where the token is)",
            ))
        }
    }
}

fn is_stop(method: &Method, path: &str) -> bool {
    method == Method::POST && path == STOP_PATH
}

/// Refuses every request but a stop, on a connection for which there is no other place.
pub async fn only_stop(request: Request, next: Next) -> Response {
    if is_stop(request.method(), request.uri().path()) {
        return next.run(request).await;
    }
    let message =
        "the daemon has too many connections; close some of them, or wait. Only a stop is served";
    ApiError::busy(StatusCode::SERVICE_UNAVAILABLE, message).into_response()
}

fn text(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name)?.to_str().ok()
}

/// Whether a host is an IP address, `localhost`, a name without a dot, or a name of the local network.
fn is_own_name(host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) => name,
        _ => host,
    };
    let bare = name.trim_start_matches('[').trim_end_matches(']');
    let is_address = bare.parse::<std::net::IpAddr>().is_ok();
    let is_plain = !name.is_empty() && !name.contains('.');
    is_address || is_plain || name.ends_with(".local") || name.ends_with(".lan")
}

/// Refuses requests that the guard does not allow.
pub async fn guard(
    State(guard): State<Arc<Guard>>,
    ConnectInfo(client): ConnectInfo<SocketAddr>,
    request: Request,
    next: Next,
) -> Response {
    let allowed = guard.check(request.method(), request.uri().path(), request.headers());
    match allowed {
        Ok(()) => next.run(request).await,
        Err(error) => {
            tracing::info!(%client, path = request.uri().path(), "a request was refused");
            error.into_response()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn guarded(method: Method, path: &str, headers: &[(&str, &str)]) -> Option<u16> {
        let address = "127.0.0.1:8020".parse().unwrap();
        let guard = Guard::new(Secret::known("right".into()), address);
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name: header::HeaderName = name.parse().unwrap();
            map.insert(name, value.parse().unwrap());
        }
        let error = guard.check(&method, path, &map).err()?;
        Some(error.into_response().status().as_u16())
    }

    const HOST: (&str, &str) = ("host", "127.0.0.1:8020");

    #[test]
    fn changes_need_the_token_and_a_stop_does_not() {
        let token = ("authorization", "Bearer right");
        let wrong = ("authorization", "Bearer wrong");
        assert_eq!(guarded(Method::GET, "/api/v1/state", &[HOST]), None);
        assert_eq!(guarded(Method::POST, "/api/v1/runs", &[HOST]), Some(401));
        assert_eq!(
            guarded(Method::POST, "/api/v1/runs", &[HOST, wrong]),
            Some(401)
        );
        assert_eq!(
            guarded(Method::DELETE, "/api/v1/recordings/a", &[HOST]),
            Some(401)
        );
        assert_eq!(guarded(Method::POST, "/api/v1/runs", &[HOST, token]), None);
        assert_eq!(guarded(Method::POST, "/api/v1/stop", &[HOST]), None);
    }

    #[test]
    fn refuses_pages_and_names_of_other_hosts() {
        let evil = ("host", "evil.example.com");
        let page = ("origin", "http://evil.example.com");
        let own = ("origin", "http://127.0.0.1:8020");
        assert_eq!(guarded(Method::GET, "/", &[evil]), Some(403));
        assert_eq!(guarded(Method::GET, "/", &[HOST, page]), Some(403));
        assert_eq!(
            guarded(Method::POST, "/api/v1/stop", &[HOST, page]),
            Some(403)
        );
        assert_eq!(guarded(Method::GET, "/", &[HOST, own]), None);
        for name in [
            "localhost:8020",
            "bench.local",
            "[::1]:8020",
            "labpc",
            "192.168.0.7",
        ] {
            assert_eq!(guarded(Method::GET, "/", &[("host", name)]), None, "{name}");
        }
        assert_eq!(guarded(Method::GET, "/", &[]), Some(403), "without a host");
    }

    #[test]
    fn limits_the_rate_but_never_a_stop() {
        let mut bucket = Bucket {
            tokens: 2.0,
            filled: Instant::now(),
        };
        let now = bucket.filled;
        assert_eq!([(); 3].map(|()| bucket.take(now)), [true, true, false]);
        assert!(
            bucket.take(now + std::time::Duration::from_millis(3)),
            "filled again"
        );
    }
}

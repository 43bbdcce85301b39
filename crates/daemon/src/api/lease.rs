//! The arm lease.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::response::NoContent;
use schemars::JsonSchema;
use serde::Serialize;

use super::body::Body;
use super::error::ApiError;
use super::extract::LeaseHeader;
use super::reply::{Created, Reply};
use super::views::Operator;
use crate::lease::LEASE;
use crate::secret::Secret;
use crate::shared::Daemon;
use bench_experiment::{ErrorKind, operator_name};

/// A lease that was given.
#[derive(Debug, Serialize, JsonSchema)]
pub struct GivenLease {
    /// What the holder sends in the header `Bench-Lease`.
    lease: String,
    /// Time until it expires without a renewal.
    expires_in_s: f64,
}

/// A lease that was renewed.
#[derive(Debug, Serialize, JsonSchema)]
pub struct RenewedLease {
    /// Time until it expires without a renewal.
    expires_in_s: f64,
}

/// Takes the lease.
pub async fn take(
    State(daemon): State<Arc<Daemon>>,
    Body(operator): Body<Operator>,
) -> Result<Created<GivenLease>, ApiError> {
    let name = operator_name(&operator.operator)
        .map_err(|error| ApiError::bad_request(format!("operator: {error}")))?;
    let secret = random()?;
    daemon.change(|schedule, now| schedule.take_lease(&name, secret.clone(), now))?;
    tracing::info!(operator = name, "the arm lease was taken");
    let given = GivenLease {
        lease: secret.reveal().into(),
        expires_in_s: LEASE.as_secs_f64(),
    };
    Ok(Reply(given))
}

/// Renews the lease.
pub async fn renew(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
) -> Result<Json<RenewedLease>, ApiError> {
    daemon.change(|schedule, now| schedule.renew_lease(&lease, now))?;
    Ok(Json(RenewedLease {
        expires_in_s: LEASE.as_secs_f64(),
    }))
}

/// Releases the lease.
pub async fn release(
    State(daemon): State<Arc<Daemon>>,
    LeaseHeader(lease): LeaseHeader,
) -> Result<NoContent, ApiError> {
    daemon.change(|schedule, now| schedule.release_lease(&lease, now))?;
    tracing::info!("the arm lease was released");
    Ok(NoContent)
}

/// A new secret.
pub fn random() -> Result<Secret, ApiError> {
    Secret::random().map_err(|error| {
        let message = format!("the system has no random numbers: {error}; look at its log");
        ApiError::refused(ErrorKind::Failed, message)
    })
}

//! Errors of the interface as JSON objects.

use aide::OperationOutput;
use aide::generate::GenContext;
use aide::openapi::{Operation, Response as Described};
use axum::Json;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;

use crate::files::FolderError;
use crate::order_files::Outside;
use crate::run_entry::RequestError;
use crate::schedule::ScheduleError;
use crate::worker::ComputeError;
use bench_experiment::{ErrorKind, ErrorObject};

/// An error with its status.
#[derive(Debug)]
pub struct ApiError {
    status: StatusCode,
    object: ErrorObject,
    /// Whether the same request may succeed soon.
    is_busy: bool,
}

/// When a client asks again after it was refused because others are served.
const RETRY_AFTER_S: u32 = 5;

/// The body of an error.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ErrorBody {
    /// The error.
    error: ErrorFields,
}

/// What is wrong and what to do.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ErrorFields {
    /// What is wrong and what to do, as text.
    message: String,
    /// Kind of the error: usage, configuration, controller, plan, model, devices, calibration, margin, certificate, recording, data, study,
    /// campaign or failed.
    kind: String,
    /// The field, option, file or line that is wrong, as the client wrote it; null if it is not a single one.
    #[serde(rename = "where")]
    place: Option<String>,
    /// What to do, as in the message; null if nothing is known.
    remedy: Option<String>,
    /// All defects of a certificate, each as `what is wrong; what to do`; absent without defects.
    #[serde(default)]
    defects: Vec<String>,
}

impl ApiError {
    /// An error.
    pub fn new(status: StatusCode, kind: ErrorKind, message: impl Into<String>) -> ApiError {
        ApiError {
            status,
            object: ErrorObject::new(message.into(), kind, None),
            is_busy: false,
        }
    }

    /// A request that cannot be served now.
    pub fn busy(status: StatusCode, message: impl Into<String>) -> ApiError {
        ApiError {
            is_busy: true,
            ..ApiError::new(status, ErrorKind::Failed, message)
        }
    }

    /// A request that cannot be understood.
    pub fn bad_request(message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::BAD_REQUEST, ErrorKind::Usage, message)
    }

    /// The same error at a place: the field, option, file or line that is wrong.
    pub fn at(mut self, place: Option<String>) -> ApiError {
        self.object.place = place;
        self
    }

    /// A request that is understood and refused.
    pub fn refused(kind: ErrorKind, message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::UNPROCESSABLE_ENTITY, kind, message)
    }

    /// Something that is not there.
    pub fn not_found(message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::NOT_FOUND, ErrorKind::Usage, message)
    }

    /// Something that is in use.
    pub fn conflict(message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::CONFLICT, ErrorKind::Usage, message)
    }

    /// Missing or wrong credentials.
    pub fn unauthorized(message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::UNAUTHORIZED, ErrorKind::Usage, message)
    }

    /// A request that this client may not make.
    pub fn forbidden(message: impl Into<String>) -> ApiError {
        ApiError::new(StatusCode::FORBIDDEN, ErrorKind::Usage, message)
    }

    /// An object that a command printed instead of its result.
    pub fn of_command(json: &serde_json::Value) -> ApiError {
        let error = json.get("error").cloned().unwrap_or_default();
        let object: Result<ErrorObject, _> = serde_json::from_value(error);
        match object {
            Ok(object) => ApiError {
                status: StatusCode::UNPROCESSABLE_ENTITY,
                object,
                is_busy: false,
            },
            Err(_) => ApiError::refused(
                ErrorKind::Failed,
                "the command failed without a message; start it on the command line",
            ),
        }
    }
}

impl From<ScheduleError> for ApiError {
    fn from(error: ScheduleError) -> ApiError {
        let message = error.to_string();
        match error {
            ScheduleError::Held { .. } => ApiError::conflict(message),
            ScheduleError::NoLease | ScheduleError::NoTicket => ApiError::forbidden(message),
            ScheduleError::Full => {
                ApiError::new(StatusCode::TOO_MANY_REQUESTS, ErrorKind::Usage, message)
            }
            ScheduleError::Unknown(_) => ApiError::not_found(message),
            ScheduleError::OnHold(_) | ScheduleError::Stopped | ScheduleError::ShuttingDown => {
                ApiError::conflict(message)
            }
        }
    }
}

impl From<RequestError> for ApiError {
    fn from(error: RequestError) -> ApiError {
        ApiError::refused(ErrorKind::Usage, error.to_string()).at(error.field())
    }
}

impl From<Outside> for ApiError {
    fn from(error: Outside) -> ApiError {
        ApiError::refused(ErrorKind::Usage, error.to_string())
    }
}

impl From<ComputeError> for ApiError {
    fn from(error: ComputeError) -> ApiError {
        match error {
            ComputeError::Busy(_) => {
                ApiError::busy(StatusCode::TOO_MANY_REQUESTS, error.to_string())
            }
            ComputeError::Start(_) | ComputeError::TooLong | ComputeError::NoResult(_) => {
                ApiError::refused(ErrorKind::Failed, error.to_string())
            }
        }
    }
}

impl From<FolderError> for ApiError {
    fn from(error: FolderError) -> ApiError {
        ApiError::busy(StatusCode::SERVICE_UNAVAILABLE, error.to_string())
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let object = self.object;
        let body = serde_json::json!({ "error": object });
        let retry_after = self.is_busy.then(|| HeaderValue::from(RETRY_AFTER_S));
        let mut response = (self.status, Json(body)).into_response();
        let headers = response.headers_mut();
        headers.extend(retry_after.map(|value| (header::RETRY_AFTER, value)));
        response
    }
}

/// Describes the error object as an answer, with `text` as its description.
pub fn described(
    context: &mut GenContext,
    operation: &mut Operation,
    text: &str,
) -> Option<Described> {
    let described = ApiError::operation_response(context, operation)?;
    Some(Described {
        description: text.into(),
        ..described
    })
}

impl OperationOutput for ApiError {
    type Inner = ErrorBody;

    fn operation_response(
        context: &mut GenContext,
        operation: &mut Operation,
    ) -> Option<Described> {
        Json::<ErrorBody>::operation_response(context, operation)
    }

    fn inferred_responses(
        context: &mut GenContext,
        operation: &mut Operation,
    ) -> Vec<(Option<aide::openapi::StatusCode>, Described)> {
        let described = Self::operation_response(context, operation);
        let range = aide::openapi::StatusCode::Range(4);
        described
            .map(|described| (Some(range), described))
            .into_iter()
            .collect()
    }
}

//! Bodies of requests. Each is a JSON object; what cannot be read is answered with an error object.

use std::error::Error;
use std::time::Duration;

use aide::OperationInput;
use aide::generate::GenContext;
use aide::openapi::{Operation, Response as Described, StatusCode as DescribedCode};
use axum::Json;
use axum::extract::rejection::BytesRejection;
use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, StatusCode, header};
use bytes::Bytes;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::error::{ApiError, described};
use crate::run_entry::{RequestError, RunRequest};
use bench_experiment::ErrorKind;
use bench_order::Order;

/// Longest time in which a client sends its body.
const BODY_TIME: Duration = Duration::from_secs(10);

/// How a body is refused.
const REFUSALS: [(StatusCode, &str); 5] = [
    (StatusCode::BAD_REQUEST, "The body is not valid JSON."),
    (
        StatusCode::REQUEST_TIMEOUT,
        "The body did not arrive in time.",
    ),
    (StatusCode::PAYLOAD_TOO_LARGE, "The body is too large."),
    (
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "The content type of the body is not `application/json`.",
    ),
    (
        StatusCode::UNPROCESSABLE_ENTITY,
        "The body is valid JSON, and a field or what it asks for is refused.",
    ),
];

/// A JSON body.
pub struct Body<T>(pub T);

/// What a body contains.
pub trait FromJson: DeserializeOwned {
    /// Reads the object.
    fn from_json(body: JsonBody) -> Result<Self, ApiError> {
        body.object()
    }
}

/// The answer names the option that is refused.
impl FromJson for Order {
    fn from_json(body: JsonBody) -> Result<Order, ApiError> {
        Ok(Order::from_json(body.value).map_err(RequestError::from)?)
    }
}

/// The answer names the field that is refused.
impl FromJson for RunRequest {
    fn from_json(body: JsonBody) -> Result<RunRequest, ApiError> {
        Ok(RunRequest::from_json(body.value)?)
    }
}

impl<S: Send + Sync, T: FromJson> FromRequest<S> for Body<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> Result<Self, ApiError> {
        let body = JsonBody::receive(request, state).await?;
        T::from_json(body).map(Body)
    }
}

impl<T: JsonSchema> OperationInput for Body<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Json::<T>::operation_input(context, operation);
    }

    fn inferred_early_responses(
        context: &mut GenContext,
        operation: &mut Operation,
    ) -> Vec<(Option<DescribedCode>, Described)> {
        let refusals = REFUSALS.into_iter();
        let refusals = refusals.filter_map(|(status, text)| {
            let code = DescribedCode::Code(status.as_u16());
            Some((Some(code), described(context, operation, text)?))
        });
        refusals.collect()
    }
}

/// A body that is valid JSON.
pub struct JsonBody {
    bytes: Bytes,
    value: Value,
}

impl JsonBody {
    /// Receives the body of a request.
    async fn receive(request: Request, state: &(impl Send + Sync)) -> Result<JsonBody, ApiError> {
        let headers = request.headers().clone();
        let read = tokio::time::timeout(BODY_TIME, Bytes::from_request(request, state));
        let read = read.await.map_err(|_| too_late())?;
        let bytes = read.map_err(|rejection| not_received(&rejection))?;
        require_json(&headers)?;
        let value = serde_json::from_slice(&bytes).map_err(|error| not_json(&error))?;
        Ok(JsonBody { bytes, value })
    }

    /// Reads the object. From the text, because a field that stands twice is refused there.
    fn object<T: DeserializeOwned>(&self) -> Result<T, ApiError> {
        // An array of the fields can be read as the object, too.
        if !self.value.is_object() {
            return Err(unusable("it is no object"));
        }
        let read = Json::<T>::from_bytes(&self.bytes);
        let Json(object) = read.map_err(|rejection| {
            // The cause, without the words of the library before it.
            let why = rejection.source().map(ToString::to_string);
            unusable(&why.unwrap_or_else(|| rejection.body_text()))
        })?;
        Ok(object)
    }
}

fn too_late() -> ApiError {
    let message = format!(
        "the body of the request did not arrive within {} s; send it again",
        BODY_TIME.as_secs()
    );
    ApiError::new(StatusCode::REQUEST_TIMEOUT, ErrorKind::Usage, message)
}

fn not_received(rejection: &BytesRejection) -> ApiError {
    let message = format!(
        "the body of the request was not received: {}; send a shorter one, or send it again",
        rejection.body_text()
    );
    ApiError::new(rejection.status(), ErrorKind::Usage, message)
}

/// Refuses a content type that is not JSON. A page of another origin cannot send this one unasked.
fn require_json(headers: &HeaderMap) -> Result<(), ApiError> {
    let given = headers.get(header::CONTENT_TYPE);
    let given = given.map(|value| String::from_utf8_lossy(value.as_bytes()));
    if given.as_deref().is_some_and(is_json) {
        return Ok(());
    }
    let what = match given {
        Some(given) => format!("the content type of the body is `{given}`"),
        None => "the body has no content type".into(),
    };
    Err(ApiError::new(
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        ErrorKind::Usage,
        format!("{what}; send JSON with the header `Content-Type: application/json`"),
    )
    .at(Some("Content-Type".into())))
}

/// Whether a content type is `application/json`, or another that consists of JSON.
fn is_json(content_type: &str) -> bool {
    let essence = content_type.split(';').next().unwrap_or_default();
    let essence = essence.trim().to_ascii_lowercase();
    let subtype = essence.strip_prefix("application/");
    subtype.is_some_and(|subtype| subtype == "json" || subtype.ends_with("+json"))
}

fn not_json(error: &serde_json::Error) -> ApiError {
    let message = format!("the body of the request is not valid JSON: {error}; correct it");
    let place = format!("line {} column {}", error.line(), error.column());
    ApiError::bad_request(message).at(Some(place))
}

fn unusable(why: &str) -> ApiError {
    let message = format!(
        "the body of the request cannot be used: {why}; see /api/v1/openapi.json for its form"
    );
    ApiError::refused(ErrorKind::Usage, message)
}

#[cfg(test)]
mod tests {
    use axum::body::Body as HttpBody;
    use axum::response::IntoResponse;
    use serde::Deserialize;
    use serde_json::json;

    use super::*;

    /// The answer to a body that `T` refuses: its status, and the error.
    async fn refusal<T: FromRequest<(), Rejection = ApiError>>(
        content_type: Option<&str>,
        body: impl Into<HttpBody>,
    ) -> (u16, Value) {
        let mut request = Request::new(body.into());
        if let Some(content_type) = content_type {
            let value = content_type.parse().expect("a header");
            request.headers_mut().insert(header::CONTENT_TYPE, value);
        }
        let Err(error) = T::from_request(request, &()).await else {
            panic!("the body was read");
        };
        let response = error.into_response();
        let status = response.status().as_u16();
        let bytes = axum::body::to_bytes(response.into_body(), 1 << 16).await;
        let body: Value = serde_json::from_slice(&bytes.expect("a body")).expect("JSON");
        (status, body["error"].clone())
    }

    /// The answers of POST /runs and POST /plan to an order.
    async fn refusals(order: &Value) -> [(u16, Value); 2] {
        let (json, text) = (Some("application/json"), order.to_string());
        [
            refusal::<Body<RunRequest>>(json, text.clone()).await,
            refusal::<Body<Order>>(json, text).await,
        ]
    }

    #[tokio::test]
    async fn refused_order_names_the_field_and_what_to_do() {
        for (order, place, named) in [
            (
                json!({ "command": "chirp", "durration": "2s" }),
                "durration",
                "use `duration`",
            ),
            (
                json!({ "command": "chirp", "operating_point": "far" }),
                "operating_point",
                "far",
            ),
            (
                json!({ "command": "campaign", "threads": 1025 }),
                "threads",
                "1..=1024",
            ),
            (
                json!({ "command": "chirp", "amplitude": "0.1A", "shape": "model" }),
                "amplitude",
                "--shape",
            ),
            (
                json!({ "command": "control", "args": ["--slow"] }),
                "args",
                "give each option as a field",
            ),
            (json!({ "command": "reboot" }), "command", "\"reboot\""),
            (
                json!({ "command": "chirp", "seed": "1" }),
                "seed",
                "give a whole number",
            ),
        ] {
            for (status, error) in refusals(&order).await {
                let message = error["message"].as_str().expect("a message");
                assert_eq!(status, 422, "{order}: {message}");
                assert_eq!(error["where"], place, "{order}: {message}");
                assert_eq!(error["kind"], "usage");
                assert!(message.contains(named), "{order}: {message}");
                assert!(error["remedy"].is_string(), "{order}: {message}");
                assert!(!message.contains("target type"), "{message}");
            }
        }
    }

    #[tokio::test]
    async fn refused_remark_names_its_field() {
        for (field, value) in [
            ("name", json!(5)),
            ("note", json!(null)),
            ("on_disconnect", json!("explode")),
        ] {
            let order = json!({ "command": "chirp", field: value });
            let (status, error) =
                refusal::<Body<RunRequest>>(Some("application/json"), order.to_string()).await;
            assert_eq!((status, &error["where"]), (422, &json!(field)), "{error}");
        }
    }

    #[tokio::test]
    async fn invalid_json_is_refused_with_its_place() {
        for (body, place) in [
            (
                "{\"command\": \"chirp\",\n \"duration\": }",
                "line 2 column 14",
            ),
            ("", "line 1 column 0"),
            ("{} x", "line 1 column 4"),
        ] {
            for (status, error) in [
                refusal::<Body<RunRequest>>(Some("application/json"), body).await,
                refusal::<Body<Order>>(Some("application/json"), body).await,
                refusal::<Body<Factors>>(Some("application/json"), body).await,
            ] {
                let message = error["message"].as_str().expect("a message");
                assert_eq!(status, 400, "{message}");
                assert_eq!(error["where"], place, "{message}");
                assert!(message.contains("is not valid JSON"), "{message}");
            }
        }
    }

    #[tokio::test]
    async fn other_content_type_is_refused_with_the_right_one() {
        for (content_type, named) in [
            (None, "no content type"),
            (Some("text/plain"), "`text/plain`"),
            (Some("application/jsonp"), "`application/jsonp`"),
        ] {
            let (status, error) = refusal::<Body<Order>>(content_type, "{}").await;
            let message = error["message"].as_str().expect("a message");
            assert_eq!((status, &error["where"]), (415, &json!("Content-Type")));
            assert!(message.contains(named), "{message}");
            assert!(message.contains("application/json"), "{message}");
        }
        for content_type in ["application/json; charset=utf-8", "Application/x+JSON"] {
            // It is read: its order is what is refused.
            let (status, _) = refusal::<Body<Order>>(Some(content_type), "{}").await;
            assert_eq!(status, 422, "{content_type}");
        }
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Factors {
        #[expect(dead_code, reason = "only whether it can be read is of interest")]
        gain: f64,
    }

    impl FromJson for Factors {}

    #[tokio::test]
    async fn other_body_is_refused_without_the_words_of_the_library() {
        for (body, named) in [
            ("[1.0]", "it is no object"),
            ("{\"gain\": \"x\"}", "gain: invalid type: string \"x\""),
            ("{\"gain\": 1, \"gain\": 2}", "duplicate field `gain`"),
            ("{\"gain\": 1, \"gani\": 2}", "unknown field `gani`"),
        ] {
            let (status, error) = refusal::<Body<Factors>>(Some("application/json"), body).await;
            let message = error["message"].as_str().expect("a message");
            assert_eq!(status, 422, "{message}");
            assert!(message.contains(named), "{message}");
            assert!(!message.contains("target type"), "{message}");
        }
    }

    #[test]
    fn every_refusal_of_a_body_is_described_with_the_error_object() {
        let described = aide::generate::in_context(|context| {
            let mut operation = Operation::default();
            Body::<Order>::inferred_early_responses(context, &mut operation)
        });
        let codes: Vec<String> = described
            .iter()
            .filter_map(|(code, _)| code.as_ref().map(ToString::to_string))
            .collect();
        assert_eq!(codes, ["400", "408", "413", "415", "422"]);
        for (_, response) in described {
            assert!(response.content.contains_key("application/json"));
            assert!(!response.description.is_empty());
        }
    }
}

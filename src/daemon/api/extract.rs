//! Parts of a request; what cannot be read is answered with an error object.

use aide::OperationInput;
use aide::generate::GenContext;
use aide::openapi::Operation;
use axum::Json;
use axum::extract::{FromRequest, FromRequestParts, Path, Query, Request};
use axum::http::request::Parts;
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::error::ApiError;

/// A JSON body.
pub struct Body<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequest<S> for Body<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> Result<Self, ApiError> {
        match Json::<T>::from_request(request, state).await {
            Ok(Json(body)) => Ok(Body(body)),
            Err(rejection) => {
                let message = format!(
                    "the body of the request cannot be used: {}; see /api/v1/openapi.json for its form",
                    rejection.body_text()
                );
                Err(ApiError::new(
                    rejection.status(),
                    crate::experiment::ErrorKind::Usage,
                    message,
                ))
            }
        }
    }
}

impl<T: JsonSchema> OperationInput for Body<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Json::<T>::operation_input(context, operation);
    }
}

/// Parts of the path.
pub struct InPath<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned + Send> FromRequestParts<S> for InPath<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        match Path::<T>::from_request_parts(parts, state).await {
            Ok(Path(value)) => Ok(InPath(value)),
            Err(rejection) => Err(ApiError::not_found(format!(
                "the path cannot be used: {}; see /api/v1/openapi.json",
                rejection.body_text()
            ))),
        }
    }
}

impl<T: JsonSchema> OperationInput for InPath<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Path::<T>::operation_input(context, operation);
    }
}

/// Parts of the query, after `?`.
pub struct InQuery<T>(pub T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for InQuery<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ApiError> {
        match Query::<T>::from_request_parts(parts, state).await {
            Ok(Query(value)) => Ok(InQuery(value)),
            Err(rejection) => Err(ApiError::bad_request(format!(
                "the query cannot be used: {}; see /api/v1/openapi.json for its form",
                rejection.body_text()
            ))),
        }
    }
}

impl<T: JsonSchema> OperationInput for InQuery<T> {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        Query::<T>::operation_input(context, operation);
    }
}

/// The header `Bench-Lease`; empty if it is absent.
pub struct LeaseHeader(pub String);

/// Name of the header with the lease.
pub const LEASE_HEADER: &str = "Bench-Lease";

impl<S: Send + Sync> FromRequestParts<S> for LeaseHeader {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, ApiError> {
        let value = parts.headers.get(LEASE_HEADER);
        let text = value.and_then(|value| value.to_str().ok());
        Ok(LeaseHeader(text.unwrap_or_default().into()))
    }
}

impl OperationInput for LeaseHeader {
    fn operation_input(context: &mut GenContext, operation: &mut Operation) {
        let schema = context.schema.subschema_for::<String>();
        let parameter = aide::openapi::Parameter::Header {
            parameter_data: aide::openapi::ParameterData {
                name: LEASE_HEADER.into(),
                description: Some("The arm lease, from POST /api/v1/lease.".into()),
                required: true,
                deprecated: None,
                format: aide::openapi::ParameterSchemaOrContent::Schema(
                    aide::openapi::SchemaObject {
                        json_schema: schema,
                        example: None,
                        external_docs: None,
                    },
                ),
                example: None,
                examples: Default::default(),
                explode: None,
                extensions: Default::default(),
            },
            style: aide::openapi::HeaderStyle::Simple,
        };
        aide::operation::add_parameters(context, operation, [parameter]);
    }
}

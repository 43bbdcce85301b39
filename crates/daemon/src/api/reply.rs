//! Answers whose status is part of their type, so that the description states it.

use aide::OperationOutput;
use aide::generate::GenContext;
use aide::openapi::{Operation, Response as Described, StatusCode as DescribedCode};
use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;

/// JSON with a status other than 200.
pub struct Reply<const STATUS: u16, T>(pub T);

/// Something new: 201.
pub type Created<T> = Reply<201, T>;
/// Something that will be done: 202.
pub type Accepted<T> = Reply<202, T>;

impl<const STATUS: u16, T: Serialize> IntoResponse for Reply<STATUS, T> {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(STATUS).unwrap_or(StatusCode::OK);
        (status, Json(self.0)).into_response()
    }
}

impl<const STATUS: u16, T: JsonSchema> OperationOutput for Reply<STATUS, T> {
    type Inner = T;

    fn operation_response(
        context: &mut GenContext,
        operation: &mut Operation,
    ) -> Option<Described> {
        Json::<T>::operation_response(context, operation)
    }

    fn inferred_responses(
        context: &mut GenContext,
        operation: &mut Operation,
    ) -> Vec<(Option<DescribedCode>, Described)> {
        let described = Self::operation_response(context, operation);
        let code = Some(DescribedCode::Code(STATUS));
        described
            .into_iter()
            .map(|body| (code.clone(), body))
            .collect()
    }
}

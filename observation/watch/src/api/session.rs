//! Logging in and out.

use std::sync::Arc;
use std::time::Instant;

use axum::Json;
use axum::extract::State;
use axum::extract::rejection::JsonRejection;
use axum::http::HeaderMap;
use axum::http::header::SET_COOKIE;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::json;

use super::Answered;
use crate::error::Problem;
use crate::guard::Gate;

#[derive(Deserialize)]
pub(crate) struct Login {
    token: String,
}

pub(crate) async fn log_in(
    State(gate): State<Arc<Gate>>,
    body: Result<Json<Login>, JsonRejection>,
) -> Answered<Response> {
    let Json(Login { token }) = body?;
    let Some(logins) = &gate.logins else {
        return Err(Problem::bad("this page has no logins"));
    };
    let person = logins.admit(&token).await;
    let person = person.ok_or_else(|| Problem::log_in("unknown token"))?;
    let name = person.name.clone();
    let cookie = logins
        .open(person, Instant::now())
        .ok_or_else(|| Problem::too_many("the system provides no random numbers"))?;
    Ok(([(SET_COOKIE, cookie)], Json(json!({ "person": name }))).into_response())
}

pub(crate) async fn log_out(
    State(gate): State<Arc<Gate>>,
    headers: HeaderMap,
) -> Answered<Response> {
    let Some(logins) = &gate.logins else {
        return Err(Problem::bad("this page has no logins"));
    };
    let cookie = logins.close(&headers);
    Ok(([(SET_COOKIE, cookie)], Json(json!({}))).into_response())
}

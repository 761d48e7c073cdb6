//! Metrics over HTTP: `GET /metrics`, and nothing else.

use std::net::SocketAddr;

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use understudy_view::Reading;

use crate::error::GatewayError;
use crate::followed::Followed;
use crate::serve_until_asked;

/// What OpenMetrics 1.0 wants to be called.
const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Serves the metrics of `run` until SIGINT or SIGTERM; `ready` is told where.
///
/// # Errors
/// It cannot listen there.
pub fn serve_metrics(
    run: &Followed,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), GatewayError> {
    let exposition = run.exposition();
    serve_until_asked(address, ready, |listener| async move {
        axum::serve(listener, router(exposition)).await
    })
}

fn router(
    exposition: impl Fn() -> Result<String, Reading> + Clone + Send + Sync + 'static,
) -> Router {
    let exposed = move || {
        let answer = match exposition() {
            Ok(text) => ([(header::CONTENT_TYPE, CONTENT_TYPE)], text).into_response(),
            Err(reading) => {
                let body = format!("{}: {reading}\n", Reading::CODE);
                (StatusCode::SERVICE_UNAVAILABLE, body).into_response()
            }
        };
        async move { answer }
    };
    Router::new()
        .route("/metrics", get(exposed))
        .fallback(|| async { (StatusCode::NOT_FOUND, "metrics are at /metrics\n") })
}

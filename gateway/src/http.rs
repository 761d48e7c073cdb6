//! Metrics over HTTP: `GET /metrics`, and nothing else.

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;

use crate::error::GatewayError;
use crate::followed::Followed;
use crate::metrics::Metrics;
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
    let metrics = Arc::clone(run.metrics());
    serve_until_asked(address, ready, |listener| async move {
        axum::serve(listener, router(metrics)).await
    })
}

fn router(metrics: Arc<Metrics>) -> Router {
    let exposed = move || {
        let text = metrics.exposition();
        async move { ([(header::CONTENT_TYPE, CONTENT_TYPE)], text).into_response() }
    };
    Router::new()
        .route("/metrics", get(exposed))
        .fallback(|| async { (StatusCode::NOT_FOUND, "metrics are at /metrics\n") })
}

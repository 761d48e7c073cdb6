//! Metrics over HTTP: `GET /metrics`, and nothing else.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use axum::Router;
use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use axum::routing::get;
use tokio::net::TcpListener;
use understudy_bus::{Connection, Connections, Listener};
use understudy_view::Reading;

use crate::error::GatewayError;
use crate::serve_until_asked;

/// What OpenMetrics 1.0 wants to be called.
const CONTENT_TYPE: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Connections at once.
const MOST_CONNECTIONS: usize = 64;

/// Who has not sent a whole request by then, or does not take the answer, is gone.
const PATIENCE: Duration = Duration::from_secs(20);

/// Serves the metrics that `exposition` gives until SIGINT or SIGTERM; `ready` gets the address.
///
/// # Errors
/// It cannot listen there.
pub fn serve_metrics(
    exposition: impl Fn() -> Result<String, Reading> + Clone + Send + Sync + 'static,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), GatewayError> {
    serve_until_asked(address, ready, |listener| async move {
        axum::serve(Limited::new(listener), router(exposition)).await
    })
}

struct Limited(Listener);

impl Limited {
    fn new(listener: TcpListener) -> Self {
        let connections = Connections::new(MOST_CONNECTIONS, 1);
        Self(Listener::new(listener, connections, PATIENCE))
    }
}

impl axum::serve::Listener for Limited {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        self.0.accept().await
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.0.local_addr()
    }
}

fn router(
    exposition: impl Fn() -> Result<String, Reading> + Clone + Send + Sync + 'static,
) -> Router {
    let exposed = move || async move {
        // The journals of a plant are read when it is asked.
        let answer = tokio::task::spawn_blocking(exposition).await;
        match answer.unwrap_or(Err(Reading { percent: 0 })) {
            Ok(text) => ([(header::CONTENT_TYPE, CONTENT_TYPE)], text).into_response(),
            Err(reading) => {
                let body = format!("{}: {reading}\n", Reading::CODE);
                (StatusCode::SERVICE_UNAVAILABLE, body).into_response()
            }
        }
    };
    Router::new()
        .route("/metrics", get(exposed))
        .fallback(|| async { (StatusCode::NOT_FOUND, "metrics are at /metrics\n") })
}

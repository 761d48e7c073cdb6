//! A run for other systems: read, and with an option its operator inputs written.
//!
//! ```text
//!   journal ──► Followed: snapshot ──┬─► Metrics     ──► Prometheus, over HTTP
//!   (files that grow)                ├─► RegisterMap ──► Modbus TCP: bits and registers
//!                                    ├─► Changes     ──► the command of `[notify]`
//!                                    └─► documents   ──► JSON under keys of Zenoh, at a limited rate
//! ```
//!
//! The gateways read the journal only, without any member. Writes go to the process that writes the run.
//!
//! The Modbus server also serves a program without a run, as equipment for tests: [`serve_equipment`].

#![allow(
    clippy::disallowed_methods,
    reason = "it looks at a journal again and again, by the clock"
)]

mod equipment;
mod error;
mod feed;
mod followed;
mod groups;
mod http;
mod labels;
mod metrics;
mod mirror;
mod modbus;
mod notify;
mod plant;
mod questions;
mod register_map;
mod requests;
mod writing;

pub use equipment::{Changed, Equipment, serve_equipment};
pub use error::GatewayError;
pub use feed::Feed;
pub use followed::{BOUNDS, Followed, Observation};
pub use groups::forward_signals;
pub use http::serve_metrics;
pub use metrics::{Metrics, exposition_of};
pub use mirror::{Rate, mirror};
pub use modbus::serve_modbus;
pub use notify::{Change, Notification, Notified, NotifyError, notify};
pub use plant::PlantMetrics;
pub use register_map::{Area, Place, ProcessImage, RegisterMap};
pub use writing::{MAXIMUM_WRITES, WRITES_PER_SECOND, WriteGate};

/// A run that is followed.
pub use understudy_view::Run;

use std::future::Future;
use std::net::SocketAddr;

use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};

/// One thread serves all clients, so that the cluster is not disturbed.
fn runtime() -> Result<Runtime, GatewayError> {
    Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .map_err(|source| GatewayError::System { what: "a thread to serve with", source })
}

async fn listen(address: SocketAddr) -> Result<TcpListener, GatewayError> {
    TcpListener::bind(address).await.map_err(|source| GatewayError::Listen { address, source })
}

/// Ends with SIGINT or with SIGTERM, which are listened for from this call on, within a runtime.
fn asked_to_end() -> impl Future<Output = ()> {
    use tokio::signal::unix::{SignalKind, signal};
    let of = |kind| {
        let listened = signal(kind);
        async move {
            match listened {
                Ok(mut signal) => {
                    signal.recv().await;
                }
                // Without the right to listen to signals their default ends the process.
                Err(_) => std::future::pending().await,
            }
        }
    };
    let interrupt = of(SignalKind::interrupt());
    let terminate = of(SignalKind::terminate());
    async move {
        tokio::select! {
            () = interrupt => {}
            () = terminate => {}
        }
    }
}

/// Runs `serve` on a listener at `address` until a signal; `ready` gets its address.
///
/// # Errors
/// It cannot listen there, or `serve` fails.
pub fn serve_until_asked<F>(
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
    serve: impl FnOnce(TcpListener) -> F,
) -> Result<(), GatewayError>
where
    F: Future<Output = std::io::Result<()>>,
{
    runtime()?.block_on(async {
        let listener = listen(address).await?;
        // A signal may come as soon as the address is known.
        let end = asked_to_end();
        let system = |source| GatewayError::System { what: "serving", source };
        ready(listener.local_addr().map_err(system)?);
        tokio::select! {
            ended = serve(listener) => ended.map_err(system),
            () = end => Ok(()),
        }
    })
}

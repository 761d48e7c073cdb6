//! Connections, in the clear or over TLS, and never more than a bound of them.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::serve::Listener;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpListener;
use tokio::sync::mpsc;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;
use understudy_bus::{Connection as Limited, Connections, Listener as Limiting};
use understudy_journal::DECIDED_WITHIN;

/// Connections at once.
const MAXIMUM_CONNECTIONS: usize = 512;

/// Who does not finish the handshake by then is gone.
const HANDSHAKE_PATIENCE: Duration = Duration::from_secs(3);

/// Time limit for a whole request and for its answer. A viewer gets a message more often; the answer to a write takes the longest.
const PATIENCE: Duration = Duration::from_secs(40);

const _: () = assert!(PATIENCE.as_secs() > DECIDED_WITHIN.as_secs());

/// A connection that counts among the bounded.
pub(crate) enum Connection {
    Clear(Limited),
    Tls(Box<TlsStream<Limited>>),
}

/// Accepts connections; handshakes run concurrently.
pub(crate) struct Doors {
    accepted: mpsc::Receiver<(Connection, SocketAddr)>,
    address: SocketAddr,
}

impl Doors {
    pub(crate) fn open(listener: TcpListener, tls: Option<TlsAcceptor>) -> io::Result<Self> {
        let address = listener.local_addr()?;
        let (sender, accepted) = mpsc::channel(16);
        let connections = Connections::new(MAXIMUM_CONNECTIONS, 1);
        let listener = Limiting::new(listener, connections, PATIENCE);
        tokio::spawn(accept_all(listener, tls, sender));
        Ok(Self { accepted, address })
    }
}

async fn accept_all(
    mut listener: Limiting,
    tls: Option<TlsAcceptor>,
    sender: mpsc::Sender<(Connection, SocketAddr)>,
) {
    loop {
        let (stream, peer) = listener.accept().await;
        let (tls, sender) = (tls.clone(), sender.clone());
        tokio::spawn(async move {
            let connection = match tls {
                None => Connection::Clear(stream),
                Some(tls) => {
                    let handshake = tokio::time::timeout(HANDSHAKE_PATIENCE, tls.accept(stream));
                    match handshake.await {
                        Ok(Ok(stream)) => Connection::Tls(Box::new(stream)),
                        Ok(Err(error)) => {
                            tracing::debug!(%peer, %error, "a TLS handshake failed");
                            return;
                        }
                        Err(_) => {
                            tracing::debug!(%peer, "a TLS handshake took too long");
                            return;
                        }
                    }
                }
            };
            // Without a receiver the server has ended.
            let _ = sender.send((connection, peer)).await;
        });
    }
}

impl Listener for Doors {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        match self.accepted.recv().await {
            Some(accepted) => accepted,
            None => std::future::pending().await,
        }
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        Ok(self.address)
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Clear(stream) => Pin::new(stream).poll_read(context, buffer),
            Self::Tls(stream) => Pin::new(stream).poll_read(context, buffer),
        }
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        match &mut *self {
            Self::Clear(stream) => Pin::new(stream).poll_write(context, bytes),
            Self::Tls(stream) => Pin::new(stream).poll_write(context, bytes),
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Clear(stream) => Pin::new(stream).poll_flush(context),
            Self::Tls(stream) => Pin::new(stream).poll_flush(context),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Clear(stream) => Pin::new(stream).poll_shutdown(context),
            Self::Tls(stream) => Pin::new(stream).poll_shutdown(context),
        }
    }
}

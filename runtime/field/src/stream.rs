//! A TCP connection to a device whose end is an error that says so: the Modbus library reports the last error of the system in its place.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;

#[derive(Debug)]
pub(crate) struct DeviceStream(pub(crate) TcpStream);

impl AsyncRead for DeviceStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.0).poll_read(context, buffer))?;
        if buffer.filled().len() == before && buffer.remaining() > 0 {
            let reason = "the device has closed the connection";
            return Poll::Ready(Err(io::Error::new(io::ErrorKind::UnexpectedEof, reason)));
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncWrite for DeviceStream {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.0).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.0).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::AsyncReadExt as _;
    use tokio::net::TcpListener;
    use tokio_modbus::client::{Reader as _, tcp};
    use tokio_modbus::slave::Slave;

    use super::*;

    /// A device that accepts, reads a request, and closes.
    #[test]
    fn a_device_that_closes_the_connection_is_named() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        runtime.expect("a runtime").block_on(async {
            for takes in [0, 1, 12] {
                let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
                let address = listener.local_addr().expect("an address");
                let device = async {
                    let (mut stream, _) = listener.accept().await.expect("a connection");
                    let mut bytes = vec![0; takes];
                    stream.read_exact(&mut bytes).await.expect("a request");
                };
                let asks = async {
                    let stream = TcpStream::connect(address).await.expect("a connection");
                    let mut device = tcp::attach_slave(DeviceStream(stream), Slave(1));
                    device.read_holding_registers(0, 1).await
                };
                let ((), answer) = tokio::join!(device, asks);
                let error = answer.expect_err("no answer").to_string();
                // What was not read resets the connection.
                let is_named = error.contains("the device has closed the connection")
                    || takes < 12 && error.contains("Connection reset");
                assert!(is_named, "{takes}: {error}");
            }
        });
    }
}

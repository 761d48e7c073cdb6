//! Requests of Modbus clients, checked before the library reads them.
//!
//! The library ends a connection with the first request that is not as the standard has it: an unknown function, a byte count that is not that of
//! the quantity, or a length that is not that of the function. A device answers those with an exception, and the connection stays. Only bytes that
//! are no Modbus TCP at all end it.

use std::io;
use std::pin::Pin;
use std::task::{Context, Poll, ready};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio_modbus::ExceptionCode;

/// Transaction, protocol, length and unit.
const HEAD: usize = 7;

/// Bytes of a request after its head.
const MOST_PDU: usize = 253;

/// Coils of one request to write.
const MOST_COILS: usize = 1968;

/// Registers of one request to write.
const MOST_WRITTEN: usize = 123;

/// A connection over which only right requests come in; the others are answered here.
#[derive(Debug)]
pub(crate) struct Checked<S> {
    stream: S,
    /// What came in and was not checked yet.
    received: Vec<u8>,
    /// What is right, and not read yet.
    right: Vec<u8>,
    /// Exceptions that are not written yet.
    exceptions: Vec<u8>,
}

impl<S> Checked<S> {
    pub(crate) fn new(stream: S) -> Self {
        Self { stream, received: Vec::new(), right: Vec::new(), exceptions: Vec::new() }
    }

    /// Checks the first request that is received as a whole; false where no whole request is received.
    fn check(&mut self) -> io::Result<bool> {
        let Some(head) = self.received.first_chunk::<HEAD>() else {
            return Ok(false);
        };
        let [.., protocol_high, protocol_low, length_high, length_low, _unit] = *head;
        let length = usize::from(u16::from_be_bytes([length_high, length_low]));
        let is_modbus = [protocol_high, protocol_low] == [0, 0];
        // The length counts the unit.
        let pdu = length.checked_sub(1).filter(|pdu| is_modbus && (1..=MOST_PDU).contains(pdu));
        let pdu = pdu.ok_or(io::ErrorKind::InvalidData)?;
        if self.received.len() < HEAD + pdu {
            return Ok(false);
        }
        let rest = self.received.split_off(HEAD + pdu);
        let mut request = std::mem::replace(&mut self.received, rest);
        match exception_of(&request[HEAD..]) {
            None => self.right.append(&mut request),
            Some(code) => {
                let function = request[HEAD] | 0x80;
                self.exceptions.extend_from_slice(&request[..4]);
                self.exceptions.extend_from_slice(&[0, 3, request[6], function, code.into()]);
            }
        }
        Ok(true)
    }
}

/// The exception that a request deserves by its form; nothing for a right one.
fn exception_of(pdu: &[u8]) -> Option<ExceptionCode> {
    let word = |place: usize| {
        let word = pdu.get(place..place + 2)?.first_chunk::<2>()?;
        Some(u16::from_be_bytes(*word))
    };
    let quantity = word(3).map(usize::from);
    // What follows the byte count is as long as it says and as the quantity needs.
    let is_counted = |most: usize, bytes: fn(usize) -> usize| {
        quantity.is_some_and(|quantity| {
            let bytes = bytes(quantity);
            let is_some = (1..=most).contains(&quantity);
            is_some
                && pdu.get(5).map(|count| usize::from(*count)) == Some(bytes)
                && pdu.len() == 6 + bytes
        })
    };
    let is_right = match pdu.first()? {
        1..=4 | 6 => pdu.len() == 5,
        5 => pdu.len() == 5 && matches!(quantity, Some(0 | 0xff00)),
        15 => is_counted(MOST_COILS, |coils| coils.div_ceil(8)),
        16 => is_counted(MOST_WRITTEN, |registers| 2 * registers),
        _ => return Some(ExceptionCode::IllegalFunction),
    };
    (!is_right).then_some(ExceptionCode::IllegalDataValue)
}

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncRead for Checked<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let this = &mut *self;
        loop {
            // The library reads the next request when its answer to the last one is written, so nothing comes between the bytes of an answer.
            while !this.exceptions.is_empty() {
                let written =
                    ready!(Pin::new(&mut this.stream).poll_write(context, &this.exceptions));
                let written = written?;
                if written == 0 {
                    return Poll::Ready(Err(io::ErrorKind::WriteZero.into()));
                }
                this.exceptions.drain(..written);
            }
            if !this.right.is_empty() {
                let length = this.right.len().min(buffer.remaining());
                buffer.put_slice(&this.right[..length]);
                this.right.drain(..length);
                return Poll::Ready(Ok(()));
            }
            if this.check()? {
                continue;
            }
            let mut bytes = [0; HEAD + MOST_PDU];
            let mut received = ReadBuf::new(&mut bytes);
            ready!(Pin::new(&mut this.stream).poll_read(context, &mut received))?;
            if received.filled().is_empty() {
                return Poll::Ready(Ok(()));
            }
            this.received.extend_from_slice(received.filled());
        }
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for Checked<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{SocketAddr, TcpStream};
    use std::time::Duration;

    use tokio::net::TcpListener;
    use tokio_modbus::server::Service;
    use tokio_modbus::{Request, Response};

    use crate::modbus::{Answering, serve};

    /// Answers each request with zeros.
    struct Zeros;

    impl Service for Zeros {
        type Request = Request<'static>;
        type Response = Response;
        type Exception = super::ExceptionCode;
        type Future = Answering;

        fn call(&self, request: Self::Request) -> Self::Future {
            Box::pin(async move {
                Ok(match request {
                    Request::ReadCoils(_, count) => {
                        Response::ReadCoils(vec![false; usize::from(count.min(8))])
                    }
                    Request::WriteSingleCoil(address, value) => {
                        Response::WriteSingleCoil(address, value)
                    }
                    Request::WriteMultipleCoils(address, values) => {
                        Response::WriteMultipleCoils(address, values.len() as u16)
                    }
                    Request::WriteMultipleRegisters(address, words) => {
                        Response::WriteMultipleRegisters(address, words.len() as u16)
                    }
                    _ => return Err(super::ExceptionCode::ServerDeviceBusy),
                })
            })
        }
    }

    fn server() -> SocketAddr {
        let (told, address) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            runtime.expect("a runtime").block_on(async {
                let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
                told.send(listener.local_addr().expect("bound")).expect("it waits");
                serve(listener, |_| Zeros).await
            })
        });
        address.recv().expect("it listens")
    }

    fn client(address: SocketAddr) -> TcpStream {
        let stream = TcpStream::connect(address).expect("it listens");
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a time");
        stream
    }

    /// Sends a request, and gives the PDU of the answer to it.
    fn ask(stream: &mut TcpStream, number: u16, pdu: &[u8]) -> Vec<u8> {
        let length = (pdu.len() + 1) as u16;
        let [high, low] = number.to_be_bytes();
        let head = [high, low, 0, 0, length.to_be_bytes()[0], length.to_be_bytes()[1], 9];
        stream.write_all(&[&head, pdu].concat()).expect("open");
        let mut head = [0; 7];
        stream.read_exact(&mut head).expect("an answer");
        assert_eq!((&head[..4], head[6]), (&[high, low, 0, 0][..], 9), "{pdu:?}");
        let mut answer = vec![0; usize::from(head[5]) - 1];
        stream.read_exact(&mut answer).expect("an answer");
        answer
    }

    #[test]
    fn a_request_of_the_wrong_form_is_answered_by_an_exception() {
        let mut stream = client(server());
        let cases: [(&[u8], &[u8]); 16] = [
            // The byte count is not that of the quantity.
            (&[16, 0, 0, 0, 2, 3, 0, 1, 0], &[0x90, 3]),
            (&[16, 0, 0, 0, 2, 2, 0, 1], &[0x90, 3]),
            (&[16, 0, 0, 0x80, 1, 2, 0, 1], &[0x90, 3]),
            (&[16, 0, 0, 0, 0, 0], &[0x90, 3]),
            (&[16, 0, 0, 0, 1, 2, 0], &[0x90, 3]),
            (&[15, 0, 0, 0, 9, 1, 1], &[0x8f, 3]),
            (&[15, 0, 0, 0xff, 0xff, 1, 1], &[0x8f, 3]),
            // The length is not that of the function.
            (&[1, 0, 0, 0], &[0x81, 3]),
            (&[4, 0, 0, 0, 1, 0], &[0x84, 3]),
            (&[5, 0, 0, 1, 0], &[0x85, 3]),
            (&[6], &[0x86, 3]),
            // No such function.
            (&[0x2b, 1], &[0xab, 1]),
            (&[0xff], &[0xff, 1]),
            // Right ones between them.
            (&[1, 0, 0, 0, 1], &[1, 1, 0]),
            (&[15, 0, 0, 0, 9, 2, 1, 1], &[15, 0, 0, 0, 9]),
            (&[16, 0, 0, 0, 1, 2, 0, 1], &[16, 0, 0, 0, 1]),
        ];
        for (number, (pdu, expected)) in cases.into_iter().enumerate() {
            assert_eq!(ask(&mut stream, number as u16, pdu), expected, "{pdu:?}");
        }
    }

    /// Whatever a request says, it has one answer, and the next one has its own: all functions, with 0 to 9 bytes of a few patterns.
    #[test]
    fn no_request_ends_its_connection() {
        let mut stream = client(server());
        for function in 0..=u8::MAX {
            for length in 0..=9 {
                for pattern in [[0, 0], [0, 1], [1, 2], [0xff, 0xff], [2, 0]] {
                    let rest = pattern.iter().cycle().take(length);
                    let pdu: Vec<u8> = std::iter::once(&function).chain(rest).copied().collect();
                    let answer = ask(&mut stream, 1, &pdu);
                    assert_eq!(answer[0] | 0x80, function | 0x80, "{pdu:?}");
                }
                assert_eq!(ask(&mut stream, 2, &[1, 0, 0, 0, 1]), [1, 1, 0], "{function}");
            }
        }
    }

    #[test]
    fn what_is_no_modbus_ends_its_connection() {
        let address = server();
        for bytes in [
            *b"GET / HTTP/1",
            // No PDU, and one that is too long.
            [0, 1, 0, 0, 0, 1, 9, 1, 0, 0, 0, 1],
            [0, 1, 0, 0, 1, 0, 9, 1, 0, 0, 0, 1],
            [0, 1, 0, 7, 0, 6, 9, 1, 0, 0, 0, 1],
        ] {
            let mut stream = client(address);
            stream.write_all(&bytes).expect("open");
            let mut answer = Vec::new();
            // The system resets a connection whose bytes were not all read.
            let _ = stream.read_to_end(&mut answer);
            assert!(answer.is_empty(), "{bytes:?}: {answer:?}");
        }
    }
}

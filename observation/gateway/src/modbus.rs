//! The process image over Modbus TCP, read-only: write requests are answered by exception 1, *illegal function*. While the journal is being read,
//! every request is answered by exception 6, *server device busy*.

use std::future::{Ready, ready};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use tokio::net::{TcpListener, TcpStream};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;
use tokio_modbus::{ExceptionCode, Request, Response};
use understudy_bus::{Connections, Listener, relay};

use crate::error::GatewayError;
use crate::followed::Followed;
use crate::register_map::{ProcessImage, RegisterMap};
use crate::serve_until_asked;

/// Connections at once.
const MOST_CLIENTS: usize = 64;

/// Time limit for the next request and for taking an answer.
const PATIENCE: Duration = Duration::from_secs(60);

/// By the standard, in one answer.
const MOST_BITS: u16 = 2000;

/// Likewise.
const MOST_REGISTERS: u16 = 125;

/// Serves the process image of `run` until SIGINT or SIGTERM; `ready` gets the address.
///
/// # Errors
/// It cannot listen there, or the cluster has more signals than there are addresses.
pub fn serve_modbus(
    run: Followed,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), GatewayError> {
    let map = Arc::new(RegisterMap::new(run.cluster())?);
    let run = Arc::new(run);
    serve_until_asked(address, ready, |listener| serve(listener, run, map))
}

async fn serve(
    listener: TcpListener,
    run: Arc<Followed>,
    map: Arc<RegisterMap>,
) -> std::io::Result<()> {
    let inner = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await?;
    let address = inner.local_addr()?;
    let connections = Connections::new(MOST_CLIENTS, 3);
    let relayed = relay(Listener::new(listener, connections, PATIENCE), address);
    let connected = move |stream: TcpStream, _: SocketAddr| {
        let (run, map) = (Arc::clone(&run), Arc::clone(&map));
        async move { Ok(Some((Client { run, map }, stream))) }
    };
    // The library ends with the first connection that the system refuses, so it only gets admitted connections.
    let server = Server::new(inner);
    tokio::select! {
        // A client that closes its connection, or sends an invalid request, is disconnected; the others stay.
        ended = server.serve(&connected, |_| {}) => ended,
        never = relayed => match never {},
    }
}

struct Client {
    run: Arc<Followed>,
    map: Arc<RegisterMap>,
}

impl Service for Client {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Ready<Result<Response, ExceptionCode>>;

    fn call(&self, request: Self::Request) -> Self::Future {
        // Stale values would be mistaken for the present.
        let present = self.run.snapshot();
        let present = present.map_err(|_reading| ExceptionCode::ServerDeviceBusy);
        ready(present.and_then(|present| answer(&self.map.image(&present), &request)))
    }
}

fn answer(image: &ProcessImage, request: &Request<'_>) -> Result<Response, ExceptionCode> {
    match *request {
        Request::ReadCoils(address, count) => {
            part(&image.coils, address, count, MOST_BITS).map(Response::ReadCoils)
        }
        Request::ReadDiscreteInputs(address, count) => {
            part(&image.inputs, address, count, MOST_BITS).map(Response::ReadDiscreteInputs)
        }
        Request::ReadInputRegisters(address, count) => {
            part(&image.registers, address, count, MOST_REGISTERS).map(Response::ReadInputRegisters)
        }
        Request::ReadHoldingRegisters(address, count) => {
            part(&image.registers, address, count, MOST_REGISTERS)
                .map(Response::ReadHoldingRegisters)
        }
        _ => Err(ExceptionCode::IllegalFunction),
    }
}

fn part<T: Copy>(
    table: &[T],
    address: u16,
    count: u16,
    most: u16,
) -> Result<Vec<T>, ExceptionCode> {
    if count == 0 || count > most {
        return Err(ExceptionCode::IllegalDataValue);
    }
    let start = usize::from(address);
    let found = table.get(start..start + usize::from(count));
    found
        .map(<[T]>::to_vec)
        .ok_or(ExceptionCode::IllegalDataAddress)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(request: &Request<'_>, expected: Result<Response, ExceptionCode>) {
        let image = ProcessImage {
            inputs: vec![true, false, true],
            coils: vec![false, true],
            registers: vec![1, 2, 3],
        };
        assert_eq!(answer(&image, request), expected, "{request:?}");
    }

    #[test]
    fn what_is_there_can_be_read_and_nothing_can_be_written() {
        check(
            &Request::ReadDiscreteInputs(0, 3),
            Ok(Response::ReadDiscreteInputs(vec![true, false, true])),
        );
        check(
            &Request::ReadCoils(1, 1),
            Ok(Response::ReadCoils(vec![true])),
        );
        check(
            &Request::ReadInputRegisters(1, 2),
            Ok(Response::ReadInputRegisters(vec![2, 3])),
        );
        check(
            &Request::ReadHoldingRegisters(2, 1),
            Ok(Response::ReadHoldingRegisters(vec![3])),
        );
        for (address, count) in [(3, 1), (2, 2), (u16::MAX, 1)] {
            check(
                &Request::ReadInputRegisters(address, count),
                Err(ExceptionCode::IllegalDataAddress),
            );
        }
        for count in [0, 126, u16::MAX] {
            check(
                &Request::ReadInputRegisters(0, count),
                Err(ExceptionCode::IllegalDataValue),
            );
        }
        for request in [
            Request::WriteSingleCoil(0, true),
            Request::WriteSingleRegister(0, 7),
            Request::WriteMultipleCoils(0, vec![true].into()),
            Request::WriteMultipleRegisters(0, vec![1].into()),
            Request::MaskWriteRegister(0, 0, 0),
        ] {
            check(&request, Err(ExceptionCode::IllegalFunction));
        }
    }
}

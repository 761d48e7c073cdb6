//! The process image over Modbus TCP. Without a [`WriteGate`] write requests are answered by exception 1, *illegal function*. While the
//! journal is being read, every request to read is answered by exception 6, *server device busy*; while the run is not current, every one
//! but those for the registers of the run itself.

use std::future::Future;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::pin::Pin;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::net::{TcpListener, TcpStream};
use tokio_modbus::server::Service;
use tokio_modbus::server::tcp::Server;
use tokio_modbus::{ExceptionCode, Request, Response};
use understudy_bus::{Connections, Listener, RelayedCallers, relay_known};
use understudy_journal::{DECIDED_WITHIN, Refusal, RequestedValue, WriteRequest};
use understudy_wire::{MAXIMUM_OWNER_LENGTH, Role};

use crate::error::GatewayError;
use crate::feed::Feed;
use crate::followed::Followed;
use crate::register_map::{Area, ProcessImage, RegisterMap, Target};
use crate::requests::Checked;
use crate::serve_until_asked;
use crate::writing::WriteGate;

/// Values of one request to write.
const MOST_WRITES: usize = 8;

/// Reason of every write in the journal.
const REASON: &str = "by Modbus TCP";

/// Connections at once.
const MOST_CLIENTS: usize = 64;

/// Time limit for the next request and for taking an answer.
const PATIENCE: Duration = Duration::from_secs(60);

const _: () = assert!(PATIENCE.as_secs() > DECIDED_WITHIN.as_secs());

/// By the standard, in one answer.
const MOST_BITS: u16 = 2000;

/// Likewise.
pub(crate) const MOST_REGISTERS: u16 = 125;

/// Serves the process image of `run` until SIGINT or SIGTERM; `ready` gets the address. Clients write operator inputs through `gate`, with
/// the role of an operator.
///
/// # Errors
/// It cannot listen there, or the cluster has more signals than there are addresses.
pub fn serve_modbus(
    run: Followed,
    gate: Option<WriteGate>,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
) -> Result<(), GatewayError> {
    let map = RegisterMap::new(run.cluster())?;
    let served = Arc::new(Served { run, map, gate });
    let client = move |caller| Client { served: Arc::clone(&served), caller };
    serve_until_asked(address, ready, |listener| serve(listener, client))
}

/// What all clients share.
struct Served {
    run: Followed,
    map: RegisterMap,
    gate: Option<WriteGate>,
}

/// Future of an answer.
pub(crate) type Answering = Pin<Box<dyn Future<Output = Result<Response, ExceptionCode>> + Send>>;

/// Serves each client with the service that `client` makes for its address.
pub(crate) async fn serve<S>(
    listener: TcpListener,
    client: impl Fn(IpAddr) -> S,
) -> std::io::Result<()>
where
    S: Service<
            Request = Request<'static>,
            Response = Response,
            Exception = ExceptionCode,
            Future = Answering,
        > + Send
        + Sync
        + 'static,
{
    let inner = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).await?;
    let address = inner.local_addr()?;
    let connections = Connections::new(MOST_CLIENTS, 3);
    let callers = RelayedCallers::default();
    let listener = Listener::new(listener, connections, PATIENCE);
    let relayed = relay_known(listener, address, callers.clone());
    let connected = move |stream: TcpStream, seen: SocketAddr| {
        let client = client(callers.of(seen).unwrap_or(seen).ip());
        async move { Ok(Some((client, Checked::new(stream)))) }
    };
    // The library ends with the first connection that the system refuses, so it only gets admitted connections.
    let server = Server::new(inner);
    tokio::select! {
        // A client that closes its connection, or sends what is not Modbus TCP, is disconnected; the others stay.
        ended = server.serve(&connected, |_| {}) => ended,
        never = relayed => match never {},
    }
}

struct Client {
    served: Arc<Served>,
    caller: IpAddr,
}

impl Service for Client {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Answering;

    fn call(&self, request: Self::Request) -> Self::Future {
        let (served, caller) = (Arc::clone(&self.served), self.caller);
        Box::pin(async move {
            let Served { run, map, gate } = &*served;
            if let (Some(gate), Some(written)) = (gate, written(map, &request)) {
                write(gate, caller, &written?).await?;
                return Ok(confirmation(&request));
            }
            // Stale values would be mistaken for the present.
            let present = run.observation();
            let present = present.map_err(|_reading| ExceptionCode::ServerDeviceBusy)?;
            let feed = present.feed(Instant::now());
            if feed == Feed::Silent && !is_of_run(&request) {
                return Err(ExceptionCode::ServerDeviceBusy);
            }
            answer(&map.image_of(&present, feed), &request)
        })
    }
}

/// Values of operator inputs, as they are stored.
type Written<'a> = Vec<(&'a Target, u64)>;

/// The operator inputs that a request writes; nothing for one that writes none.
fn written<'a>(
    map: &'a RegisterMap,
    request: &Request<'_>,
) -> Option<Result<Written<'a>, ExceptionCode>> {
    Some(match request {
        Request::WriteSingleCoil(address, value) => map.written_coils(*address, &[*value]),
        Request::WriteMultipleCoils(address, values) => map.written_coils(*address, values),
        Request::WriteSingleRegister(address, word) => map.written_registers(*address, &[*word]),
        Request::WriteMultipleRegisters(address, words) => map.written_registers(*address, words),
        _ => return None,
    })
}

/// Writes one value after the other; none where one of them is invalid.
async fn write(
    gate: &WriteGate,
    caller: IpAddr,
    written: &[(&Target, u64)],
) -> Result<(), ExceptionCode> {
    if written.is_empty() || written.len() > MOST_WRITES {
        return Err(ExceptionCode::IllegalDataValue);
    }
    // A long IPv6 address loses its end.
    let owner = format!("modbus {}", caller.to_canonical());
    let owner: String = owner.chars().take(MAXIMUM_OWNER_LENGTH).collect();
    // The registers are those of the cluster file, whatever an online change brings.
    if !written.iter().all(|(target, _)| gate.has(target.member, &target.point)) {
        return Err(ExceptionCode::IllegalDataAddress);
    }
    let checked = written.iter().map(|(target, stored)| {
        let request = WriteRequest {
            input: &target.point.name,
            value: RequestedValue::Stored(*stored),
            role: Role::Operator,
            owner: &owner,
            reason: REASON,
        };
        let write = gate.check(target.member, &request);
        write.map(|write| (target.member, write)).map_err(|refusal| exception(&refusal))
    });
    let checked: Vec<_> = checked.collect::<Result<_, _>>()?;
    for (place, (member, write)) in checked.into_iter().enumerate() {
        let done = gate.send(member, write, None).await;
        done.map_err(|refusal| match place {
            0 => exception(&refusal),
            // The values before it are in effect.
            _ => ExceptionCode::ServerDeviceFailure,
        })?;
    }
    Ok(())
}

/// The exception of a refusal: *busy* where the same request may be sent again, because it had no effect.
fn exception(refusal: &Refusal) -> ExceptionCode {
    match refusal.code().as_str() {
        "U0640" | "U0643" => ExceptionCode::IllegalDataAddress,
        "U0641" | "U0642" => ExceptionCode::IllegalDataValue,
        "U0551" | "U0557" | "U0645" | "U0646" | "U0647" | "U0649" => {
            ExceptionCode::ServerDeviceBusy
        }
        _ => ExceptionCode::ServerDeviceFailure,
    }
}

/// The answer to a request whose values are in effect.
fn confirmation(request: &Request<'_>) -> Response {
    let count = |count: usize| u16::try_from(count).unwrap_or(u16::MAX);
    match request {
        Request::WriteSingleCoil(address, value) => Response::WriteSingleCoil(*address, *value),
        Request::WriteSingleRegister(address, word) => {
            Response::WriteSingleRegister(*address, *word)
        }
        Request::WriteMultipleCoils(address, values) => {
            Response::WriteMultipleCoils(*address, count(values.len()))
        }
        Request::WriteMultipleRegisters(address, words) => {
            Response::WriteMultipleRegisters(*address, count(words.len()))
        }
        // Others are not written.
        _ => Response::Custom(0, Vec::new().into()),
    }
}

/// Whether a request reads the registers of the run alone.
fn is_of_run(request: &Request<'_>) -> bool {
    match *request {
        Request::ReadInputRegisters(address, count)
        | Request::ReadHoldingRegisters(address, count) => RegisterMap::is_of_run(address, count),
        _ => false,
    }
}

fn answer(image: &ProcessImage, request: &Request<'_>) -> Result<Response, ExceptionCode> {
    let known = |area, address, count| {
        let first = usize::from(address);
        let is_known = image.is_known(area, &(first..first + usize::from(count)));
        is_known.then_some(()).ok_or(ExceptionCode::GatewayTargetDevice)
    };
    let bits = |table, area, address, count| {
        let bits = part(table, address, count, MOST_BITS)?;
        known(area, address, count).map(|()| bits)
    };
    let registers = |address, count| {
        let registers = part(&image.registers, address, count, MOST_REGISTERS)?;
        known(Area::Register, address, count).map(|()| registers)
    };
    match *request {
        Request::ReadCoils(address, count) => {
            bits(&image.coils, Area::Coil, address, count).map(Response::ReadCoils)
        }
        Request::ReadDiscreteInputs(address, count) => {
            let inputs = bits(&image.inputs, Area::DiscreteInput, address, count);
            inputs.map(Response::ReadDiscreteInputs)
        }
        Request::ReadInputRegisters(address, count) => {
            registers(address, count).map(Response::ReadInputRegisters)
        }
        Request::ReadHoldingRegisters(address, count) => {
            registers(address, count).map(Response::ReadHoldingRegisters)
        }
        _ => Err(ExceptionCode::IllegalFunction),
    }
}

/// Consecutive values of a table.
pub(crate) fn part<T: Copy>(
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
    found.map(<[T]>::to_vec).ok_or(ExceptionCode::IllegalDataAddress)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(request: &Request<'_>, expected: Result<Response, ExceptionCode>) {
        let image = ProcessImage {
            inputs: vec![true, false, true],
            coils: vec![false, true],
            registers: vec![1, 2, 3],
            unknown: Vec::new(),
        };
        assert_eq!(answer(&image, request), expected, "{request:?}");
    }

    /// Every range of a table of six, of which two have no value.
    #[test]
    fn a_value_that_is_not_known_is_an_exception() {
        let image = ProcessImage {
            inputs: vec![true; 6],
            coils: vec![true; 6],
            registers: vec![7; 6],
            unknown: vec![(Area::Register, 2..4)],
        };
        for (address, count) in
            (0..6).flat_map(|from| (1..=6 - from).map(move |count| (from, count)))
        {
            let is_known = !(address..address + count).any(|place| (2..4).contains(&place));
            let expected = match is_known {
                true => Ok(Response::ReadInputRegisters(vec![7; usize::from(count)])),
                false => Err(ExceptionCode::GatewayTargetDevice),
            };
            let request = Request::ReadInputRegisters(address, count);
            assert_eq!(answer(&image, &request), expected, "{request:?}");
            assert!(answer(&image, &Request::ReadCoils(address, count)).is_ok());
        }
    }

    #[test]
    fn what_is_there_can_be_read_and_nothing_can_be_written() {
        check(
            &Request::ReadDiscreteInputs(0, 3),
            Ok(Response::ReadDiscreteInputs(vec![true, false, true])),
        );
        check(&Request::ReadCoils(1, 1), Ok(Response::ReadCoils(vec![true])));
        check(&Request::ReadInputRegisters(1, 2), Ok(Response::ReadInputRegisters(vec![2, 3])));
        check(&Request::ReadHoldingRegisters(2, 1), Ok(Response::ReadHoldingRegisters(vec![3])));
        for (address, count) in [(3, 1), (2, 2), (u16::MAX, 1)] {
            check(
                &Request::ReadInputRegisters(address, count),
                Err(ExceptionCode::IllegalDataAddress),
            );
        }
        for count in [0, 126, u16::MAX] {
            check(&Request::ReadInputRegisters(0, count), Err(ExceptionCode::IllegalDataValue));
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

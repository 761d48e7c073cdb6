//! A program as a Modbus TCP device: simulated equipment behind a real field bus.
//!
//! ```text
//!   holding registers   inputs of the program, in order of declaration, from 0; written and read
//!   input registers     its outputs, likewise; read
//! ```
//!
//! A BOOL is bit 0 of a register, a number has the registers of its type, the most significant one first. One request is read or written whole
//! between two scans.

use std::fmt;
use std::future::pending;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use tokio::time::{MissedTickBehavior, interval};
use tokio_modbus::server::Service;
use tokio_modbus::{ExceptionCode, Request, Response};
use understudy_cluster::{BitPlace, ByteOrder, Place, RegisterTable, Registers};
use understudy_executable::{Executable, Interface, Scratch, declared};
use understudy_typed::{Elementary, Point, Points};

use crate::error::GatewayError;
use crate::modbus::{Answering, MOST_REGISTERS, part, serve};
use crate::serve_until_asked;

/// Number of addresses of registers.
const ADDRESSES: usize = 1 << 16;

/// A program, its state, and its points as registers.
pub struct Equipment {
    executable: Executable,
    interface: Interface,
    holding: Vec<u16>,
    input: Vec<u16>,
    scratch: Scratch,
    state: Vec<u64>,
    /// u and y of the last scan.
    inputs: Vec<u64>,
    outputs: Vec<u64>,
}

impl Equipment {
    /// The equipment before its first scan.
    ///
    /// # Errors
    /// More registers than addresses.
    pub fn new(executable: Executable, interface: Interface) -> Result<Self, GatewayError> {
        let table = |points: &Points| {
            let registers = declared(points).map(|point| registers_of(point.of)).sum();
            if registers > ADDRESSES {
                return Err(GatewayError::TooManyRegisters { registers, most: ADDRESSES });
            }
            Ok(vec![0; registers])
        };
        let image = |points: &Points| vec![0; points.width().div_ceil(64)];
        Ok(Self {
            holding: table(&interface.inputs)?,
            input: table(&interface.outputs)?,
            scratch: Scratch::default(),
            state: executable.initial().to_vec(),
            inputs: image(&interface.inputs),
            outputs: image(&interface.outputs),
            executable,
            interface,
        })
    }

    /// Each point with its place, as `[remote_io.field]` of a cluster file writes it: inputs, then outputs.
    pub fn places(&self) -> impl Iterator<Item = (&Point, Place)> {
        let Interface { inputs, outputs } = &self.interface;
        let inputs = addressed(inputs).map(|(at, point)| (point, RegisterTable::Holding, at));
        let outputs = addressed(outputs).map(|(at, point)| (point, RegisterTable::Input, at));
        let points = inputs.chain(outputs);
        points.map(|(point, table, at)| (point, place(point.of, table, at as u16)))
    }

    /// u of the last scan.
    pub fn inputs(&self) -> &[u64] {
        &self.inputs
    }

    /// y of the last scan.
    pub fn outputs(&self) -> &[u64] {
        &self.outputs
    }

    /// x after it.
    pub fn state(&self) -> &[u64] {
        &self.state
    }

    /// One scan; whether an output changed.
    fn scan(&mut self) -> bool {
        for (at, point) in addressed(&self.interface.inputs) {
            let words = &self.holding[at..at + registers_of(point.of)];
            let stored = words.iter().fold(0, |stored, word| stored << 16 | u64::from(*word));
            point.set(&mut self.inputs, stored);
        }
        let before = self.outputs.clone();
        self.executable.step(&mut self.scratch, &mut self.state, &self.inputs, &mut self.outputs);
        for (at, point) in addressed(&self.interface.outputs) {
            let stored = point.of.signed(point.get(&self.outputs)) as u64;
            let words = &mut self.input[at..at + registers_of(point.of)];
            for (place, word) in words.iter_mut().rev().enumerate() {
                *word = (stored >> (16 * place)) as u16;
            }
        }
        before != self.outputs
    }

    /// The answer to a request that reads.
    fn read(&self, request: &Request<'_>) -> Result<Response, ExceptionCode> {
        let (table, address, count) = match *request {
            Request::ReadHoldingRegisters(address, count) => (&self.holding, address, count),
            Request::ReadInputRegisters(address, count) => (&self.input, address, count),
            _ => return Err(ExceptionCode::IllegalFunction),
        };
        let words = part(table, address, count, MOST_REGISTERS)?;
        Ok(match request {
            Request::ReadHoldingRegisters(..) => Response::ReadHoldingRegisters(words),
            _ => Response::ReadInputRegisters(words),
        })
    }

    /// Takes the words of a request that writes; the answer, and nothing for a request that reads.
    fn write(&mut self, request: &Request<'_>) -> Option<Result<Response, ExceptionCode>> {
        let (address, words, response) = match request {
            Request::WriteSingleRegister(address, word) => {
                let response = Response::WriteSingleRegister(*address, *word);
                (*address, std::slice::from_ref(word), response)
            }
            Request::WriteMultipleRegisters(address, words) => {
                let count = u16::try_from(words.len()).unwrap_or(u16::MAX);
                let response = Response::WriteMultipleRegisters(*address, count);
                (*address, &words[..], response)
            }
            _ => return None,
        };
        let start = usize::from(address);
        let target = self.holding.get_mut(start..start + words.len());
        Some(match target {
            Some(target) if !words.is_empty() => {
                target.copy_from_slice(words);
                Ok(response)
            }
            Some(_) => Err(ExceptionCode::IllegalDataValue),
            None => Err(ExceptionCode::IllegalDataAddress),
        })
    }
}

impl fmt::Debug for Equipment {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Equipment")
            .field("holding", &self.holding)
            .field("input", &self.input)
            .finish_non_exhaustive()
    }
}

/// Number of registers of a point.
fn registers_of(of: Elementary) -> usize {
    of.bits().div_ceil(16) as usize
}

/// The declared points with their first registers.
fn addressed(points: &Points) -> impl Iterator<Item = (usize, &Point)> {
    declared(points).scan(0, |next, point| {
        let at = *next;
        *next += registers_of(point.of);
        Some((at, point))
    })
}

fn place(of: Elementary, table: RegisterTable, address: u16) -> Place {
    if of == Elementary::Bool {
        return Place::Bit(match table {
            RegisterTable::Input => BitPlace::Input(address, 0),
            RegisterTable::Holding => BitPlace::Holding(address, 0),
        });
    }
    let bits = of.bits().max(16);
    let like = |it: &Elementary| {
        (it.bits(), it.is_real(), it.is_signed()) == (bits, of.is_real(), of.is_signed())
    };
    let of = Registers::TYPES.into_iter().find(like);
    Place::Number(Registers {
        table,
        address,
        // There is one of each width with and without a sign, and all numbers with a point are among them.
        of: of.unwrap_or(Elementary::Ulint),
        order: ByteOrder::Abcd,
        scale: 1.0,
        offset: 0.0,
    })
}

/// Takes the equipment after a scan in which an output changed.
pub type Changed = Box<dyn FnMut(&Equipment) + Send>;

struct Served {
    equipment: Equipment,
    changed: Changed,
    /// A scan follows each request that writes.
    scans_after_writes: bool,
}

impl Served {
    fn scan(&mut self) {
        if self.equipment.scan() {
            (self.changed)(&self.equipment);
        }
    }

    fn answer(&mut self, request: &Request<'_>) -> Result<Response, ExceptionCode> {
        let Some(written) = self.equipment.write(request) else {
            return self.equipment.read(request);
        };
        if written.is_ok() && self.scans_after_writes {
            self.scan();
        }
        written
    }
}

/// Serves `equipment` until SIGINT or SIGTERM; `ready` gets the address. It scans once before, then in each `period`, or else after each request
/// that writes: then its outputs are a function of the requests alone.
///
/// # Errors
/// It cannot listen there.
pub fn serve_equipment(
    equipment: Equipment,
    period: Option<Duration>,
    address: SocketAddr,
    ready: impl FnOnce(SocketAddr),
    changed: Changed,
) -> Result<(), GatewayError> {
    let mut served = Served { equipment, changed, scans_after_writes: period.is_none() };
    served.scan();
    let client = Client(Arc::new(Mutex::new(served)));
    let equipment = Arc::clone(&client.0);
    serve_until_asked(address, ready, async move |listener| {
        tokio::select! {
            ended = serve(listener, |_| client.clone()) => ended,
            never = scan_in(period, &equipment) => match never {},
        }
    })
}

async fn scan_in(period: Option<Duration>, equipment: &Mutex<Served>) -> std::convert::Infallible {
    let Some(period) = period else {
        return pending().await;
    };
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        ticks.tick().await;
        locked(equipment).scan();
    }
}

fn locked(served: &Mutex<Served>) -> std::sync::MutexGuard<'_, Served> {
    served.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Clone)]
struct Client(Arc<Mutex<Served>>);

impl Service for Client {
    type Request = Request<'static>;
    type Response = Response;
    type Exception = ExceptionCode;
    type Future = Answering;

    fn call(&self, request: Self::Request) -> Self::Future {
        let answer = locked(&self.0).answer(&request);
        Box::pin(async move { answer })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use understudy_structured_text::{Options, lower, parse};

    use super::*;

    const ECHO: &str = "
        PROGRAM echo
          VAR_INPUT step : UDINT; open : BOOL; level : REAL; offset : SINT; mask : WORD; rest : TIME; mass : LREAL; END_VAR
          VAR_OUTPUT scans : UINT; o : BOOL; l : REAL; s : SINT; m : WORD; t : TIME; d : LREAL; END_VAR
          scans := scans + 1;
          o := open; l := level; s := offset; m := mask; t := rest; d := mass;
        END_PROGRAM";

    fn equipment() -> Equipment {
        let (file, _) = parse(ECHO);
        let options = Options { text: ECHO, ..Options::default() };
        let program = lower(&file, &options).program.expect("a program");
        Equipment::new((&program).into(), (&program).into()).expect("few registers")
    }

    fn served(equipment: Equipment, changed: Changed) -> Served {
        Served { equipment, changed, scans_after_writes: true }
    }

    #[test]
    fn points_have_consecutive_registers_of_their_types() {
        let equipment = equipment();
        let places = equipment.places().map(|(point, place)| format!("{} {place}", point.name));
        let places: Vec<String> = places.collect();
        let expected = "step holding:0 udint, open holding:2.0, level holding:3 real, offset holding:5 int, mask holding:6 uint, \
            rest holding:7 lint, mass holding:11 lreal, scans input:0 uint, o input:1.0, l input:2 real, s input:4 int, m input:5 uint, \
            t input:6 lint, d input:10 lreal";
        assert_eq!(places.join(", "), expected);
    }

    #[test]
    fn each_write_is_followed_by_one_scan_and_reads_by_none() {
        let (sender, changes) = mpsc::channel();
        let changed: Changed = Box::new(move |equipment| {
            sender.send(equipment.outputs().to_vec()).expect("the test listens");
        });
        let mut served = served(equipment(), changed);
        let words = [
            0x0001_u16, 0x0002, 1, 0x4148, 0, 0xFFFD, 0xBEEF, 0, 0, 0x0007, 0xA120, 0x3FF0, 0, 0, 1,
        ];
        let write = Request::WriteMultipleRegisters(0, words.as_slice().into());
        let written = Ok(Response::WriteMultipleRegisters(0, 15));
        assert_eq!(served.answer(&write), written);
        let echoed = [&[1_u16][..], &words[2..]].concat();
        for _ in 0..2 {
            let read = served.answer(&Request::ReadInputRegisters(0, 14));
            assert_eq!(read, Ok(Response::ReadInputRegisters(echoed.clone())));
        }
        let single = served.answer(&Request::WriteSingleRegister(6, 7));
        assert_eq!(single, Ok(Response::WriteSingleRegister(6, 7)));
        let read = served.answer(&Request::ReadHoldingRegisters(5, 2));
        assert_eq!(read, Ok(Response::ReadHoldingRegisters(vec![0xFFFD, 7])));
        assert_eq!(changes.try_iter().count(), 2);
    }

    #[test]
    fn requests_beyond_the_registers_change_nothing() {
        let (sender, changes) = mpsc::channel();
        let changed: Changed = Box::new(move |_| sender.send(()).expect("the test listens"));
        let mut served = served(equipment(), changed);
        let address = Err(ExceptionCode::IllegalDataAddress);
        for (request, expected) in [
            (Request::WriteMultipleRegisters(14, vec![1, 2].into()), address.clone()),
            (Request::WriteSingleRegister(u16::MAX, 1), address.clone()),
            (
                Request::WriteMultipleRegisters(0, vec![].into()),
                Err(ExceptionCode::IllegalDataValue),
            ),
            (Request::ReadInputRegisters(13, 2), address),
            (Request::ReadInputRegisters(0, 0), Err(ExceptionCode::IllegalDataValue)),
            (Request::ReadCoils(0, 1), Err(ExceptionCode::IllegalFunction)),
            (Request::WriteSingleCoil(0, true), Err(ExceptionCode::IllegalFunction)),
        ] {
            assert_eq!(served.answer(&request), expected, "{request:?}");
        }
        assert_eq!(changes.try_iter().count(), 0);
        assert_eq!(served.equipment.holding, [0; 15]);
    }
}

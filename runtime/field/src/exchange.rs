//! One exchange with the device: all outputs go out, all inputs come in.

use std::io;
use std::time::Instant;

use tokio::net::TcpStream;
use tokio::time::sleep;
use tokio_modbus::client::{Client as _, Context, Reader, Writer, rtu, tcp};
use tokio_modbus::{Error, ExceptionCode, Slave};
use understudy_cluster::Connection;
use understudy_wire::Image;

use crate::plan::{Plan, Run, Table, Unread};
use crate::serial;
use crate::stream::DeviceStream;

/// What went wrong with a device.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Trouble {
    /// The connection is of no use any more.
    #[error("{0}")]
    Connection(#[from] Error),
    /// The device is there, and refuses.
    #[error("it refuses {what}: {code}")]
    Exception { what: String, code: ExceptionCode },
    /// It answered with less than it was asked for.
    #[error("it answered {what} too shortly")]
    Short { what: String },
    /// Its answers are no values of the signals.
    #[error("{0}")]
    Unread(#[from] Unread),
}

impl Trouble {
    /// Whether the connection can be used for the next exchange.
    pub(crate) fn spares_the_connection(&self) -> bool {
        !matches!(self, Self::Connection(_))
    }
}

/// A connection to the device.
///
/// A device may end its connection after each answer, after some answers, or when it was idle. Its connection is then opened again at once, and
/// the request is repeated; only a request that fails on a new connection is a failure. A request to write carries whole values, so a
/// repetition has no other effect.
pub(crate) struct Link<'a> {
    connection: &'a Connection,
    unit: Slave,
    device: Context,
    /// Whether a request was answered over this connection.
    has_answered: bool,
    /// After this time nothing is requested: outputs would be old.
    until: Option<Instant>,
}

/// An answer of the device, or its exception.
type Answered<T> = Result<T, ExceptionCode>;

async fn open(connection: &Connection, unit: Slave) -> io::Result<Context> {
    match connection {
        Connection::Tcp(address) => {
            let stream = TcpStream::connect(address).await?;
            // An exchange is many small requests, each of which is waited for.
            stream.set_nodelay(true)?;
            Ok(tcp::attach_slave(DeviceStream(stream), unit))
        }
        Connection::Rtu(line) => Ok(rtu::attach_slave(serial::open(line)?, unit)),
    }
}

impl<'a> Link<'a> {
    pub(crate) async fn connect(connection: &'a Connection, unit: u8) -> io::Result<Self> {
        let unit = Slave(unit);
        let device = open(connection, unit).await?;
        Ok(Self { connection, unit, device, has_answered: false, until: None })
    }

    /// Requests nothing after this time. A suspended process does not see that its time is over before it goes on.
    pub(crate) fn ends_at(&mut self, time: Instant) {
        self.until = Some(time);
    }

    fn in_time(&self) -> Result<(), Error> {
        match self.until {
            Some(until) if Instant::now() > until => {
                let reason = "the exchange has taken longer than its `timeout`";
                Err(io::Error::new(io::ErrorKind::TimedOut, reason).into())
            }
            _ => Ok(()),
        }
    }

    /// The answer to a request.
    async fn ask<T>(
        &mut self,
        request: impl AsyncFn(&mut Context) -> Result<Answered<T>, Error>,
    ) -> Result<Answered<T>, Error> {
        self.await_silence().await;
        self.in_time()?;
        let answer = request(&mut self.device).await;
        let answer = match answer {
            Err(Error::Transport(_)) if self.has_answered => {
                // A device may accept one connection at a time: the old one ends first.
                let _ = self.device.disconnect().await;
                self.has_answered = false;
                self.device = open(self.connection, self.unit).await?;
                self.await_silence().await;
                self.in_time()?;
                request(&mut self.device).await
            }
            answer => answer,
        };
        self.has_answered |= answer.is_ok();
        answer
    }

    /// Frames on a serial line are told apart by the silence between them.
    async fn await_silence(&self) {
        if let Connection::Rtu(line) = self.connection {
            sleep(serial::silence(line)).await;
        }
    }
}

/// u(i), once `outputs` are driven.
pub(crate) async fn exchange(
    device: &mut Link<'_>,
    outputs: Option<(&Plan, &Image)>,
    inputs: &Plan,
) -> Result<Image, Trouble> {
    if let Some((plan, outputs)) = outputs {
        for (run, words) in plan.runs.iter().zip(plan.words(outputs)) {
            write(device, *run, &words).await?;
        }
    }
    let mut answers = Vec::with_capacity(inputs.runs.len());
    for run in &inputs.runs {
        answers.push(read(device, *run).await?);
    }
    Ok(inputs.image(&answers)?)
}

/// Writes outputs that are gone for the last time; one that the device does not take is gone from there too.
pub(crate) async fn leave(device: &mut Link<'_>, left: &[(Run, Vec<u16>)]) -> Result<(), Trouble> {
    for (run, words) in left {
        match write(device, *run, words).await {
            Ok(()) | Err(Trouble::Exception { .. }) => {}
            Err(trouble) => return Err(trouble),
        }
    }
    Ok(())
}

/// The words of y(i), as the device holds them; nothing where it does not let its outputs be read.
pub(crate) async fn read_back(
    device: &mut Link<'_>,
    outputs: &Plan,
) -> Result<Option<Vec<Vec<u16>>>, Trouble> {
    let mut answers = Vec::with_capacity(outputs.runs.len());
    for run in &outputs.runs {
        match read(device, *run).await {
            Ok(words) => answers.push(words),
            Err(Trouble::Connection(error)) => return Err(error.into()),
            Err(_) => return Ok(None),
        }
    }
    Ok(Some(outputs.named(answers)))
}

async fn read(device: &mut Link<'_>, run: Run) -> Result<Vec<u16>, Trouble> {
    let Run { table, start, count } = run;
    let request = async |device: &mut Context| read_table(device, table, start, count).await;
    let answer = device.ask(request).await?;
    let what = || format!("to read {run}");
    let words = answer.map_err(|code| Trouble::Exception { what: what(), code })?;
    if words.len() < usize::from(count) {
        return Err(Trouble::Short { what: what() });
    }
    Ok(words)
}

async fn read_table(
    device: &mut Context,
    table: Table,
    start: u16,
    count: u16,
) -> Result<Answered<Vec<u16>>, Error> {
    let bits = |bits: Vec<bool>| bits.into_iter().map(u16::from).collect();
    Ok(match table {
        Table::Discrete => device.read_discrete_inputs(start, count).await?.map(bits),
        Table::Coil => device.read_coils(start, count).await?.map(bits),
        Table::Input => device.read_input_registers(start, count).await?,
        Table::Holding => device.read_holding_registers(start, count).await?,
    })
}

async fn write(device: &mut Link<'_>, run: Run, words: &[u16]) -> Result<(), Trouble> {
    let Run { table, start, .. } = run;
    let coils: Vec<bool> = words.iter().map(|word| *word != 0).collect();
    let request =
        async |device: &mut Context| write_table(device, table, start, words, &coils).await;
    let answer = device.ask(request).await?;
    answer.map_err(|code| Trouble::Exception { what: format!("to write {run}"), code })
}

async fn write_table(
    device: &mut Context,
    table: Table,
    start: u16,
    words: &[u16],
    coils: &[bool],
) -> Result<Answered<()>, Error> {
    match (table, words, coils) {
        (Table::Holding, [word], _) => device.write_single_register(start, *word).await,
        (Table::Holding, words, _) => device.write_multiple_registers(start, words).await,
        (_, _, [coil]) => device.write_single_coil(start, *coil).await,
        (_, _, coils) => device.write_multiple_coils(start, coils).await,
    }
}

impl std::fmt::Display for Run {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let table = match self.table {
            Table::Discrete => "discrete inputs",
            Table::Coil => "coils",
            Table::Input => "input registers",
            Table::Holding => "holding registers",
        };
        let last = u32::from(self.start) + u32::from(self.count) - 1;
        write!(formatter, "{table} {} to {last}", self.start)
    }
}

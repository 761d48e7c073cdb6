//! One exchange with the device: all outputs go out, all inputs come in.

use std::io;
use std::time::Duration;

use tokio::net::TcpStream;
use tokio::time::sleep;
use tokio_modbus::client::{Context, Reader, Writer, rtu, tcp};
use tokio_modbus::{Error, ExceptionCode, Slave};
use understudy_cluster::Connection;
use understudy_wire::Image;

use crate::plan::{Plan, Run, Table, Unread};
use crate::serial;

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

/// An open connection to the device.
pub(crate) struct Link {
    device: Context,
    /// Before each request; only serial lines need it.
    silence: Option<Duration>,
}

pub(crate) async fn connect(connection: &Connection, unit: u8) -> io::Result<Link> {
    match connection {
        Connection::Tcp(address) => {
            let stream = TcpStream::connect(address).await?;
            // An exchange is many small requests, each of which is waited for.
            stream.set_nodelay(true)?;
            Ok(Link { device: tcp::attach_slave(stream, Slave(unit)), silence: None })
        }
        Connection::Rtu(line) => Ok(Link {
            device: rtu::attach_slave(serial::open(line)?, Slave(unit)),
            silence: Some(serial::silence(line)),
        }),
    }
}

impl Link {
    /// The device, when it may be asked: frames on a serial line are told apart by the silence between them.
    async fn ready(&mut self) -> &mut Context {
        if let Some(silence) = self.silence {
            sleep(silence).await;
        }
        &mut self.device
    }
}

/// u(i), once `outputs` are driven.
pub(crate) async fn exchange(
    device: &mut Link,
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

/// The words of y(i), as the device holds them; nothing where it does not let its outputs be read.
pub(crate) async fn read_back(
    device: &mut Link,
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

async fn read(device: &mut Link, run: Run) -> Result<Vec<u16>, Trouble> {
    let Run { table, start, count } = run;
    let device = device.ready().await;
    let bits = |bits: Vec<bool>| bits.into_iter().map(u16::from).collect();
    let answer: Result<Vec<u16>, ExceptionCode> = match table {
        Table::Discrete => device.read_discrete_inputs(start, count).await?.map(bits),
        Table::Coil => device.read_coils(start, count).await?.map(bits),
        Table::Input => device.read_input_registers(start, count).await?,
        Table::Holding => device.read_holding_registers(start, count).await?,
    };
    let what = || format!("to read {run}");
    let words = answer.map_err(|code| Trouble::Exception { what: what(), code })?;
    if words.len() < usize::from(count) {
        return Err(Trouble::Short { what: what() });
    }
    Ok(words)
}

async fn write(device: &mut Link, run: Run, words: &[u16]) -> Result<(), Trouble> {
    let Run { table, start, .. } = run;
    let device = device.ready().await;
    let answer = match (table, words) {
        (Table::Holding, [word]) => device.write_single_register(start, *word).await?,
        (Table::Holding, words) => device.write_multiple_registers(start, words).await?,
        (_, [word]) => device.write_single_coil(start, *word != 0).await?,
        (_, words) => {
            let coils: Vec<bool> = words.iter().map(|word| *word != 0).collect();
            device.write_multiple_coils(start, &coils).await?
        }
    };
    answer.map_err(|code| Trouble::Exception { what: format!("to write {run}"), code })
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

//! One exchange with the device: all outputs go out, all inputs come in.

use std::io;
use std::net::SocketAddr;

use tokio::net::TcpStream;
use tokio_modbus::client::{Context, Reader, Writer, tcp};
use tokio_modbus::{Error, ExceptionCode, Slave};
use understudy_wire::Image;

use crate::plan::{Plan, Run, Table};

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
}

impl Trouble {
    /// Whether the connection can be used for the next exchange.
    pub(crate) fn spares_the_connection(&self) -> bool {
        !matches!(self, Self::Connection(_))
    }
}

pub(crate) async fn connect(address: SocketAddr, unit: u8) -> io::Result<Context> {
    let stream = TcpStream::connect(address).await?;
    // An exchange is many small requests, each of which is waited for.
    stream.set_nodelay(true)?;
    Ok(tcp::attach_slave(stream, Slave(unit)))
}

/// u(i), once `outputs` are driven.
pub(crate) async fn exchange(
    device: &mut Context,
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
    inputs.image(&answers).ok_or(Trouble::Short {
        what: "a reading".into(),
    })
}

/// y(i), as the device holds it; nothing where it does not let its outputs be read.
pub(crate) async fn read_back(
    device: &mut Context,
    outputs: &Plan,
) -> Result<Option<Image>, Trouble> {
    let mut answers = Vec::with_capacity(outputs.runs.len());
    for run in &outputs.runs {
        match read(device, *run).await {
            Ok(words) => answers.push(words),
            Err(Trouble::Connection(error)) => return Err(error.into()),
            Err(Trouble::Exception { .. } | Trouble::Short { .. }) => return Ok(None),
        }
    }
    Ok(outputs.image(&answers))
}

async fn read(device: &mut Context, run: Run) -> Result<Vec<u16>, Trouble> {
    let Run {
        table,
        start,
        count,
    } = run;
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

async fn write(device: &mut Context, run: Run, words: &[u16]) -> Result<(), Trouble> {
    let Run { table, start, .. } = run;
    let answer = match (table, words) {
        (Table::Holding, [word]) => device.write_single_register(start, *word).await?,
        (Table::Holding, words) => device.write_multiple_registers(start, words).await?,
        (_, [word]) => device.write_single_coil(start, *word != 0).await?,
        (_, words) => {
            let coils: Vec<bool> = words.iter().map(|word| *word != 0).collect();
            device.write_multiple_coils(start, &coils).await?
        }
    };
    answer.map_err(|code| Trouble::Exception {
        what: format!("to write {run}"),
        code,
    })
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

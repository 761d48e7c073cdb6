//! `understudy device`: a plant program as a Modbus TCP device.

use std::fmt::Write as _;
use std::io::Write as _;
use std::net::SocketAddr;

use clap::Args;
use serde_json::json;
use understudy_gateway::{Changed, Equipment, GatewayError, serve_equipment};
use understudy_typed::Fault;

use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::overrides::parse_address;
use crate::programs::scan::{Subject, SubjectArguments, subject, written};

/// Run a plant program as a Modbus TCP device
#[derive(Debug, Args)]
#[command(after_help = "\
Example:
  understudy device examples/tennessee-eastman/process.st --program equipment --listen 127.0.0.1:5022
  understudy device examples/modbus-level/tank.st --period 20ms
  understudy device examples/modbus-level/tank.st --registers

The inputs of the program are holding registers, which remote I/Os drive, and its outputs are input registers, both from 0 in order of
declaration. Without --period there is a scan after each request that writes, so that the outputs are a function of the requests alone. A
line `inputs -> outputs` is printed for each scan in which an output changes, in the notation of `understudy scan`. The device ends with
SIGINT or SIGTERM. It is for tests: connections are neither encrypted nor authenticated.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    subject: SubjectArguments,
    /// Listening address; port 0 selects a free port
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:1502", value_parser = parse_address)]
    listen: SocketAddr,
    /// Print the place of each point, as a cluster file writes it, and exit
    #[arg(long)]
    registers: bool,
}

pub(crate) fn run(arguments: &Arguments, console: &mut Console) -> Result<Answer, Answer> {
    let (subject, reports) = subject(&arguments.subject)?;
    let Subject { executable, interface, program, .. } = subject;
    let equipment = Equipment::new(executable, interface.clone()).map_err(failed)?;
    if arguments.registers {
        return Ok(registers(&equipment).with_used(reports));
    }
    let prints = !console.is_json();
    let changed: Changed = Box::new(move |equipment| {
        if !prints {
            return;
        }
        let inputs = written(&interface.inputs, equipment.inputs());
        let outputs = written(&interface.outputs, equipment.outputs());
        // The reader may have closed the pipe.
        let _ = writeln!(std::io::stdout(), "{inputs} -> {outputs}");
        if let Some(fault) = Fault::read(equipment.state()) {
            let fault = fault.describe(&program);
            let _ = writeln!(std::io::stderr(), "the program has stopped: {fault}");
        }
    });
    let ready = |address| console.note(&format!("listening on {address}"));
    let period = arguments.subject.period;
    serve_equipment(equipment, period, arguments.listen, ready, changed).map_err(failed)?;
    Ok(Answer::done("", json!(null)).with_used(reports))
}

fn registers(equipment: &Equipment) -> Answer {
    let mut text = String::new();
    let mut places = Vec::new();
    for (point, place) in equipment.places() {
        let (name, place) = (&point.name, place.to_string());
        let _ = writeln!(text, "{name} = \"{place}\"");
        places.push(json!({ "name": name, "type": point.of.name(), "place": place }));
    }
    Answer::done(text, json!({ "registers": places }))
}

fn failed(error: GatewayError) -> Answer {
    Answer::failed(Status::Failed, error.code(), error)
}

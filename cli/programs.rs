//! Commands that write, check, prove and convert the programs of a cluster.

mod check;
pub(crate) mod convert;
mod draw;
mod init;
mod parity;
pub(crate) mod scan;
pub(crate) mod verify;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "programs",
        title: "Write and verify programs and clusters",
        entries: vec![
            command("init", |it, _| init::run(&it)),
            command("check", |it, _| check::run(&it)),
            command("verify", |it, console| verify::run(&it, console)),
            command("parity", |it, _| parity::run(&it)),
            command("convert", |it, _| convert::run(&it)),
            command("draw", |it, _| draw::run(&it)),
            command("scan", |it, _| scan::run(&it)),
        ],
    }
}

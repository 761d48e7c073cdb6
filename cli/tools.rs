//! Commands about this program itself, and tools for its surroundings.

mod explain;
pub(crate) mod proxy;
mod schema;
mod shell;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "tools",
        title: "Tools",
        entries: vec![
            command("explain", |it, _| explain::run(&it)),
            command("schema", |it, _| schema::run(&it)),
            command("proxy", |it, console| proxy::run(&it, console)),
            command("completions", |it, _| shell::completions(&it)),
            command("man", |it, _| shell::man(&it)),
        ],
    }
}

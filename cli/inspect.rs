//! Commands that show a run, live or finished.

mod animate;
pub(crate) mod attach;
mod diff;
mod journal;
pub(crate) mod plant;
mod retained;
pub(crate) mod top;
mod view;
pub(crate) mod watch;
mod why;

use crate::commands::{Group, command};

pub(crate) fn group() -> Group {
    Group {
        name: "inspect",
        title: "Inspect runs",
        entries: vec![
            command("watch", |it, console| watch::run(&it, console)),
            command("top", |it, console| top::run(&it, console)),
            command("why", |it, _| why::run(&it)),
            command("journal", |it, console| journal::run(&it, console.is_json())),
            command("diff", |it, _| diff::run(&it)),
            command("animate", |it, _| animate::run(&it)),
            command("retained", |it, _| retained::run(&it)),
        ],
    }
}

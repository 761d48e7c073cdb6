//! Commands that select controllers, issue keys, check machines and operate members.

mod allocate;
mod catalogue;
mod change;
mod doctor;
mod gateway;
pub(crate) mod keys;
pub(crate) mod operate;
mod resources;
mod spare;

use crate::commands::{Entry, Group, command};
use crate::member;

/// What a machine that runs members needs.
pub(crate) fn members() -> Group {
    Group { name: "members", title: "Run members", entries: of_members().into() }
}

fn of_members() -> [Entry; 4] {
    [
        command("doctor", |it, console| doctor::run(&it, console)),
        command("node", |it, _| member::run_station(&it)),
        command("remote-io", |it: member::RemoteIoArguments, _| member::run_remote_io(&it.common)),
        command("plant", |it: member::PlantArguments, _| member::run_plant(&it.common)),
    ]
}

pub(crate) fn group() -> Group {
    let mut entries = vec![
        command("resources", |it, _| resources::run(&it)),
        command("allocate", |it, console| allocate::run(&it, console)),
        command("catalogue", |it, _| catalogue::run(&it)),
        command("keys", |it, _| keys::run(&it)),
    ];
    entries.extend(of_members());
    entries.push(command("spare", |it, console| spare::run(&it, console)));
    entries.push(command("operate", |it, _| operate::run(&it)));
    entries.push(command("change", |it, _| change::run(&it)));
    entries.push(command("gateway", |it, console| gateway::run(&it, console)));

    Group { name: "deployment", title: "Deploy and operate clusters", entries }
}

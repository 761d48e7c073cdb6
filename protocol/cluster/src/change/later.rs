//! What two cluster files say that no online change touches: settings that count with the next start of a member or a view, and links that need a stop.
//!
//! Each field of a cluster is named here or is a part of the text that its hash is of ([`crate::configuration`]), so that no key of the file changes
//! without a word: one that is added to these types is to be placed here first.

use std::time::Duration;

use understudy_text::duration;
use understudy_wire::ProgramId;

use super::points::are_other_points;
use super::settings::{ChangedSetting, Section, changed_sections};
use crate::address::Addresses;
use crate::alarm::{AlarmCondition, AlarmDeclaration};
use crate::card::Card;
use crate::cluster::{Cluster, Controller, PlantPlace, RemoteIo, Twin, Understudy};
use crate::device::{Connection, FieldDevice, SerialLine};
use crate::notify::Notify;
use crate::source::{InputSource, InputSourceKind, OperatorDeclaration};

/// The settings that differ and count where a member or a view is started with the new file, and no sooner.
pub fn later_settings(before: &Cluster, after: &Cluster) -> Vec<ChangedSetting> {
    let mut changed = changed_sections(&rest_of(before), &rest_of(after));
    // Texts of inputs come with the inputs, where these change.
    let with_points = (0..).map(ProgramId).zip(&before.remote_ios).filter(|(program, _)| {
        let hash = |cluster: &Cluster| cluster.controllers.get(program.index()).map(|it| it.hash);
        hash(before) != hash(after) && are_other_points(before, after, *program)
    });
    let with_points: Vec<String> =
        with_points.map(|(_, remote_io)| format!("remote I/O `{}`", remote_io.name)).collect();
    changed.retain(|setting| {
        let ChangedSetting::Key { of, key, .. } = setting else {
            return true;
        };
        !key.starts_with("`inputs.") || !with_points.contains(of)
    });
    let both = before.controllers.iter().zip(&after.controllers);
    let rewritten = both.filter(|(old, new)| {
        let texts = [old, new].map(|it| &it.code.source().text);
        old.name == new.name && old.hash == new.hash && texts[0] != texts[1]
    });
    changed.extend(rewritten.map(|(_, new)| ChangedSetting::Key {
        of: format!("controller `{}`", new.name),
        key: "the text of the program, and nothing that it does,".to_owned(),
        values: None,
    }));
    changed
}

/// The settings of links that differ. Members with other ones do not receive each other, so all are started with them together.
pub(super) fn changed_links(before: &Cluster, after: &Cluster) -> Vec<ChangedSetting> {
    changed_sections(&[links_of(before)], &[links_of(after)])
}

fn links_of(cluster: &Cluster) -> Section {
    let multicast = cluster.multicast.map(|group| group.to_string());
    let networks = if cluster.has_two_networks { 2 } else { 1 };
    let mut section = Section::of("");
    section.set("link", format!("{:?}", cluster.link).to_lowercase());
    section.set("multicast", some(multicast));
    section.set("networks", networks);
    section.set("security", format!("{:?}", cluster.security).to_lowercase());
    section
}

/// What counts with the next start, section by section.
fn rest_of(cluster: &Cluster) -> Vec<Section> {
    let Cluster {
        name: _,
        retain_every,
        spins,
        controllers,
        understudies,
        remote_ios,
        plants,
        alarms,
        notify,
        cards,
        // Links, and what the hash of the configuration is of.
        link: _,
        multicast: _,
        has_two_networks: _,
        security: _,
        agreement: _,
        canonical_text: _,
        frame_text: _,
        programs: _,
        parity: _,
    } = cluster;
    let mut own = Section::of("");
    own.set("retain_every", duration::text(*retain_every));
    own.set("spin", spins);
    let mut sections = vec![own];
    sections.extend(controllers.iter().map(of_controller));
    sections.extend(understudies.iter().map(of_understudy));
    sections.extend(remote_ios.iter().flat_map(of_remote_io));
    sections.extend(plants.iter().flatten().map(of_plant));
    let period = cluster.agreement.schedule.period();
    sections.extend(alarms.iter().map(|alarm| of_alarm(alarm, cluster, period)));
    sections.extend(notify.iter().map(of_notify));
    let of_programs = controllers.iter().zip(cards.iter());
    sections.extend(of_programs.flat_map(|(controller, cards)| {
        cards.iter().map(|(signal, card)| of_card(controller, signal, card))
    }));
    sections
}

fn some(text: Option<String>) -> String {
    text.unwrap_or_else(|| "none".to_owned())
}

fn set_addresses(section: &mut Section, addresses: &Addresses) {
    let Addresses { first, second, link } = addresses;
    for (key, address) in [("address", first), ("second_address", second), ("link_address", link)] {
        section.set(key, some(address.map(|address| address.to_string())));
    }
}

fn of_controller(controller: &Controller) -> Section {
    // The program and its points are parts of the configuration.
    let Controller { name, file, code: _, interface: _, hash: _, addresses } = controller;
    let mut section = Section::of(&format!("controller `{name}`"));
    section.set("ladder", file);
    set_addresses(&mut section, addresses);
    section
}

fn of_understudy(understudy: &Understudy) -> Section {
    let Understudy { name, addresses, spare: _ } = understudy;
    let mut section = Section::of(&format!("understudy `{name}`"));
    set_addresses(&mut section, addresses);
    section
}

fn of_remote_io(remote_io: &RemoteIo) -> Vec<Section> {
    let RemoteIo { name, fallback: _, section: _, inputs, field, diagnosis, twin, addresses } =
        remote_io;
    let mut own = Section::of(&format!("remote I/O `{name}`"));
    set_addresses(&mut own, addresses);
    field.iter().for_each(|field| set_device(&mut own, field));
    own.set("diagnosis", some(diagnosis.as_ref().map(|it| it.ladder.clone())));
    let operated = inputs.iter().filter_map(of_operator_input);
    for (input, texts) in operated {
        for (key, text) in texts {
            own.set(&format!("inputs.{input}.{key}"), text);
        }
    }
    let mut sections = vec![own];
    sections.extend(twin.iter().map(|twin| {
        // Its wiring is a part of the configuration.
        let Twin {
            name,
            take_over_after: _,
            wiring: _,
            paired_inputs: _,
            shared_outputs: _,
            field,
            direct_link,
            addresses,
        } = twin;
        let mut section = Section::of(&format!("remote I/O `{name}`"));
        field.iter().for_each(|field| set_device(&mut section, field));
        section.set("direct_link", direct_link);
        set_addresses(&mut section, addresses);
        section
    }));
    sections
}

/// The texts of an input that operators write; the input itself is a part of the configuration.
fn of_operator_input(source: &InputSource) -> Option<(&str, [(&'static str, String); 3])> {
    let InputSourceKind::Operator(declaration) = &source.kind else {
        return None;
    };
    let OperatorDeclaration { input: _, declared: _, title, unit, confirm, group: _ } = declaration;
    let texts = [
        ("title", some(title.clone())),
        ("unit", some(unit.clone())),
        ("confirm", confirm.to_string()),
    ];
    Some((&source.name, texts))
}

/// How a device is reached; the places in it are those of the points.
fn set_device(section: &mut Section, field: &FieldDevice) {
    let FieldDevice { connection, unit, timeout, stale_after, inputs: _, outputs: _ } = field;
    match connection {
        Connection::Tcp(address) => section.set("modbus", address),
        Connection::Rtu(line) => {
            let SerialLine { path, baud, parity, stop_bits } = line;
            section.set("modbus", format!("rtu:{path}"));
            section.set("baud", baud);
            section.set("parity", format!("{parity:?}").to_lowercase());
            section.set("stop_bits", stop_bits);
        }
    }
    section.set("unit", unit);
    section.set("timeout", duration::text(*timeout));
    section.set("stale_after", duration::text(*stale_after));
}

fn of_plant(plant: &PlantPlace) -> Section {
    // What it does is a part of the configuration.
    let PlantPlace { name, model, plant: _, fed_by: _, follows: _, watchdog_cycles: _, addresses } =
        plant;
    let mut section = Section::of(&format!("plant `{name}`"));
    section.set("model", model);
    set_addresses(&mut section, addresses);
    section
}

fn of_alarm(alarm: &AlarmDeclaration, cluster: &Cluster, period: Duration) -> Section {
    let AlarmDeclaration {
        name,
        program,
        point,
        is_output: _,
        condition,
        on_delay,
        off_delay,
        priority,
        text,
        action,
    } = alarm;
    let value = |stored: u64| point.declared().text(stored);
    let condition = match *condition {
        AlarmCondition::Is(stored) => format!("is {}", value(stored)),
        AlarmCondition::Above { limit, over } => {
            format!("above {}, over at {}", value(limit), value(over))
        }
        AlarmCondition::Below { limit, over } => {
            format!("below {}, over at {}", value(limit), value(over))
        }
    };
    let controller = cluster.controllers.get(program.index()).map_or("", |it| it.name.as_str());
    let mut section = Section::of(&format!("alarm `{name}`"));
    section.set("signal", format!("{controller}.{}", point.name));
    section.set_words("the condition", &condition);
    section.set("on_delay", duration::text(period * *on_delay));
    section.set("off_delay", duration::text(period * *off_delay));
    section.set("priority", priority.word());
    section.set("text", text);
    section.set("action", some(action.clone()));
    section
}

fn of_card(controller: &Controller, signal: &str, card: &Card) -> Section {
    let Card { unit, decimals, range, description, group } = card;
    let interface = &controller.interface;
    let point = interface.inputs.find(signal).or_else(|| interface.outputs.find(signal));
    let limit =
        |stored: Option<u64>| some(stored.zip(point).map(|(it, of)| of.declared().text(it)));
    let (low, high) = range.unzip();
    let mut section = Section::of(&format!("signal `{}.{signal}`", controller.name));
    section.set("unit", some(unit.clone()));
    section.set("decimals", some(decimals.map(|decimals| decimals.to_string())));
    section.set("low", limit(low));
    section.set("high", limit(high));
    section.set("description", some(description.clone()));
    section.set("group", some(group.clone()));
    section
}

fn of_notify(notify: &Notify) -> Section {
    let Notify { program, arguments, timeout } = notify;
    let mut section = Section::of("`[notify]`");
    section.set("command", format!("{program} {}", arguments.join(" ")));
    section.set("timeout", duration::text(*timeout));
    section
}

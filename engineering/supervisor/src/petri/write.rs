use std::fmt::Write as _;

use understudy_text::duration;

use super::net::{Action, Arc, Net, NetTransition};
use super::read::NetFile;
use crate::form::{key, quoted};

/// The text of a net, as [`read_net`](super::read_net) reads it.
pub fn write_net(file: &NetFile) -> String {
    let net = &file.net;
    let mut text = format!("name = {}\n", quoted(net.name()));
    if !file.events.is_empty() {
        text.push_str("\n[events]\n");
    }
    for event in file.events.events() {
        let (name, controllable) = (key(&event.name), event.label.is_controllable());
        let label = event.label;
        let _ = writeln!(text, "{name} = {{ controllable = {controllable}, label = {label} }}");
    }
    for place in net.places() {
        let _ = write!(text, "\n[[place]]\nname = {}\n", quoted(&place.name));
        if place.initial > 0 {
            let _ = writeln!(text, "tokens = {}", place.initial);
        }
        if let Some(capacity) = place.capacity {
            let _ = writeln!(text, "capacity = {capacity}");
        }
        for (key, is_level) in [("level", true), ("impulse", false)] {
            let signals = place.actions.iter().filter_map(|action| match action {
                Action::Level(signal) => is_level.then_some(signal),
                Action::Impulse(signal) => (!is_level).then_some(signal),
            });
            list(&mut text, key, signals.map(ToString::to_string).collect());
        }
    }
    for transition in net.transitions() {
        write_transition(&mut text, file, net, transition);
    }
    if !file.addresses.is_empty() {
        text.push_str("\n[addresses]\n");
    }
    for located in &file.addresses {
        let (signal, address) = (key(&located.signal), located.address.to_string());
        let _ = writeln!(text, "{signal} = {}", quoted(&address));
    }
    text
}

fn write_transition(text: &mut String, file: &NetFile, net: &Net, transition: &NetTransition) {
    let _ = write!(text, "\n[[transition]]\nname = {}\n", quoted(&transition.name));
    if let Some(label) = transition.label {
        let event = file.events.name(label);
        if event != transition.name {
            let _ = writeln!(text, "event = {}", quoted(&event));
        }
    }
    let arcs = |arcs: &[Arc]| -> Vec<String> {
        let arcs = arcs.iter().map(|arc| {
            let place = &net.places()[arc.place].name;
            match arc.weight {
                1 => place.clone(),
                weight => format!("{weight} {place}"),
            }
        });
        arcs.collect()
    };
    list(text, "takes", arcs(&transition.takes));
    list(text, "gives", arcs(&transition.gives));
    list(text, "inhibited_by", arcs(&transition.inhibitors));
    list(text, "enabled_by", arcs(&transition.enablers));
    let condition = transition.condition.to_string();
    if !condition.is_empty() {
        let _ = writeln!(text, "when = {}", quoted(&condition));
    }
    if let Some(delay) = transition.delay {
        let _ = writeln!(text, "after = {}", quoted(&duration::text(delay)));
    }
}

/// A list under `key`; a single text as itself, and nothing for none.
fn list(text: &mut String, key: &str, words: Vec<String>) {
    let _ = match words.as_slice() {
        [] => Ok(()),
        [word] => writeln!(text, "{key} = {}", quoted(word)),
        _ => {
            let words: Vec<String> = words.iter().map(|word| quoted(word)).collect();
            writeln!(text, "{key} = [{}]", words.join(", "))
        }
    };
}

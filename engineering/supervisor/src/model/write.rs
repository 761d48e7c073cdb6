use std::fmt::Write as _;

use super::Model;
use crate::alphabet::Label;
use crate::automaton::Automaton;
use crate::form::{key, quoted};

/// The text of a model, as [`read_model`](super::read_model) reads it.
pub fn write_model(model: &Model) -> String {
    let mut text = format!("name = {}\n\n[events]\n", quoted(&model.name));
    for event in model.alphabet.events() {
        let controllable = event.label.is_controllable();
        let _ = write!(
            text,
            "{} = {{ controllable = {controllable}, label = {}",
            key(&event.name),
            event.label
        );
        if let Some(signal) = model.signals.iter().find(|signal| signal.label == event.label) {
            let _ = write!(text, ", signal = {}", quoted(&signal.signal));
            if let Some(when) = signal.when {
                let _ = write!(text, ", when = {}", quoted(when.word()));
            }
        }
        text.push_str(" }\n");
    }
    if !model.addresses.is_empty() {
        text.push_str("\n[addresses]\n");
        for located in &model.addresses {
            let (signal, address) = (key(&located.signal), located.address.to_string());
            let _ = writeln!(text, "{signal} = {}", quoted(&address));
        }
    }
    let roles = [
        ("plant", &model.plants),
        ("specification", &model.specifications),
        ("supervisor", &model.supervisors),
    ];
    for (role, automata) in roles {
        for automaton in automata {
            let _ = write!(text, "\n[[{role}]]\n");
            write_automaton(&mut text, automaton, &|label| model.alphabet.name(label));
        }
    }
    text
}

fn write_automaton(text: &mut String, automaton: &Automaton, event_name: &dyn Fn(Label) -> String) {
    let list =
        |words: Vec<String>| words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(", ");
    let state = |state| automaton.state_name(state).into_owned();
    let _ = writeln!(text, "name = {}", quoted(automaton.name()));
    let blocked = automaton.blocked_events().into_iter().map(event_name).collect::<Vec<_>>();
    if !blocked.is_empty() {
        let _ = writeln!(text, "# never possible\nevents = [{}]", list(blocked));
    }
    // States are numbered in the order in which a reader meets them; this keeps the numbers.
    let _ = writeln!(text, "states = [{}]", list(automaton.states().map(state).collect()));
    let _ = writeln!(text, "marked = [{}]", list(automaton.marked().map(state).collect()));
    text.push_str("transitions = [\n");
    for transition in automaton.transitions() {
        let line =
            [state(transition.source), event_name(transition.label), state(transition.target)];
        let _ = writeln!(text, "    {},", quoted(&line.join(" ")));
    }
    text.push_str("]\n");
}

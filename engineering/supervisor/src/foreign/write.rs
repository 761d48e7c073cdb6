//! Modules of Supremica and generators of libFAUDES, as their tools write them.

use std::collections::HashMap;
use std::fmt::Write as _;

use understudy_text::markup::escaped;

use super::ACCEPTING;
use super::draft::distinct;
use crate::alphabet::{Alphabet, Label};
use crate::automaton::Automaton;
use crate::model::Model;

/// The text of a model as a module of Supremica. TCT's event N is `eN`, and its state N is `SN`.
pub fn write_module(model: &Model) -> String {
    let roles = [
        ("PLANT", &model.plants),
        ("SPEC", &model.specifications),
        ("SUPERVISOR", &model.supervisors),
    ];
    let automata = roles.iter().flat_map(|(_, automata)| automata.iter());
    let alphabet = model.alphabet.union(automata.map(Automaton::alphabet));
    let names = event_names(&alphabet, "e", is_of_an_identifier);
    let mut text = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n<Module xmlns=\"http://waters.sourceforge.net/xsd/module\" xmlns:B=\"http://waters.sourceforge.net/xsd/base\" Name=\"{}\">\n<EventDeclList>\n<EventDecl Kind=\"PROPOSITION\" Name=\"{ACCEPTING}\"/>\n",
        escaped(&model.name)
    );
    for event in alphabet.events() {
        let kind = if event.label.is_controllable() { "CONTROLLABLE" } else { "UNCONTROLLABLE" };
        let name = escaped(&names[&event.label]);
        let _ = writeln!(text, "<EventDecl Kind=\"{kind}\" Name=\"{name}\"/>");
    }
    text.push_str("</EventDeclList>\n<ComponentList>\n");
    for (kind, automata) in roles {
        let of_components = distinct(automata.iter().map(Automaton::name), |_| true);
        for (automaton, name) in automata.iter().zip(of_components) {
            let name = escaped(&name);
            let _ = writeln!(text, "<SimpleComponent Kind=\"{kind}\" Name=\"{name}\">");
            write_graph(&mut text, automaton, &names);
            text.push_str("</SimpleComponent>\n");
        }
    }
    text.push_str("</ComponentList>\n</Module>\n");
    text
}

fn write_graph(text: &mut String, automaton: &Automaton, names: &HashMap<Label, String>) {
    let identifier = |text: &mut String, name: &str| {
        let _ = writeln!(text, "<SimpleIdentifier Name=\"{}\"/>", escaped(name));
    };
    text.push_str("<Graph>\n");
    let blocked = automaton.blocked_events();
    let is_unmarked = automaton.marked().next().is_none();
    if is_unmarked || !blocked.is_empty() {
        text.push_str("<LabelBlock>\n");
        blocked.iter().for_each(|label| identifier(text, &names[label]));
        if is_unmarked {
            identifier(text, ACCEPTING);
        }
        text.push_str("</LabelBlock>\n");
    }
    let states: Vec<String> = match automaton.state_names() {
        Some(names) => distinct(names.iter().map(String::as_str), is_of_an_identifier),
        None => (0..automaton.state_count()).map(|number| format!("S{number}")).collect(),
    };
    let states: Vec<String> = states.iter().map(|name| escaped(name)).collect();
    text.push_str("<NodeList>\n");
    for state in automaton.states() {
        let name = &states[state.index()];
        let initial = if automaton.initial() == Some(state) { " Initial=\"true\"" } else { "" };
        if automaton.is_marked(state) {
            let _ = writeln!(text, "<SimpleNode{initial} Name=\"{name}\">\n<EventList>");
            identifier(text, ACCEPTING);
            text.push_str("</EventList>\n</SimpleNode>\n");
        } else {
            let _ = writeln!(text, "<SimpleNode{initial} Name=\"{name}\"/>");
        }
    }
    text.push_str("</NodeList>\n<EdgeList>\n");
    for transition in automaton.transitions() {
        let [source, target] =
            [transition.source, transition.target].map(|state| &states[state.index()]);
        let _ = writeln!(text, "<Edge Source=\"{source}\" Target=\"{target}\">\n<LabelBlock>");
        identifier(text, &names[&transition.label]);
        text.push_str("</LabelBlock>\n</Edge>\n");
    }
    text.push_str("</EdgeList>\n</Graph>\n");
}

/// The text of an automaton as a generator of libFAUDES, type `System`. It counts states from 1.
pub fn write_generator(automaton: &Automaton) -> String {
    let names = event_names(automaton.alphabet(), "", is_of_a_text);
    // A `#` would begin a number.
    let allowed = |letter: char| is_of_a_text(letter) && letter != '#';
    let states: Vec<String> = match automaton.state_names() {
        Some(names) => {
            let names = distinct(names.iter().map(String::as_str), allowed);
            names.iter().map(|name| format!("\"{name}\"")).collect()
        }
        None => (1..=automaton.state_count()).map(|number| number.to_string()).collect(),
    };
    let of_automaton = distinct([automaton.name()], is_of_a_text).concat();
    let mut text = format!("<Generator>\n\"{of_automaton}\"\n\n<Alphabet>\n");
    for event in automaton.alphabet().events() {
        let flags = if event.label.is_controllable() { " +C+" } else { "" };
        let _ = writeln!(text, "\"{}\"{flags}", names[&event.label]);
    }
    let list = |text: &mut String, section: &str, list: Vec<&String>| {
        let _ = writeln!(text, "\n<{section}>");
        list.into_iter().for_each(|state| {
            let _ = writeln!(text, "{state}");
        });
        let _ = writeln!(text, "</{section}>");
    };
    text.push_str("</Alphabet>\n");
    list(&mut text, "States", states.iter().collect());
    text.push_str("\n<TransRel>\n");
    for transition in automaton.transitions() {
        let [source, target] =
            [transition.source, transition.target].map(|state| &states[state.index()]);
        let _ = writeln!(text, "{source} \"{}\" {target}", names[&transition.label]);
    }
    text.push_str("</TransRel>\n");
    list(&mut text, "InitStates", states.first().into_iter().collect());
    list(
        &mut text,
        "MarkedStates",
        automaton.marked().map(|state| &states[state.index()]).collect(),
    );
    text.push_str("\n</Generator>\n");
    text
}

/// What an identifier of Supremica can hold, or a name that its tools write.
fn is_of_an_identifier(letter: char) -> bool {
    !letter.is_whitespace() && !letter.is_control()
}

/// What a text in quotes of libFAUDES can hold.
fn is_of_a_text(letter: char) -> bool {
    !letter.is_control() && letter != '"'
}

/// The name of each event, `prefix` and its number where it has none.
fn event_names(
    alphabet: &Alphabet,
    prefix: &str,
    allowed: impl Fn(char) -> bool,
) -> HashMap<Label, String> {
    let name = |event: &crate::Event| match event.name == event.label.to_string() {
        true => format!("{prefix}{}", event.name),
        false => event.name.clone(),
    };
    let names: Vec<String> = alphabet.events().iter().map(name).collect();
    alphabet.labels().zip(distinct(names.iter().map(String::as_str), allowed)).collect()
}

//! Answers of operations that are not only an automaton.

use std::time::Duration;

use serde_json::json;
use understudy_supervisor::operations::{
    Abstraction, ControlData, Difference, Uncontrolled, abstraction, condat, isomorph, lift,
    nonconflict, project, reachable, supcon,
};
use understudy_supervisor::{Automaton, Bounds, Label, Model, TooLarge, synthesis_findings};

use super::{Outcome, numbers, word};
use crate::answer::{Answer, Status};
use crate::console::Console;
use crate::supervisors::automata::{description, summary};
use crate::supervisors::reduction::reduced;

/// The projection, and which of the properties of an abstraction it has.
pub(super) fn projected(
    automaton: &Automaton,
    hidden: &[Label],
    bounds: Bounds,
) -> Result<Outcome, TooLarge> {
    let Abstraction { trimmed, observer, local_control, output_control } =
        abstraction(automaton, hidden, bounds)?;
    let mut lines = String::new();
    let mut result = json!({ "trimmed_states": trimmed });
    if trimmed > 0 {
        lines.push_str(&format!(
            "{trimmed} states are unreachable or block: the properties are about the others\n"
        ));
    }
    let unobserved = observer.map(|found| {
        let what = match found.event {
            Some(event) => format!("{} is seen to be possible", automaton.alphabet().name(event)),
            None => "a marked state is seen to be possible".to_owned(),
        };
        (
            found.word,
            format!("in state {} {what}, and hidden events do not lead to it", found.state),
        )
    });
    let uncontrolled = |found: Uncontrolled, what: &str| {
        let event = automaton.alphabet().name(found.event);
        (found.word, format!("in state {} {what} {event}", found.state))
    };
    let local =
        local_control.map(|found| uncontrolled(found, "only a hidden controllable event leads to"));
    let output = output_control
        .map(|found| uncontrolled(found, "a hidden controllable event decides about"));
    let properties = [
        ("observer property", "is_observer", unobserved),
        ("local control consistency", "is_locally_control_consistent", local),
        ("output control consistency", "is_output_control_consistent", output),
    ];
    for (name, key, why) in properties {
        result[key] = json!({ "holds": why.is_none() });
        match why {
            None => lines.push_str(&format!("{name}: holds\n")),
            Some((sequence, why)) => {
                let after = word(automaton, &sequence);
                lines.push_str(&format!("{name}: fails: after \"{after}\" {why}\n"));
                result[key]["word"] = json!(numbers(&sequence));
                result[key]["reason"] = json!(why);
            }
        }
    }
    Ok(Outcome::Automaton(project(automaton, hidden, bounds)?, Answer::done(lines, result)))
}

pub(super) fn check(parts: &[&Automaton], bounds: Bounds) -> Result<Answer, TooLarge> {
    let mut lines = Vec::new();
    let mut files = Vec::new();
    for part in parts {
        let unreachable = part.state_count() - reachable(part).state_count();
        let blocking = nonconflict(&[part], bounds)?;
        let mut line = summary(part);
        if unreachable > 0 {
            line.push_str(&format!("; {unreachable} unreachable states"));
        }
        if let Some(conflict) = &blocking {
            line.push_str(&format!(
                "; blocks in state {} after \"{}\"",
                part.state_name(conflict.states[0]),
                word(part, &conflict.word)
            ));
        }
        lines.push(line);
        let mut file = description(part);
        file["unreachable"] = json!(unreachable);
        file["nonblocking"] = json!(blocking.is_none());
        files.push(file);
    }
    Ok(Answer::done(lines.join("\n"), json!({ "automata": files })))
}

pub(super) fn supervisor(
    plant: &Automaton,
    specification: &Automaton,
    lifted: bool,
    bounds: Bounds,
) -> Result<Outcome, TooLarge> {
    let specification =
        if lifted { lift(specification, plant.alphabet()) } else { specification.clone() };
    let result = supcon(plant, &specification, bounds)?;
    let model = Model {
        alphabet: plant.alphabet().union([specification.alphabet()]),
        plants: vec![plant.clone()],
        specifications: vec![specification],
        ..Model::default()
    };
    let findings = synthesis_findings(&model, &result);
    let lines = findings.iter().map(|finding| format!("{}: {}\n", finding.code, finding.message));
    let answer = Answer::done(
        lines.collect::<String>(),
        json!({
            "explored_states": result.explored_states,
            "findings": findings.iter().map(|finding| json!({
                "code": finding.code,
                "severity": finding.severity,
                "message": finding.message,
            })).collect::<Vec<_>>(),
        }),
    );
    // EMPTY is a valid result of an operation.
    Ok(Outcome::Automaton(result.supervisor, answer))
}

pub(super) fn control_data(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
) -> Result<Answer, TooLarge> {
    let data = condat(plant, supervisor, bounds)?;
    let rows = data.table.iter();
    let lines = rows.map(|(&state, events)| {
        format!("{}: {}\n", supervisor.state_name(state), word(plant, events))
    });
    let text = format!(
        "{}{} states disable events, {} pairs",
        lines.collect::<String>(),
        data.states_with_disablement(),
        data.pairs()
    );
    let table =
        data.table.iter().map(|(state, events)| (state.to_string(), json!(numbers(events))));
    let result = json!({
        "states_with_disablement": data.states_with_disablement(),
        "pairs": data.pairs(),
        "table": table.collect::<serde_json::Map<_, _>>(),
    });
    Ok(refusing(Answer::done(text, result), plant, supervisor, &data))
}

/// Adds the states in which a supervisor disables uncontrollable events.
fn refusing(
    mut answer: Answer,
    plant: &Automaton,
    supervisor: &Automaton,
    data: &ControlData,
) -> Answer {
    for disabled in &data.uncontrollable {
        let message = format!(
            "in state {} the supervisor disables the uncontrollable event {}: it is not a supervisor of this plant",
            supervisor.state_name(disabled.state),
            plant.alphabet().name(disabled.event)
        );
        answer = answer.and_failure(Status::Failed, "U0846", message);
    }
    answer
}

/// Reduces a supervisor of this plant.
pub(super) fn reduce(
    plant: &Automaton,
    supervisor: &Automaton,
    bounds: Bounds,
    budget: Duration,
    console: &mut Console,
) -> Result<Outcome, TooLarge> {
    let data = condat(plant, supervisor, bounds)?;
    let answer = refusing(Answer::done("", json!({})), plant, supervisor, &data);
    if !answer.failures.is_empty() {
        return Ok(Outcome::Answer(answer));
    }
    Ok(match reduced(plant, supervisor, bounds, budget, console) {
        Err(answer) => Outcome::Answer(answer),
        Ok(reduced) => {
            let result = json!({
                "is_complete": reduced.warning.is_none(),
                "lower_bound": reduced.lower_bound,
            });
            let answer = Answer::done(reduced.notes(), result);
            Outcome::Automaton(reduced.supervisor, answer)
        }
    })
}

pub(super) fn compare(left: &Automaton, right: &Automaton) -> Answer {
    let difference = match isomorph(left, right) {
        Ok(states) => {
            let states: Vec<u32> = states.iter().map(|state| state.number()).collect();
            let result = json!({ "isomorphic": true, "states": states });
            return Answer::done("isomorphic", result);
        }
        Err(difference) => difference,
    };
    let said = |word_of: &[Label]| format!("\"{}\"", word(left, word_of));
    let reason = match &difference {
        Difference::StateCounts(one, two) => format!("{one} states and {two} states"),
        Difference::Enabled { word, event } => format!(
            "after {} only one of them allows {}",
            said(word),
            left.alphabet().union([right.alphabet()]).name(*event)
        ),
        Difference::Marked { word } => format!("after {} only one of them is marked", said(word)),
        Difference::Merged { word, other } => {
            format!("{} and {} lead to the same state in only one of them", said(word), said(other))
        }
        Difference::Unreachable { name, reached } => {
            format!(
                "only {reached} states of {name} are reachable; isomorph compares reachable automata"
            )
        }
    };
    let result = json!({ "isomorphic": false, "reason": reason });
    Answer::done(format!("not identical: {reason}"), result).with_status(Status::Failed)
}

pub(super) fn conflict(parts: &[&Automaton], bounds: Bounds) -> Result<Answer, TooLarge> {
    let Some(conflict) = nonconflict(parts, bounds)? else {
        return Ok(Answer::done("nonconflicting", json!({ "nonconflicting": true })));
    };
    let names = parts[0].alphabet().union(parts[1..].iter().map(|part| part.alphabet()));
    let words: Vec<String> = conflict.word.iter().map(|&label| names.name(label)).collect();
    let states = parts.iter().zip(&conflict.states);
    let states: Vec<String> = states
        .map(|(part, &state)| format!("{} in {}", part.name(), part.state_name(state)))
        .collect();
    let text = format!(
        "conflicting: after \"{}\" not all can reach marked states ({})",
        words.join(" "),
        states.join(", ")
    );
    let result = json!({ "nonconflicting": false, "word": numbers(&conflict.word) });
    Ok(Answer::done(text, result).with_status(Status::Failed))
}

//! The outcome as text: tables as the paper has them, the programs with their solutions, and the report for a person.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use serde_json::{Value, json};
use understudy_ladder::{Program, print};

use crate::analysis::Outcome;
use crate::controller::Controller;
use crate::mega::{Label, MegaState, Reached, Trimming, failed_channels};
use crate::record::Missed;
use crate::relation::{Feedback, feedback};
use crate::settle::Ground;
use crate::signals::Event;

/// Programs that are written out; the rest is only counted.
const MAXIMUM_PROGRAMS: usize = 60;

impl Outcome {
    /// Φ' of Table 4, Λ of Table 5 and Φ of Table 6.
    pub fn tables(&self) -> String {
        let (controller, signals) = (&self.controller, &self.controller.signals);
        let mut text = format!(
            "# Feedback\n\n## On outputs, Φ'\n\n| no. | state | {} |\n",
            signals.outputs.join(" | ")
        );
        let rule = |columns: usize| format!("|{}\n", "---|".repeat(columns));
        text.push_str(&rule(signals.outputs.len() + 2));
        for (place, state) in controller.states().iter().enumerate() {
            let bits: Vec<&str> =
                state.outputs.0.iter().map(|&bit| if bit { "1" } else { "0" }).collect();
            let _ = writeln!(
                text,
                "| {} | {} | {} |",
                Controller::number(place),
                controller.state_name(place),
                bits.join(" | ")
            );
        }
        let _ = write!(
            text,
            "\n## Events and outputs, Λ, over ({})\n\n| event | rows | states |\n|---|---|---|\n",
            signals.outputs.join(" ")
        );
        for event in signals.events() {
            for (rows, states) in self.rows_of(event) {
                let _ = writeln!(text, "| {} | {rows} | {states} |", signals.event_name(event));
            }
        }
        let events: Vec<Event> = signals.events().collect();
        let names: Vec<String> = events.iter().map(|&event| signals.event_name(event)).collect();
        let _ = write!(text, "\n## On events, Φ\n\n| no. | state | {} |\n", names.join(" | "));
        text.push_str(&rule(names.len() + 2));
        for place in 0..controller.states().len() {
            let row: Vec<&str> = events
                .iter()
                .map(|&event| feedback(controller, &self.relation, place, event).text())
                .collect();
            let _ = writeln!(
                text,
                "| {} | {} | {} |",
                Controller::number(place),
                controller.state_name(place),
                row.join(" | ")
            );
        }
        text
    }

    /// The different Λ_e(x) of an event, each with its states.
    fn rows_of(&self, event: Event) -> Vec<(String, String)> {
        let mut found: Vec<(String, Vec<String>)> = Vec::new();
        let count = self.controller.states().len();
        for state in 0..count {
            let rows: Vec<String> = self
                .relation
                .rows(state, event)
                .iter()
                .map(|row| format!("[{}]", row.text()))
                .collect();
            let rows = if rows.is_empty() { "none".to_owned() } else { rows.join(" or ") };
            let number = Controller::number(state).to_string();
            match found.iter_mut().find(|(known, _)| *known == rows) {
                Some((_, states)) => states.push(number),
                None => found.push((rows, vec![number])),
            }
        }
        let all = |states: Vec<String>| {
            if states.len() == count { "all".to_owned() } else { states.join(" ") }
        };
        found.into_iter().map(|(rows, states)| (rows, all(states))).collect()
    }

    /// The combined states with their demands on the outputs, and the solution.
    pub fn programs(&self) -> String {
        let signals = &self.controller.signals;
        let combined: Vec<&MegaState> =
            self.mega.states.iter().filter(|state| state.command.is_some()).collect();
        let mut text = format!(
            "# Output commands\n\n{} states of the mega-controller need a command of their own; {} different programs were solved. Outputs: ({}).\n",
            combined.len(),
            self.mega.programs,
            signals.outputs.join(" ")
        );
        let ground = Ground::new(&self.controller, &self.relation, &self.question.objective);
        let mut known = BTreeSet::new();
        for state in &combined {
            let Some(command) = &state.command else {
                continue;
            };
            if !known.insert((&state.members, state.failed)) || known.len() > MAXIMUM_PROGRAMS {
                continue;
            }
            let _ = write!(text, "\n## {}\n\n", self.describe(state));
            let mut blocked = state.blocked(&ground, &self.question);
            blocked.extend(&command.trimmed);
            for posed in ground.posed(&state.members, &blocked) {
                let rows: Vec<String> =
                    posed.demand.rows.iter().map(|row| format!("[{}]", row.text())).collect();
                let demand = if posed.demand.enable { "Σ y ≥ 1 (5)" } else { "Σ y = 0 (4)" };
                let _ = writeln!(
                    text,
                    "- state {}, {}: {} over {}",
                    Controller::number(posed.state),
                    signals.event_name(posed.event),
                    demand,
                    rows.join(", ")
                );
            }
            for given in &command.given_up {
                let _ = writeln!(
                    text,
                    "- given up: {} in state {}",
                    signals.event_name(given.event),
                    Controller::number(given.state)
                );
            }
            let trimmed: BTreeSet<Event> =
                command.trimmed.iter().map(|(_, event)| *event).collect();
            for event in trimmed {
                let _ = writeln!(
                    text,
                    "- trimmed: {}, because only the operator's release leaves the state that it leads to",
                    signals.event_name(event)
                );
            }
            let _ = writeln!(
                text,
                "\nz = ({})",
                command
                    .outputs
                    .to_string()
                    .split("")
                    .filter(|bit| !bit.is_empty())
                    .collect::<Vec<_>>()
                    .join(", ")
            );
        }
        text
    }

    /// `1 2 3, failed: Ready`.
    pub(crate) fn describe(&self, state: &MegaState) -> String {
        let members: Vec<String> = state
            .members
            .iter()
            .take(24)
            .map(|&member| Controller::number(member as usize).to_string())
            .collect();
        let more = if state.members.len() > 24 { " ..." } else { "" };
        let failed: Vec<&str> = failed_channels(&self.question.channels, state.failed)
            .map(|input| self.controller.signals.inputs[input].as_str())
            .collect();
        let failed = if failed.is_empty() {
            String::new()
        } else {
            format!(", failed: {}", failed.join(" "))
        };
        format!("{}{more}{failed}", members.join(" "))
    }

    /// For a person.
    pub fn report(&self, name: &str) -> String {
        let controller = &self.controller;
        let mut text = self.beginning(name);
        let explored = match self.joint_states {
            Some(joint) => format!("explored against its plant ({joint} states of both together)"),
            None => "learnt from its records".to_owned(),
        };
        let _ = writeln!(
            text,
            "The ladder has {} states and {} moves, {explored}. Up to {} of {} channels may be failed at once: {} states of the mega-controller, {} of them with a command of their own. Module 2 has {} rungs. Proved over {} states of ladder and world in {} scans: with no channel failed the outputs are those of the ladder alone, and with channels failed they let nothing happen that must not, wherever the plant may be.\n",
            controller.states().len(),
            controller.move_count(),
            self.question.simultaneous,
            self.question.channels.len(),
            self.mega.states.len(),
            self.mega.states.iter().filter(|state| state.command.is_some()).count(),
            self.combined.program.rungs.len() - self.combined.first_rung,
            self.proof.states,
            self.proof.scans
        );
        if !self.unseen_inputs.is_empty() {
            let _ = writeln!(
                text,
                "The plant does not show {}; these stay 0.\n",
                self.unseen_inputs.join(", ")
            );
        }
        if let Some(Missed { states, moves }) = &self.missed {
            if states.is_empty() && moves.is_empty() {
                text.push_str("The records have seen every state and every move.\n\n");
            } else {
                let moves: Vec<String> =
                    moves.iter().map(|(from, to)| format!("{from} → {to}")).collect();
                let _ = writeln!(
                    text,
                    "The records have missed {} states ({}) and {} moves ({}).\n",
                    states.len(),
                    states.join(", "),
                    moves.len(),
                    moves.join(", ")
                );
            }
        }
        let dangling = self.mega.dangling.iter().filter(|dangling| **dangling).count();
        if dangling > 0 {
            text.push_str(&self.trimmed_text(dangling));
        }
        let minimum = self.minimum_channels();
        let _ = writeln!(
            text,
            "Full control needs: {}.\n",
            if minimum.is_empty() { "no channel".to_owned() } else { minimum.join(", ") }
        );
        text.push_str("## States\n\n| no. | state | outputs on |\n|---|---|---|\n");
        for (place, state) in controller.states().iter().enumerate() {
            let _ = writeln!(
                text,
                "| {} | {} | {} |",
                Controller::number(place),
                controller.state_name(place),
                self.on(&state.outputs.0)
            );
        }
        for advice in self.advice() {
            let _ = writeln!(text, "\n## {} fails", advice.channel);
            for effect in &advice.effects {
                let list = |numbers: &[usize]| {
                    numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(" ")
                };
                let words = |names: &[String]| {
                    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
                };
                let _ = write!(text, "\n- in {}: ", list(&effect.states));
                let Some(outputs) = &effect.outputs else {
                    text.push_str("nothing changes; the channel has nothing to report there.");
                    continue;
                };
                let bits: Vec<bool> = outputs.chars().map(|bit| bit == '1').collect();
                let _ = write!(
                    text,
                    "the plant may be in {}; outputs on: {}. Stops: {}. Goes on: {}. {}",
                    list(&effect.members),
                    self.on(&bits),
                    words(&effect.stopped),
                    words(&effect.going),
                    if effect.comes_back {
                        "Goes on by itself once it is repaired."
                    } else {
                        "After the repair the operator may have to release: what has happened unseen cannot be told in every case."
                    }
                );
            }
            text.push('\n');
        }
        text
    }

    /// The title, what the report answers, and how its states and events are written.
    fn beginning(&self, name: &str) -> String {
        let signals = &self.controller.signals;
        let (inputs, outputs) = (signals.inputs.join(" "), signals.outputs.join(" "));
        let example = self.controller.state_name(0);
        let mut text = format!(
            "# What {name} can do while input channels are failed\n\nFor each input channel: in which states of the program its failure matters, what stops, what continues, and whether control returns by itself after the repair.\n\nA state such as `{example}` is the inputs and the outputs of a scan, 1 for on: the inputs ({inputs}), then the outputs ({outputs})."
        );
        if self.controller.states().iter().any(|state| state.sibling > 0) {
            text.push_str(" States with the same values and different memory end with `'1`, `'2`.");
        }
        text.push_str(" The text calls them by the numbers of the table. `x+` is the event that input x goes on, `x-` that it goes off.\n\n");
        text
    }

    /// What leads to the states that only the operator's release leaves, and what trimming changes.
    fn trimmed_text(&self, dangling: usize) -> String {
        let Trimming { prevented, kept, unavoidable, .. } = &self.trimming;
        let mut text = format!(
            "{dangling} states of the mega-controller are left by the operator's release only; {} transitions lead there, of which outputs {} {}.",
            prevented.len() + kept.len() + unavoidable.len(),
            if self.trimmed.is_some() { "now prevent" } else { "could prevent" },
            prevented.len()
        );
        if !kept.is_empty() {
            let _ = write!(
                text,
                " To prevent {} more would stop what leads back, or would not be safe.",
                kept.len()
            );
        }
        if let Some(after) = self.trimmed {
            let _ = write!(
                text,
                " Before trimming {} states could be reached, {} of them left by the release only; now {}, and {} of them.",
                self.reached.states, self.reached.dangling, after.states, after.dangling
            );
        }
        text.push_str("\n\n");
        text
    }

    fn on(&self, outputs: &[bool]) -> String {
        let names: Vec<&str> = self
            .controller
            .signals
            .outputs
            .iter()
            .zip(outputs)
            .filter(|(_, on)| **on)
            .map(|(name, _)| name.as_str())
            .collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }

    /// Everything, for machines.
    pub fn json(&self) -> Value {
        let (controller, signals) = (&self.controller, &self.controller.signals);
        let states = (0..controller.states().len()).map(|place| {
            let state = &controller.states()[place];
            let phi = signals.events().filter_map(|event| {
                let value = feedback(controller, &self.relation, place, event);
                (value != Feedback::DontCare).then(|| (signals.event_name(event), json!(value.text())))
            });
            let lambda = self.relation.controllable(place).map(|event| {
                let rows = self.relation.rows(place, event).iter().map(|row| row.text());
                (signals.event_name(event), json!(rows.collect::<Vec<_>>()))
            });
            let moves = controller.moves(place).iter();
            json!({
                "number": Controller::number(place), "state": controller.state_name(place),
                "inputs": state.inputs.to_string(), "outputs": state.outputs.to_string(),
                "feedback": phi.collect::<serde_json::Map<_, _>>(), "relation": lambda.collect::<serde_json::Map<_, _>>(),
                "moves": moves.map(|step| json!({ "events": signals.event_names(&step.events), "to": Controller::number(step.target) })).collect::<Vec<_>>(),
            })
        });
        let mega = self.mega.states.iter().enumerate().map(|(place, state)| {
            let failed = failed_channels(&self.question.channels, state.failed).map(|input| &signals.inputs[input]);
            json!({
                "members": state.members.iter().map(|&member| Controller::number(member as usize)).collect::<Vec<_>>(),
                "failed": failed.collect::<Vec<_>>(),
                "outputs": state.command.as_ref().map(|command| command.outputs.to_string()),
                "stopped": state.command.as_ref().map(|command| command.stopped.iter().map(|&event| signals.event_name(event)).collect::<Vec<_>>()),
                "dangling": self.mega.dangling[place],
                "edges": self.mega.edges[place].iter().map(|(label, target)| json!([self.label(label), target])).collect::<Vec<_>>(),
            })
        });
        json!({
            "inputs": signals.inputs, "outputs": signals.outputs,
            "channels": self.question.channels.iter().map(|&input| &signals.inputs[input]).collect::<Vec<_>>(),
            "simultaneous": self.question.simultaneous, "joint_states": self.joint_states,
            "states": states.collect::<Vec<_>>(), "mega_states": mega.collect::<Vec<_>>(),
            "missed": self.missed.as_ref().map(|missed| json!({ "states": missed.states, "moves": missed.moves })),
            "advice": self.advice(), "minimum_channels": self.minimum_channels(),
            "lost_outputs": self.lost_outputs.to_string(), "trimming": self.trimming_json(),
            "rungs": self.combined.program.rungs.len(), "module_2_rungs": self.combined.program.rungs.len() - self.combined.first_rung,
            "proof": { "states": self.proof.states, "scans": self.proof.scans, "outside": self.proof.outside, "latched": self.proof.latched },
        })
    }

    fn trimming_json(&self) -> Value {
        let events = |list: &[(usize, Vec<Event>)]| -> Vec<Value> {
            let signals = &self.controller.signals;
            let pair =
                |(place, events): &(usize, Vec<Event>)| json!([place, signals.event_names(events)]);
            list.iter().map(pair).collect()
        };
        let labels = self.trimming.unavoidable.iter();
        let reached =
            |reached: Reached| json!({ "states": reached.states, "dangling": reached.dangling });
        json!({
            "prevented": events(&self.trimming.prevented), "kept": events(&self.trimming.kept),
            "stopped": events(&self.trimming.stopped),
            "unavoidable": labels.map(|(place, label)| json!([place, self.label(label)])).collect::<Vec<_>>(),
            "before": reached(self.reached), "after": self.trimmed.map(reached),
        })
    }

    pub(crate) fn label(&self, label: &Label) -> String {
        let channel =
            |bit: usize| self.controller.signals.inputs[self.question.channels[bit]].as_str();
        match label {
            Label::Seen(events) if events.is_empty() => "omega".into(),
            Label::Seen(events) => self.controller.signals.event_names(events),
            Label::Break(bit) => format!("{} fails", channel(*bit)),
            Label::Repair(bit, None) => format!("{} repaired", channel(*bit)),
            Label::Repair(bit, Some(value)) => {
                format!("{} repaired at {}", channel(*bit), u8::from(*value))
            }
        }
    }

    /// Module 2 by itself, as text to read beside the combined ladder: its rungs, without declarations.
    pub fn module_two_text(&self) -> String {
        let whole = &self.combined.program;
        let module = Program {
            name: whole.name.clone(),
            description: Some("module 2 only; combined.ladder is the whole".into()),
            rungs: whole.rungs[self.combined.first_rung..].to_vec(),
            ..Program::default()
        };
        print(&module)
    }
}

//! Sequential function charts as statements, in the order in which matiec's code executes them: which transitions fire is found from
//! the steps as they were, then steps end and begin, then the actions of the steps that are active now are done.
//!
//! Transitions that leave one step are tried by their priority, and then from left to right; the first that can fires. Function blocks
//! that stand in the chart itself, and the networks of transitions, act in every scan.

pub(super) mod structure;

use std::collections::HashMap;

use understudy_ladder::Name;
use understudy_text::Diagnostic;

pub(super) use self::structure::wired;
use self::structure::{Structure, structure};
use super::document::{
    Action, ActionContent, Body, Condition, Graph, Kind, Part, Pou, Project, Transition,
};
use super::statements::Statements;
use super::units::{Lowered, network};
use super::xml::Passage;

/// Writes the statements of a chart.
pub(super) fn write(
    project: &Project,
    pou: &Pou,
    graph: &Graph,
    statements: &mut Statements<'_>,
    lowered: &mut Lowered,
) {
    let before = lowered.diagnostics.len();
    let structure = structure(graph, &mut lowered.diagnostics);
    let mut chart = Chart {
        project,
        pou,
        graph,
        structure,
        steps: HashMap::new(),
        statements,
        lowered,
    };
    chart.declare_steps();
    network(project, graph, chart.statements, chart.lowered);
    chart.transitions();
    chart.actions();
    let chart_is_right = chart.lowered.diagnostics.len() == before;
    if chart_is_right && chart.structure.steps.is_empty() {
        let message = format!("the sequence of `{}` has no step", pou.name);
        let error = Diagnostic::error("U1015", message, pou.name.span());
        lowered.diagnostics.push(error);
    }
}

/// An action or a variable, and when it is done.
struct Deed<'a> {
    name: Option<&'a Name>,
    body: Option<&'a Body>,
    place: usize,
    drives: Vec<String>,
    /// The step that sets or resets it.
    stores: Vec<(String, bool)>,
}

struct Chart<'a, 'b, 's> {
    project: &'a Project,
    pou: &'a Pou,
    graph: &'a Graph,
    structure: Structure,
    /// The bits of the steps by their objects.
    steps: HashMap<usize, String>,
    statements: &'b mut Statements<'s>,
    lowered: &'b mut Lowered,
}

impl Chart<'_, '_, '_> {
    fn error(&mut self, message: String, place: usize) {
        let span = self.graph.objects[place].span.clone();
        self.lowered
            .diagnostics
            .push(Diagnostic::error("U1015", message, span));
    }

    fn line(&mut self, text: &str, place: usize) {
        let span = self.graph.objects[place].span.clone();
        self.statements.push(text, &span);
    }

    /// A bit each. The first scan makes the initial steps active.
    fn declare_steps(&mut self) {
        let begun = self.statements.declare("begun", "BOOL");
        let mut initial = Vec::new();
        for place in self.structure.steps.clone() {
            let Kind::Step(name, is_initial) = &self.graph.objects[place].kind else {
                continue;
            };
            let bit = self
                .statements
                .declare(&format!("step_{}", plain(name)), "BOOL");
            let known = format!("{}.X", name.to_uppercase());
            self.statements.renamed.insert(known, bit.clone());
            if *is_initial {
                initial.push((bit.clone(), place));
            }
            self.steps.insert(place, bit);
        }
        if let Some((_, first)) = initial.first() {
            self.line(&format!("IF NOT {begun} THEN {begun} := TRUE;\n"), *first);
            for (bit, place) in &initial {
                self.line(&format!("{bit} := TRUE;\n"), *place);
            }
            self.line("END_IF;\n", *first);
        } else if let Some(&step) = self.structure.steps.first() {
            self.error("the sequence has no initial step".to_owned(), step);
        }
    }

    fn transitions(&mut self) {
        let mut conditions = Vec::new();
        for place in self.structure.transitions.clone() {
            if let Kind::Transition(transition) = &self.graph.objects[place].kind {
                let condition = self.condition(place, transition);
                conditions.push((place, condition, transition.priority));
            }
        }
        conditions.sort_by_key(|(place, _, priority)| {
            let position = self.graph.objects[*place].position;
            (
                if *priority == 0 { u64::MAX } else { *priority },
                position.0,
                position.1,
            )
        });
        let mut fired: Vec<(usize, String)> = Vec::new();
        for (place, condition, _) in conditions {
            let from = self.structure.from.get(&place).cloned().unwrap_or_default();
            let bits: Vec<String> = from
                .iter()
                .filter_map(|step| self.steps.get(step).cloned())
                .collect();
            if bits.is_empty() {
                self.error("no step is before the transition".to_owned(), place);
                continue;
            }
            let mut text = bits.join(" AND ");
            text.push_str(&format!(" AND {condition}"));
            for (other, fires) in &fired {
                let shares = self
                    .structure
                    .from
                    .get(other)
                    .is_some_and(|steps| steps.iter().any(|step| from.contains(step)));
                if shares {
                    text.push_str(&format!(" AND NOT {fires}"));
                }
            }
            let fires = self.statements.declare("fires", "BOOL");
            self.line(&format!("{fires} := {text};\n"), place);
            fired.push((place, fires));
        }
        for (place, fires) in &fired {
            let from = self.structure.from.get(place).cloned().unwrap_or_default();
            self.set(*place, fires, &from, "FALSE");
        }
        for (place, fires) in &fired {
            let to = self.structure.to.get(place).cloned().unwrap_or_default();
            if to.is_empty() {
                self.error("no step is behind the transition".to_owned(), *place);
            }
            self.set(*place, fires, &to, "TRUE");
        }
    }

    fn set(&mut self, place: usize, fires: &str, steps: &[usize], value: &str) {
        for step in steps {
            if let Some(bit) = self.steps.get(step).cloned() {
                self.line(
                    &format!("IF {fires} THEN {bit} := {value}; END_IF;\n"),
                    place,
                );
            }
        }
    }

    /// The bit that says whether the transition may fire.
    fn condition(&mut self, place: usize, transition: &Transition) -> String {
        let bit = match &transition.condition {
            Condition::Wired => wired(&self.graph.objects[place]),
            Condition::Inline(body) => self.condition_of(place, None, body),
            Condition::Reference(name) => {
                let part = find(&self.pou.transitions, name);
                match part.and_then(|part| part.body.as_ref()) {
                    Some(body) => self.condition_of(place, Some(name), body),
                    None => {
                        self.statements.name(&Name::at("", name.span()));
                        name.to_string()
                    }
                }
            }
            Condition::Missing => {
                self.error("the transition has no condition".to_owned(), place);
                return "FALSE".to_owned();
            }
        };
        // A wired condition is written by the network of the chart.
        if matches!(transition.condition, Condition::Wired) {
            self.statements.declare_as(&bit, "BOOL");
        }
        if transition.negated {
            format!("NOT {bit}")
        } else {
            bit
        }
    }

    /// The condition that a body writes, under the name of the transition or as its last written variable.
    fn condition_of(&mut self, place: usize, name: Option<&Name>, body: &Body) -> String {
        let bit = self.statements.declare("condition", "BOOL");
        match body {
            Body::Graph(graph) => {
                let written = graph
                    .objects
                    .iter()
                    .rev()
                    .find_map(|object| match &object.kind {
                        Kind::Coil(variable, _) | Kind::OutVariable(variable, _) => Some(variable),
                        _ => None,
                    });
                let answer = name.or(written).map(|name| name.to_uppercase());
                let before = answer
                    .clone()
                    .and_then(|answer| self.statements.renamed.insert(answer, bit.clone()));
                network(self.project, graph, self.statements, self.lowered);
                if let Some(answer) = answer {
                    self.statements.renamed.remove(&answer);
                    if let Some(before) = before {
                        self.statements.renamed.insert(answer, before);
                    }
                }
            }
            Body::StructuredText(text) => {
                let whole = text.as_str();
                let bare = whole.trim().trim_start_matches(":=").trim_start();
                let start = whole.trim_end().len() - bare.len();
                let bare = bare.trim_end_matches(|end: char| end == ';' || end.is_whitespace());
                self.line(&format!("{bit} := ("), place);
                self.statements
                    .verbatim(&text.slice(start..start + bare.len()));
                self.line(");\n", place);
            }
            Body::InstructionList(text) => {
                self.foreign("an instruction list in a sequence", text.span());
            }
        }
        bit
    }

    /// What several steps do is done once: while one of them has it done, or has stored that it is.
    fn actions(&mut self) {
        let graph = self.graph;
        let mut deeds: Vec<Deed<'_>> = Vec::new();
        for place in self.structure.actions.clone() {
            let Kind::Actions(actions) = &graph.objects[place].kind else {
                continue;
            };
            let step = self.structure.step_of.get(&place);
            let Some(bit) = step.and_then(|step| self.steps.get(step)).cloned() else {
                self.error("no step has these actions".to_owned(), place);
                continue;
            };
            for action in actions {
                let (name, body) = match &action.content {
                    ActionContent::Missing => {
                        let message = "the action does nothing: it names no action and no variable";
                        let found = Diagnostic::warning("U1023", message, action.span.clone());
                        self.lowered.diagnostics.push(found);
                        continue;
                    }
                    ActionContent::Inline(body) => (None, Some(body)),
                    ActionContent::Reference(name) => {
                        let part = find(&self.pou.actions, name);
                        (Some(name), part.and_then(|part| part.body.as_ref()))
                    }
                };
                let known = deeds.iter().position(|deed| match (deed.name, name) {
                    (Some(known), Some(name)) => known.eq_ignore_ascii_case(name),
                    _ => false,
                });
                let deed = known.unwrap_or_else(|| {
                    deeds.push(Deed {
                        name,
                        body,
                        place,
                        drives: Vec::new(),
                        stores: Vec::new(),
                    });
                    deeds.len() - 1
                });
                self.qualified(place, &bit, action, &mut deeds[deed]);
            }
        }
        for deed in deeds {
            self.deed(&deed);
        }
    }

    /// What a step's action adds to the deed.
    fn qualified(&mut self, place: usize, step: &str, action: &Action, deed: &mut Deed<'_>) {
        let qualifier = action.qualifier.to_ascii_uppercase();
        match (qualifier.as_str(), &action.duration) {
            ("" | "N", _) => deed.drives.push(step.to_owned()),
            ("S", _) => deed.stores.push((step.to_owned(), true)),
            ("R", _) => deed.stores.push((step.to_owned(), false)),
            ("P" | "P1", _) => deed.drives.push(self.edge(place, step, true)),
            ("P0", _) => deed.drives.push(self.edge(place, step, false)),
            ("D" | "L", Some(duration)) => {
                let timer = self.statements.declare("delay", "TON");
                self.line(&format!("{timer}(IN := {step}, PT := "), place);
                self.statements.name(duration);
                self.line(");\n", place);
                deed.drives.push(if qualifier == "D" {
                    format!("{timer}.Q")
                } else {
                    format!("{step} AND NOT {timer}.Q")
                });
            }
            _ => {
                let message = format!("an action with the qualifier {qualifier} is not supported");
                let span = action.qualifier.span();
                let error = Diagnostic::error("U1010", message, span);
                self.lowered.diagnostics.push(error);
            }
        }
    }

    fn deed(&mut self, deed: &Deed<'_>) {
        let is_variable = deed.body.is_none();
        let mut drives = deed.drives.clone();
        let stored = match (deed.name, deed.stores.is_empty()) {
            (_, true) => None,
            // A variable that nothing else drives stores itself.
            (Some(name), false) if is_variable && drives.is_empty() => Some(name.clone()),
            (_, false) => {
                let stored = self.statements.declare("stored", "BOOL");
                drives.push(stored.clone());
                Some(Name::at(
                    stored,
                    self.graph.objects[deed.place].span.clone(),
                ))
            }
        };
        if let Some(stored) = stored {
            for (step, value) in &deed.stores {
                self.line(&format!("IF {step} THEN "), deed.place);
                self.statements.name(&stored);
                let value = if *value { "TRUE" } else { "FALSE" };
                self.line(&format!(" := {value}; END_IF;\n"), deed.place);
            }
        }
        if drives.is_empty() {
            return;
        }
        let condition = drives.join(" OR ");
        match (deed.name, deed.body) {
            (Some(name), None) => {
                self.statements.name(name);
                self.line(&format!(" := {condition};\n"), deed.place);
            }
            (_, body) => {
                self.line(&format!("IF {condition} THEN\n"), deed.place);
                match body {
                    Some(Body::Graph(graph)) => {
                        network(self.project, graph, self.statements, self.lowered);
                    }
                    Some(Body::StructuredText(text)) => self.statements.verbatim(text),
                    Some(Body::InstructionList(text)) => {
                        self.foreign("an instruction list in a sequence", text.span());
                    }
                    None => {}
                }
                self.line("\nEND_IF;\n", deed.place);
            }
        }
    }

    fn foreign(&mut self, what: &str, span: std::ops::Range<usize>) {
        let message = format!("{what} is not supported");
        let error = Diagnostic::error("U1010", message, span);
        self.lowered.diagnostics.push(error);
    }

    /// A step's beginning or end. A step that has never been active has not ended.
    fn edge(&mut self, place: usize, step: &str, begins: bool) -> String {
        let last = self.statements.declare("was", "BOOL");
        let pulse = self.statements.declare("pulse", "BOOL");
        let condition = if begins {
            format!("{step} AND NOT {last}")
        } else {
            format!("NOT {step} AND {last}")
        };
        self.line(
            &format!("{pulse} := {condition};\n{last} := {step};\n"),
            place,
        );
        pulse
    }
}

impl Statements<'_> {
    /// A text of the file as it is, except for the names of steps.
    fn verbatim(&mut self, text: &Passage) {
        let is_word = |letter: char| letter.is_alphanumeric() || matches!(letter, '_' | '.');
        let whole = text.as_str();
        let mut from = 0;
        while from < whole.len() {
            let first = whole[from..].chars().next().is_some_and(is_word);
            let length = whole[from..].find(|letter| is_word(letter) != first);
            let next = length.map_or(whole.len(), |length| from + length);
            let word = &whole[from..next];
            let place = text.place(from..next);
            self.name(&Name::at(word, place));
            from = next;
        }
    }
}

fn find<'a>(parts: &'a [Part], name: &Name) -> Option<&'a Part> {
    parts
        .iter()
        .find(|part| part.name.eq_ignore_ascii_case(name))
}

fn plain(name: &str) -> String {
    name.chars()
        .map(|letter| {
            if letter.is_ascii_alphanumeric() {
                letter
            } else {
                'x'
            }
        })
        .collect()
}

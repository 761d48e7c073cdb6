//! Sequential function charts: steps, transitions and actions as a chart of the syntax. A body that is more than a value or
//! statements is a method of the unit.

use std::collections::HashMap;

use understudy_ladder::Name as Written;
use understudy_structured_text::parser::{
    parse_expression_at, parse_instructions_at, parse_statements_at,
};
use understudy_structured_text::syntax::{
    Action, Argument, Association, Body, Chart, ChartStep, Expression, Name, Statement,
    StatementKind, Transition, TypeName, Unit, UnitKind,
};
use understudy_text::Diagnostic;

use super::make;
use super::network::Network;
use crate::plcopen::document::{
    self, ActionContent, Body as Drawn, CONDITION, Condition, Graph, Kind, Part, Pou,
};
use crate::plcopen::plan::{self, Plan};
use crate::plcopen::power::Power;
use crate::plcopen::structure::wired;
use crate::plcopen::structure::{Structure, structure};
use crate::plcopen::xml::Passage;

/// A chart with the methods that it calls.
pub(super) struct Charted {
    pub(super) chart: Chart,
    pub(super) methods: Vec<Unit>,
}

struct Reader<'a, 'n> {
    pou: &'a Pou,
    graph: &'a Graph,
    structure: Structure,
    network: &'n mut Network<'a>,
    methods: Vec<Unit>,
    chart: Chart,
}

pub(super) fn chart<'a>(pou: &'a Pou, graph: &'a Graph, network: &mut Network<'a>) -> Charted {
    let structure = structure(graph, network.diagnostics);
    let mut reader =
        Reader { pou, graph, structure, network, methods: Vec::new(), chart: Chart::default() };
    let wired = reader.wired();
    reader.steps();
    reader.transitions(&wired);
    reader.actions();
    Charted { chart: reader.chart, methods: reader.methods }
}

impl Reader<'_, '_> {
    fn error(&mut self, code: &'static str, message: String, span: std::ops::Range<usize>) {
        let found = Diagnostic::error(code, message, span);
        self.network.diagnostics.push(found);
    }

    /// What the network of the chart itself gives to its transitions, by their variables.
    fn wired(&mut self) -> HashMap<String, Expression> {
        let mut plan = self.network.plan(self.graph);
        let mut conditions = HashMap::new();
        // A condition of contacts alone is a value; what has steps before it is a method that takes them.
        let is_plain = plan.steps.iter().all(|step| match &step.action {
            plan::Action::Write { power, .. } => is_plain(power),
            _ => false,
        });
        if is_plain {
            for step in std::mem::take(&mut plan.steps) {
                if let plan::Action::Write { targets, power, .. } = step.action {
                    let value = self.network.value(&power, &step.span);
                    for (target, _) in targets {
                        conditions.insert(target.to_uppercase(), value.clone());
                    }
                }
            }
            return conditions;
        }
        self.drawn_conditions(&plan, &mut conditions);
        conditions
    }

    /// The network of the chart acts in each scan, before any transition is looked at: it is the condition, never true, of a transition
    /// of a step of its own.
    fn drawn_conditions(&mut self, plan: &Plan, conditions: &mut HashMap<String, Expression>) {
        let span = self.pou.name.span();
        for object in &self.graph.objects {
            if matches!(object.kind, Kind::Transition(_)) {
                let target = wired(object).to_uppercase();
                let name = self.network.declare("condition", make::named("BOOL", &span));
                conditions.insert(target.clone(), make::variable(&name, &object.span));
                self.network.renamed.insert(target, name);
            }
        }
        let statements = self.network.planned(plan);
        self.network.renamed.clear();
        if statements.is_empty() {
            return;
        }
        let bool = Some(make::named("BOOL", &span));
        let condition = self.method("network", bool, Body::Statements(statements), &span);
        let step = Name::new("network.step", span.clone());
        self.chart.steps.push(ChartStep {
            name: step.clone(),
            is_initial: true,
            associations: Vec::new(),
        });
        self.chart.transitions.push(Transition {
            name: None,
            priority: Some(i64::MIN),
            from: vec![step.clone()],
            to: vec![step],
            condition,
            span,
        });
    }

    fn steps(&mut self) {
        for place in self.structure.steps.clone() {
            if let Kind::Step(name, is_initial) = &self.graph.objects[place].kind {
                self.chart.steps.push(ChartStep {
                    name: make::name(name),
                    is_initial: *is_initial,
                    associations: Vec::new(),
                });
            }
        }
        if self.structure.steps.is_empty() {
            let message = format!("the sequence of `{}` has no step", self.pou.name);
            self.error("U1015", message, self.pou.name.span());
        }
    }

    fn name_of(&self, step: usize) -> Option<Name> {
        match &self.graph.objects[step].kind {
            Kind::Step(name, _) => Some(make::name(name)),
            _ => None,
        }
    }

    fn transitions(&mut self, wired_values: &HashMap<String, Expression>) {
        let graph = self.graph;
        let mut order = self.structure.transitions.clone();
        order.sort_by_key(|place| graph.objects[*place].position);
        for place in order {
            let object = &graph.objects[place];
            let Kind::Transition(transition) = &object.kind else {
                continue;
            };
            let span = object.span.clone();
            let mut condition = match &transition.condition {
                Condition::Wired => {
                    let has = object.inputs.iter().any(|pin| pin.name.as_str() == CONDITION);
                    let value = wired_values.get(&wired(object).to_uppercase()).cloned();
                    value.filter(|_| has).unwrap_or_else(|| make::boolean(false, &span))
                }
                Condition::Inline(body) => self.condition(place, None, body),
                Condition::Reference(name) => {
                    let pou = self.pou;
                    match find(&pou.transitions, name).and_then(|part| part.body.as_ref()) {
                        Some(body) => self.condition(place, Some(name), body),
                        None => self.network.parsed(name),
                    }
                }
                Condition::Missing => {
                    let message = "the transition has no condition".to_owned();
                    self.error("U1015", message, span.clone());
                    make::boolean(false, &span)
                }
            };
            if transition.negated {
                condition = make::not(condition);
            }
            let steps = |ends: &HashMap<usize, Vec<usize>>| -> Vec<Name> {
                let steps = ends.get(&place).into_iter().flatten();
                steps.filter_map(|step| self.name_of(*step)).collect()
            };
            let (from, to) = (steps(&self.structure.from), steps(&self.structure.to));
            for (ends, what) in [(&from, "before"), (&to, "behind")] {
                if ends.is_empty() {
                    let message = format!("no step is {what} the transition");
                    self.error("U1015", message, span.clone());
                }
            }
            let priority = i64::try_from(transition.priority).unwrap_or(i64::MAX);
            self.chart.transitions.push(Transition {
                name: None,
                priority: (priority > 0).then_some(priority),
                from,
                to,
                condition,
                span,
            });
        }
    }

    /// The condition that a body writes.
    fn condition(&mut self, place: usize, name: Option<&Written>, body: &Drawn) -> Expression {
        let span = self.graph.objects[place].span.clone();
        match body {
            Drawn::StructuredText(text) => self.written(text),
            Drawn::InstructionList(text) => {
                let (list, found) = parse_instructions_at(text.as_str(), &|span| text.place(span));
                self.network.diagnostics.extend(found);
                let bool = Some(make::named("BOOL", &span));
                self.method("condition", bool, Body::Instructions(list), &span)
            }
            Drawn::Graph(graph) => {
                let written = graph.objects.iter().rev().find_map(|object| match &object.kind {
                    Kind::Coil(variable, _) | Kind::OutVariable(variable, _) => Some(variable),
                    _ => None,
                });
                let named = |name: &&Written| {
                    graph.objects.iter().any(|object| match &object.kind {
                        Kind::Coil(variable, _) | Kind::OutVariable(variable, _) => {
                            variable.eq_ignore_ascii_case(name)
                        }
                        _ => false,
                    })
                };
                let Some(answer) = name.filter(named).or(written) else {
                    let message = "the condition of the transition writes nothing".to_owned();
                    self.error("U1015", message, span.clone());
                    return make::boolean(false, &span);
                };
                let value = self.network.declare("condition", make::named("BOOL", &span));
                self.network.renamed.insert(answer.to_uppercase(), value.clone());
                let mut statements = self.network.statements(graph);
                self.network.renamed.clear();
                let method = self.method_name("condition");
                let result = make::path(&method, None, &span);
                statements.push(make::assign(result, make::variable(&value, &span), &span));
                let bool = Some(make::named("BOOL", &span));
                self.add(&method, bool, Body::Statements(statements), &span);
                make::call(Name::new(method, span.clone()), Vec::new(), &span)
            }
        }
    }

    /// `:= a AND b;`, as it stands or without its signs.
    fn written(&mut self, text: &Passage) -> Expression {
        let whole = text.as_str();
        let bare = whole.trim().trim_start_matches(":=").trim_start();
        let start = whole.trim_end().len() - bare.len();
        let bare = bare.trim_end_matches(|end: char| end == ';' || end.is_whitespace());
        let part = text.slice(start..start + bare.len());
        let (value, found) = parse_expression_at(part.as_str(), &|span| part.place(span));
        self.network.diagnostics.extend(found);
        value
    }

    fn method_name(&self, what: &str) -> String {
        format!("{what}.method.{}", self.methods.len())
    }

    /// A method of that body, and its call.
    fn method(
        &mut self,
        what: &str,
        result: Option<TypeName>,
        body: Body,
        span: &std::ops::Range<usize>,
    ) -> Expression {
        let name = self.method_name(what);
        self.add(&name, result, body, span);
        make::call(Name::new(name, span.clone()), Vec::new(), span)
    }

    fn add(
        &mut self,
        name: &str,
        result: Option<TypeName>,
        body: Body,
        span: &std::ops::Range<usize>,
    ) {
        self.methods.push(Unit {
            kind: UnitKind::Method,
            name: Name::new(name, span.clone()),
            comments: Vec::new(),
            result,
            declarations: Vec::new(),
            body,
            methods: Vec::new(),
            extends: None,
            implements: Vec::new(),
            span: span.clone(),
        });
    }

    fn actions(&mut self) {
        let graph = self.graph;
        let mut taken: Vec<String> = Vec::new();
        for place in self.structure.actions.clone() {
            let Kind::Actions(actions) = &graph.objects[place].kind else {
                continue;
            };
            let step = self.structure.step_of.get(&place);
            let Some(step) = step.and_then(|step| self.name_of(*step)) else {
                let message = "no step has these actions".to_owned();
                self.error("U1015", message, graph.objects[place].span.clone());
                continue;
            };
            for (at, action) in actions.iter().enumerate() {
                if let Some(association) = self.association(place, at, action, &mut taken) {
                    let steps = self.chart.steps.iter_mut();
                    if let Some(found) = steps.into_iter().find(|known| known.name == step) {
                        found.associations.push(association);
                    }
                }
            }
        }
    }

    fn association(
        &mut self,
        place: usize,
        at: usize,
        action: &document::Action,
        taken: &mut Vec<String>,
    ) -> Option<Association> {
        let pou = self.pou;
        let (name, body) = match &action.content {
            ActionContent::Missing => {
                let message = "the action does nothing: it names no action and no variable";
                let found = Diagnostic::warning("U1023", message, action.span.clone());
                self.network.diagnostics.push(found);
                return None;
            }
            ActionContent::Inline(body) => {
                let id = self.graph.objects[place].id;
                let name = Name::new(format!("action.{id}.{at}"), action.span.clone());
                (name, Some(body))
            }
            ActionContent::Reference(name) => {
                let part = find(&pou.actions, name);
                (make::name(name), part.and_then(|part| part.body.as_ref()))
            }
        };
        if let Some(body) = body
            && !taken.contains(&name.key())
        {
            taken.push(name.key());
            let body = self.deed(body, &action.span);
            self.chart.actions.push(Action { name: name.clone(), body });
        }
        let qualifier = match action.qualifier.is_empty() {
            true => Name::new("N", action.span.clone()),
            false => make::name(&action.qualifier),
        };
        let duration = action.duration.as_ref().filter(|duration| !duration.is_empty());
        Some(Association {
            action: name,
            qualifier,
            duration: duration.map(|duration| self.network.parsed(duration)),
            indicators: Vec::new(),
        })
    }

    /// What an action does.
    fn deed(&mut self, body: &Drawn, span: &std::ops::Range<usize>) -> Vec<Statement> {
        match body {
            Drawn::StructuredText(text) => {
                let (statements, found) =
                    parse_statements_at(text.as_str(), &|span| text.place(span));
                self.network.diagnostics.extend(found);
                statements
            }
            Drawn::InstructionList(text) => {
                let (list, found) = parse_instructions_at(text.as_str(), &|span| text.place(span));
                self.network.diagnostics.extend(found);
                let name = self.method_name("action");
                self.add(&name, None, Body::Instructions(list), span);
                let arguments: Vec<Argument> = Vec::new();
                let call = StatementKind::Call(make::path(&name, None, span), arguments);
                vec![make::statement(call, span)]
            }
            Drawn::Graph(graph) => self.network.statements(graph),
        }
    }
}

/// Whether a power is a value without a memory of its own.
fn is_plain(power: &Power) -> bool {
    let mut plain = true;
    power.visit(&mut |part| match part {
        Power::Read(read) => plain &= read.edge.is_none(),
        Power::Kept(_) => plain = false,
        _ => {}
    });
    plain
}

fn find<'a>(parts: &'a [Part], name: &Written) -> Option<&'a Part> {
    parts.iter().find(|part| part.name.eq_ignore_ascii_case(name))
}

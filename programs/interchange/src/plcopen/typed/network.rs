//! A network as statements, in the order of its plan.

mod scans;
mod steps;

use std::collections::HashMap;
use std::ops::Range;

use understudy_ladder::{BlockKind, Name as Written};
use understudy_structured_text::in_parts;
use understudy_structured_text::parser::parse_expression_at;
use understudy_structured_text::syntax::{
    Argument, Class, Declaration, Expression, ExpressionKind, File, Name, Operator, Path,
    Statement, StatementKind, TypeKind, UnitKind,
};
use understudy_text::Diagnostic;

use super::make;
use super::values::{Values, unit};
use crate::plcopen::document::{Edge, Graph};
use crate::plcopen::plan::{Action, Named, Places, Plan, plan};
use crate::plcopen::power::{Power, Read};

/// What is written for one unit: its networks share their names.
pub(super) struct Network<'a> {
    pub(super) file: &'a File,
    /// Of the unit.
    pub(super) declarations: &'a [Declaration],
    /// Which were made for it. A name with a dot is none that a person can write.
    pub(super) made: Vec<Declaration>,
    /// Written by a tool that declares no instances of blocks.
    pub(super) lacks_instances: bool,
    /// Of rungs that are not of the schema.
    numbers: scans::Numbers,
    pub(super) diagnostics: &'a mut Vec<Diagnostic>,
    /// What an object of the graph has kept.
    kept: HashMap<usize, String>,
    triggers: HashMap<usize, String>,
    /// What is connected to the in-out variables of calls, and where results of functions are, by call and pin in capitals.
    results: HashMap<(String, String), Expression>,
    /// The outputs of functions: of which call, the pin or nothing for the result, and the variable.
    outputs: Vec<(String, String, String)>,
    /// What transitions of a chart are called here.
    pub(super) renamed: HashMap<String, String>,
    /// Instances that nobody named, as they are called here.
    instances: HashMap<String, String>,
    parts: Vec<Vec<Statement>>,
    /// The addresses of the variables of the unit.
    pub(super) places: Places,
    /// What is worth knowing of the networks and changes nothing.
    pub(super) notes: Vec<(String, Range<usize>)>,
}

/// Which part of a network with jumps is next.
const NEXT: &str = "next";

impl<'a> Network<'a> {
    pub(super) fn new(
        file: &'a File,
        declarations: &'a [Declaration],
        lacks_instances: bool,
        diagnostics: &'a mut Vec<Diagnostic>,
    ) -> Self {
        Self {
            file,
            declarations,
            made: Vec::new(),
            lacks_instances,
            numbers: scans::Numbers::default(),
            diagnostics,
            kept: HashMap::new(),
            triggers: HashMap::new(),
            results: HashMap::new(),
            outputs: Vec::new(),
            renamed: HashMap::new(),
            instances: HashMap::new(),
            parts: Vec::new(),
            places: places(file, declarations),
            notes: Vec::new(),
        }
    }

    /// The statements of a graph of LD or FBD.
    pub(super) fn statements(&mut self, graph: &Graph) -> Vec<Statement> {
        let plan = self.plan(graph);
        self.find_numbers(graph, &plan);
        let mut statements = self.planned(&plan);
        if !plan.footer.is_empty() {
            let end = statements.last().map_or(0, |last| last.span.end);
            let nothing = make::statement(StatementKind::Nothing, &(end..end));
            statements.push(Statement { comments: plan.footer, ..nothing });
        }
        statements
    }

    pub(super) fn plan(&mut self, graph: &Graph) -> Plan {
        let file = self.file;
        let is_call = |name: &str| is_call(file, name);
        let mut plan = plan(graph, &is_call, &self.places, self.diagnostics);
        self.notes.append(&mut plan.notes);
        plan
    }

    pub(super) fn planned(&mut self, plan: &Plan) -> Vec<Statement> {
        self.kept.clear();
        self.triggers.clear();
        self.results.clear();
        self.instances.clear();
        self.outputs.clear();
        self.parts = vec![Vec::new()];
        let labels = self.labels(plan);
        // What goes round is asked for before it is kept.
        for step in &plan.steps {
            if let Action::Call(call) = &step.action {
                self.declared(call, &step.span);
            }
        }
        self.keep_early(plan);
        for step in &plan.steps {
            self.step(step, labels.as_ref());
        }
        let parts = std::mem::take(&mut self.parts);
        self.joined(parts)
    }

    fn error(&mut self, code: &'static str, message: String, span: Range<usize>) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn push(&mut self, statement: Statement) {
        if let Some(part) = self.parts.last_mut() {
            part.push(statement);
        }
    }

    /// A new variable of the unit.
    pub(super) fn declare(
        &mut self,
        what: &str,
        of: understudy_structured_text::syntax::TypeName,
    ) -> String {
        let name = format!("{what}.{}", self.made.len());
        let span = of.span.clone();
        self.made.push(make::declare(&name, Class::Local, of, &span));
        name
    }

    /// The parts between labels: one, or a loop over a CASE of them.
    fn joined(&mut self, mut parts: Vec<Vec<Statement>>) -> Vec<Statement> {
        if parts.len() == 1 {
            return parts.pop().unwrap_or_default();
        }
        let first = parts.iter().flatten().next();
        let span = first.map_or(0..0, |first| first.span.clone());
        let next = self.next();
        let turn = self.declare("network.turn", make::named("DINT", &span));
        in_parts(parts, &next, &turn, &span)
    }

    fn next(&self) -> String {
        // One for each network that has jumps.
        let made = self.made.iter().rev();
        let mut made = made.filter(|made| made.name.as_str().starts_with(NEXT));
        made.next().map_or(NEXT.to_owned(), |made| made.name.as_str().to_owned())
    }

    /// An expression as it is written in an object.
    pub(super) fn parsed(&mut self, written: &Written) -> Expression {
        if let Some(renamed) = self.renamed.get(&written.to_uppercase()) {
            return make::variable(renamed, &written.span());
        }
        if written.is_empty() {
            // It is missing, which was found where it should stand.
            return Expression { kind: ExpressionKind::Faulty, span: written.span() };
        }
        let start = written.span().start;
        let (value, found) =
            parse_expression_at(written, &|span| start + span.start..start + span.end);
        self.diagnostics.extend(found);
        value
    }

    /// A variable that is written.
    fn target(&mut self, written: &Written) -> Option<Path> {
        match self.parsed(written).kind {
            ExpressionKind::Variable(path) => Some(path),
            ExpressionKind::Faulty => None,
            _ => {
                let message = format!("`{written}` is written, and is not a variable");
                self.error("U1010", message, written.span());
                None
            }
        }
    }

    /// The value of a power.
    pub(super) fn value(&mut self, power: &Power, span: &Range<usize>) -> Expression {
        match power {
            Power::Constant(value) => make::boolean(*value, span),
            Power::Read(read) => self.reading(read),
            Power::Not(inner) => make::not(self.value(inner, span)),
            Power::All(parts) => self.all(parts, Operator::And, span),
            Power::Any(parts) => self.all(parts, Operator::Or, span),
            Power::Output(instance, pin) => self.output(instance, pin),
            Power::Kept(object) => match self.kept.get(object) {
                Some(name) => make::variable(name, span),
                None => make::boolean(false, span),
            },
            Power::Function(name, inputs) => {
                let inputs =
                    inputs.iter().map(|(pin, power)| (pin.clone(), self.value(power, span)));
                let inputs = inputs.collect();
                self.function(name, inputs, span)
            }
        }
    }

    fn all(&mut self, parts: &[Power], operator: Operator, span: &Range<usize>) -> Expression {
        let values = parts.iter().map(|part| self.value(part, span)).collect();
        make::chain(values, operator, span)
    }

    fn reading(&mut self, read: &Read) -> Expression {
        match read.edge {
            None => self.parsed(&read.text),
            Some(_) => {
                let span = read.text.span();
                let trigger = self.triggers.get(&read.object).cloned().unwrap_or_default();
                make::read(make::path(&trigger, Some("Q"), &span))
            }
        }
    }

    fn output(&mut self, instance: &Written, pin: &Written) -> Expression {
        let key = (instance.to_uppercase(), pin.to_uppercase());
        if let Some(known) = self.results.get(&key) {
            return known.clone();
        }
        // The result of a function may be called OUT, or as the function, or not at all.
        if let Some(known) = self.results.get(&(key.0, String::new())) {
            return known.clone();
        }
        let mut path = self.instance(instance);
        path.steps.push(understudy_structured_text::syntax::Step::Field(make::name(pin)));
        make::read(path)
    }

    /// The instance of a block, which may be a part of a variable.
    fn instance(&mut self, instance: &Written) -> Path {
        let span = instance.span();
        if let Some(made) = self.instances.get(instance.as_str()) {
            return make::path(made, None, &span);
        }
        match self.parsed(instance).kind {
            ExpressionKind::Variable(path) => path,
            _ => make::path(instance, None, &span),
        }
    }

    fn function(
        &mut self,
        name: &Written,
        inputs: Vec<(Written, Expression)>,
        span: &Range<usize>,
    ) -> Expression {
        let own = unit(self.file, name).is_some();
        let operator = operator(name).filter(|_| !own && inputs.len() > 1);
        if let Some(operator) = operator
            && (inputs.len() == 2 || !matches!(operator, Operator::Compare(_)))
        {
            let values: Vec<Expression> = inputs.iter().map(|(_, value)| value.clone()).collect();
            let chain = make::chain(values, operator, span);
            // A box computes in its type; an operator computes in 32 bits at least.
            if !is_arithmetic(operator) || self.is_wide(&chain) {
                return chain;
            }
        }
        if !own
            && inputs.len() == 1
            && ["MOVE", "ADD", "MUL", "XOR"].iter().any(|word| name.eq_ignore_ascii_case(word))
        {
            return inputs
                .into_iter()
                .next()
                .map_or(make::boolean(false, span), |(_, value)| value);
        }
        make::call(make::name(name), arguments(inputs, own), span)
    }

    fn type_of(&self, value: &Expression) -> understudy_structured_text::syntax::TypeName {
        let values = Values { file: self.file, declarations: self.declarations, made: &self.made };
        values.of(value)
    }

    /// Whether a value is certainly no number of fewer than 32 bits.
    fn is_wide(&self, value: &Expression) -> bool {
        let narrow = ["SINT", "INT", "USINT", "UINT", "BYTE", "WORD"];
        match self.certain_type_of(value).map(|of| of.kind) {
            Some(TypeKind::Named(name)) => {
                !narrow.iter().any(|known| name.is(known)) && name.key() != "BOOL"
            }
            _ => false,
        }
    }

    fn certain_type_of(
        &self,
        value: &Expression,
    ) -> Option<understudy_structured_text::syntax::TypeName> {
        let values = Values { file: self.file, declarations: self.declarations, made: &self.made };
        values.strong(value)
    }

    /// The power behind the sign of a coil or pin, of `of` where that has a name; an edge is that of a trigger of its own.
    fn changed(
        &mut self,
        value: Expression,
        (negated, edge): (bool, Option<Edge>),
        of: Option<&str>,
        span: &Range<usize>,
    ) -> Expression {
        let value = if negated { make::not(value) } else { value };
        let Some(edge) = edge else {
            return value;
        };
        let of = of.map(|of| format!("{of}.power"));
        let trigger = self.trigger(edge, of.as_deref(), span);
        self.call_trigger(&trigger, value, span);
        make::read(make::path(&trigger, Some("Q"), span))
    }

    /// Declares what sees the edges of `of`, under a name that stays where other parts of the network change: `start.rising`.
    fn trigger(&mut self, edge: Edge, of: Option<&str>, span: &Range<usize>) -> String {
        let (kind, direction) = match edge {
            Edge::Rising => ("R_TRIG", "rising"),
            Edge::Falling => ("F_TRIG", "falling"),
        };
        let Some(of) = of else {
            return self.declare("edge", make::named(kind, span));
        };
        let wanted = format!("{of}.{direction}");
        let mut name = wanted.clone();
        let mut count = 2;
        while self.made.iter().any(|made| made.name.is(&name)) {
            name = format!("{wanted}_{count}");
            count += 1;
        }
        self.declare_named(&name, make::named(kind, span));
        name
    }

    fn call_trigger(&mut self, trigger: &str, value: Expression, span: &Range<usize>) {
        let clock = Argument::Given(Name::new("CLK", span.clone()), value);
        let kind = StatementKind::Call(make::path(trigger, None, span), vec![clock]);
        self.push(make::statement(kind, span));
    }

    /// Calls the triggers of the edges that a power reads for the first time.
    fn prepare(&mut self, power: &Power, span: &Range<usize>) {
        let mut edges = Vec::new();
        power.visit(&mut |part| {
            if let Power::Read(read) = part
                && let Some(edge) = read.edge
            {
                edges.push((read, edge));
            }
        });
        for (read, edge) in edges {
            if self.triggers.contains_key(&read.object) {
                continue;
            }
            let trigger = self.trigger(edge, Some(&read.text), span);
            let value = self.parsed(&read.text);
            self.call_trigger(&trigger, value, span);
            self.triggers.insert(read.object, trigger);
        }
    }

    /// The power, once its edges are known.
    fn prepared(&mut self, power: &Power, span: &Range<usize>) -> Expression {
        self.prepare(power, span);
        self.value(power, span)
    }
}

/// Where the variables of a unit are.
fn places(file: &File, declarations: &[Declaration]) -> Places {
    let variables = declarations.iter().chain(&file.globals);
    Places::of_unit(variables.map(|known| Named {
        name: known.name.as_str(),
        address: known.address.as_ref().map(|address| address.as_str()),
        is_in_out: known.class == Class::InOut,
        is_external: known.class == Class::External,
    }))
}

/// Whether a block acts of itself: one that keeps something, or a function that does more than answer.
pub(super) fn is_call(file: &File, name: &str) -> bool {
    if let Some(found) = unit(file, name) {
        let does_more = |found: &Declaration| {
            matches!(found.class, Class::Output | Class::InOut | Class::External)
        };
        return found.kind != UnitKind::Function || found.declarations.iter().any(does_more);
    }
    BlockKind::of_word(name).is_some()
}

/// What a function is given: by the place where the names say no more than that.
fn arguments(inputs: Vec<(Written, Expression)>, own: bool) -> Vec<Argument> {
    let by_place = inputs.iter().enumerate().all(|(at, (pin, _))| {
        let key = pin.to_ascii_uppercase();
        key.is_empty() || key == "IN" && at == 0 || key == format!("IN{}", at + 1)
    });
    let given = |(pin, value): (Written, Expression)| {
        if by_place && !own || pin.is_empty() {
            Argument::Placed(value)
        } else {
            Argument::Given(make::name(&pin), value)
        }
    };
    inputs.into_iter().map(given).collect()
}

fn is_arithmetic(operator: Operator) -> bool {
    use Operator::{Add, Divide, Modulo, Multiply, Subtract};
    matches!(operator, Add | Subtract | Multiply | Divide | Modulo)
}

/// The operator of a box; EXPT is a function.
fn operator(name: &str) -> Option<Operator> {
    let found = Operator::of_word(&name.to_ascii_uppercase());
    found.filter(|operator| *operator != Operator::Power)
}

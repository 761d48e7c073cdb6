//! Sequential function charts as statements, by the rules of IEC 61131-3: which transitions fire is found from the steps as they were; then
//! steps end and begin; then the actions of the steps that are active now are done.
//!
//! ```text
//! fires := step.X AND_THEN condition AND NOT (one of higher priority from the same step)
//! IF fires THEN step.X := FALSE; …            for all transitions
//! IF fires THEN next.X := TRUE; …             for all transitions
//! IF (its associations demand it) THEN action
//! step.last := step.X                          for P, P0 and P1
//! ```

use std::collections::HashMap;

use understudy_text::Diagnostic;
use understudy_typed::Elementary;

use crate::syntax::{
    Association, Chart, Class, Declaration, Expression, Initializer, Name, Operator, Path, Span,
    Statement, Transition, TypeKind, TypeName, Unit, UnitKind,
};

use super::written::{
    all, assign, boolean, call, declare, elementary, invoke, join, not, part, path, since,
    variable, when,
};

/// What demands an action, gathered over all steps.
#[derive(Default)]
struct Deed {
    /// It is done while one of these holds.
    drives: Vec<Expression>,
    /// What sets its memory, and what resets it.
    sets: Vec<Expression>,
    resets: Vec<Expression>,
    /// Memories of SD and SL, which R resets too.
    memories: Vec<String>,
    /// Statements before it.
    before: Vec<Statement>,
    /// Timers of SD and SL, which run on what is stored when all is set and reset.
    timers: Vec<Statement>,
}

struct Writer<'a> {
    chart: &'a Chart,
    declarations: Vec<Declaration>,
    statements: Vec<Statement>,
    /// The variables that say that a step is entered, by its name in capitals.
    entered: HashMap<String, Vec<String>>,
    diagnostics: &'a mut Vec<Diagnostic>,
}

/// The statements of a chart, and the variables that they need.
pub(super) fn statements(
    chart: &Chart,
    unit: &Unit,
    diagnostics: &mut Vec<Diagnostic>,
) -> (Vec<Declaration>, Vec<Statement>) {
    let mut writer = Writer {
        chart,
        declarations: Vec::new(),
        statements: Vec::new(),
        entered: HashMap::new(),
        diagnostics,
    };
    if !matches!(unit.kind, UnitKind::Program | UnitKind::FunctionBlock) {
        let message = "a chart needs a memory, which a function or method does not have";
        writer.error("U1015", message.to_owned(), unit.name.span());
        return (Vec::new(), Vec::new());
    }
    if !chart.steps.iter().any(|step| step.is_initial) {
        let message = format!("the chart of `{}` has no INITIAL_STEP", unit.name);
        writer.error("U1015", message, unit.name.span());
    }
    let taken = chart.steps.iter().filter_map(|step| {
        let mut variables = unit.declarations.iter().map(|declaration| &declaration.name);
        Some((&step.name, variables.find(|variable| **variable == step.name)?))
    });
    let taken: Vec<Diagnostic> = taken
        .map(|(step, variable)| {
            let message = format!("`{step}` is a step and a variable");
            Diagnostic::error("U1042", message, step.span())
                .with_related(variable.span(), "the variable")
                .with_help("rename one of them")
        })
        .collect();
    if !taken.is_empty() {
        writer.diagnostics.extend(taken);
        return (Vec::new(), Vec::new());
    }
    writer.steps(&unit.name.span());
    writer.transitions();
    writer.actions();
    for step in &chart.steps {
        let span = step.name.span();
        let name = step.name.as_str();
        let last = assign(path(name, Some("last"), &span), part(name, "X", &span), &span);
        writer.statements.push(last);
    }
    (writer.declarations, writer.statements)
}

impl Writer<'_> {
    fn error(&mut self, code: &'static str, message: String, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    /// A name for what is hidden: one with a dot is none that a person can write. It names what it belongs to, so that it stays where other parts of
    /// the chart change.
    fn hidden_name(&self, what: &str) -> String {
        let is_free = |name: &String| {
            self.declarations.iter().all(|known| !known.name.as_str().eq_ignore_ascii_case(name))
        };
        let numbered = (2..).map(|number| format!("{what}.{number}"));
        std::iter::once(what.to_owned()).chain(numbered).find(is_free).unwrap_or_default()
    }

    /// A hidden variable.
    fn hidden(&mut self, what: &str, of: Elementary, span: &Span) -> String {
        let name = self.hidden_name(what);
        let declaration = declare(&name, Class::Local, elementary(of, span), None, span);
        self.declarations.push(declaration);
        name
    }

    /// A hidden TON.
    fn timer(&mut self, what: &str, span: &Span) -> String {
        let name = self.hidden_name(&format!("timer.{what}"));
        let of =
            TypeName { kind: TypeKind::Named(Name::new("TON", span.clone())), span: span.clone() };
        self.declarations.push(declare(&name, Class::Local, of, None, span));
        name
    }

    /// A TON that is TRUE when a step has been active for that time. Where a transition enters the step that it leaves, the time begins again.
    fn step_timer(&mut self, step: &str, duration: &Expression, span: &Span) -> String {
        let timer = self.timer(step, span);
        let again = |transition: &&Transition| {
            let has = |names: &[Name]| names.iter().any(|name| name.is(step));
            has(&transition.from) && has(&transition.to)
        };
        if self.chart.transitions.iter().any(|transition| again(&transition)) {
            let begins = self.entered.get(&step.to_ascii_uppercase()).cloned();
            let begins =
                begins.map(|fires| fires.iter().map(|name| variable(name, span)).collect());
            let begins = all(begins.unwrap_or_default(), Operator::Or, span);
            let stop = invoke(&timer, [("IN", boolean(false, span))], span);
            self.statements.push(when(begins, vec![stop], span));
        }
        let given = [("IN", part(step, "X", span)), ("PT", duration.clone())];
        self.statements.push(invoke(&timer, given, span));
        timer
    }

    fn steps(&mut self, span: &Span) {
        let begun = self.hidden("begun.chart", Elementary::Bool, span);
        let mut first = vec![assign(path(&begun, None, span), boolean(true, span), span)];
        let mut seen: HashMap<String, Span> = HashMap::new();
        for step in &self.chart.steps {
            let span = step.name.span();
            let name = step.name.as_str();
            if let Some(before) = seen.insert(step.name.key(), span.clone()) {
                let message = format!("two steps are called `{name}`");
                let found = Diagnostic::error("U1003", message, span);
                self.diagnostics.push(found.with_related(before, "the first"));
                continue;
            }
            let fields = [
                ("X", Elementary::Bool),
                ("T", Elementary::Time),
                ("since", Elementary::Time),
                ("last", Elementary::Bool),
            ];
            let fields = fields.into_iter().map(|(field, of)| {
                declare(field, Class::Local, elementary(of, &span), None, &span)
            });
            let of = TypeName { kind: TypeKind::Structure(fields.collect()), span: span.clone() };
            let initial = step.is_initial.then(|| {
                let value = Initializer::Value(boolean(true, &span));
                Initializer::Structure(vec![(Name::new("X", span.clone()), value)], span.clone())
            });
            self.declarations.push(declare(name, Class::Local, of, initial, &span));
            if step.is_initial {
                let now = call("TIME", Vec::new(), &span);
                first.push(assign(path(name, Some("since"), &span), now, &span));
            }
        }
        let is_first = not(variable(&begun, span));
        self.statements.push(when(is_first, first, span));
        for step in &self.chart.steps {
            let span = step.name.span();
            let name = step.name.as_str();
            let passed = since(part(name, "since", &span), &span);
            let time = assign(path(name, Some("T"), &span), passed, &span);
            let is_active = part(name, "X", &span);
            self.statements.push(when(is_active, vec![time], &span));
        }
    }

    fn transitions(&mut self) {
        let chart = self.chart;
        let mut order: Vec<usize> = (0..chart.transitions.len()).collect();
        order.sort_by_key(|at| chart.transitions[*at].priority.unwrap_or(i64::MAX));
        let known = |name: &Name| chart.steps.iter().any(|step| step.name == *name);
        let mut fired: Vec<(usize, String)> = Vec::new();
        for at in order {
            let transition = &chart.transitions[at];
            let span = &transition.span;
            let named = transition.from.iter().chain(&transition.to);
            for name in named.filter(|name| !known(name)) {
                let steps = chart.steps.iter().map(|step| step.name.as_str());
                let help = understudy_text::spelling::suggestion(name.as_str(), steps);
                let message = format!("the chart has no step `{name}`");
                let found = Diagnostic::error("U1005", message, name.span());
                self.diagnostics.push(found.with_help(help));
            }
            let from: Vec<&Name> = transition.from.iter().filter(|name| known(name)).collect();
            if from.is_empty() {
                continue;
            }
            let steps = from.iter().map(|name| part(name.as_str(), "X", &name.span()));
            let mut rivals = Vec::new();
            for (other, fires) in &fired {
                if chart.transitions[*other].from.iter().any(|name| from.contains(&name)) {
                    rivals.push(not(variable(fires, span)));
                }
            }
            let mut condition = all(steps.chain(rivals).collect(), Operator::And, span);
            // The condition is looked at only where it counts.
            condition = join(condition, Operator::AndThen, transition.condition.clone());
            let names = [&transition.from, &transition.to].map(|names| {
                let names: Vec<&str> = names.iter().map(Name::as_str).collect();
                names.join("+")
            });
            let what = format!("fires.{}", names.join("."));
            let fires = self.hidden(&what, Elementary::Bool, span);
            self.statements.push(assign(path(&fires, None, span), condition, span));
            for name in transition.to.iter().filter(|name| known(name)) {
                self.entered.entry(name.key()).or_default().push(fires.clone());
            }
            fired.push((at, fires));
        }
        for is_end in [true, false] {
            for (at, fires) in &fired {
                let transition = &chart.transitions[*at];
                let steps = if is_end { &transition.from } else { &transition.to };
                let mut body = Vec::new();
                for step in steps.iter().filter(|name| known(name)) {
                    let (name, span) = (step.as_str(), &transition.span);
                    let mut set = |field, value| {
                        body.push(assign(path(name, Some(field), span), value, span));
                    };
                    set("X", boolean(!is_end, span));
                    if !is_end {
                        set("since", call("TIME", Vec::new(), span));
                        let now = call("TIME", Vec::new(), span);
                        set("T", since(now, span));
                        // A step that ends and begins at once begins anew.
                        set("last", boolean(false, span));
                    }
                }
                let condition = variable(fires, &transition.span);
                self.statements.push(when(condition, body, &transition.span));
            }
        }
    }

    /// What several steps demand is done once.
    fn actions(&mut self) {
        let chart = self.chart;
        let mut order: Vec<&Name> = Vec::new();
        let mut deeds: HashMap<String, Deed> = HashMap::new();
        for step in &chart.steps {
            for association in &step.associations {
                let key = association.action.key();
                if !deeds.contains_key(&key) {
                    order.push(&association.action);
                }
                let mut deed = deeds.remove(&key).unwrap_or_default();
                self.demand(step.name.as_str(), association, &mut deed);
                deeds.insert(key, deed);
            }
        }
        for name in order {
            if let Some(deed) = deeds.remove(&name.key()) {
                self.deed(name, deed);
            }
        }
    }

    /// What an association adds to its action.
    fn demand(&mut self, step: &str, association: &Association, deed: &mut Deed) {
        let span = association.action.span();
        let is_active = || part(step, "X", &span);
        let was_active = || part(step, "last", &span);
        let begins = || join(is_active(), Operator::And, not(was_active()));
        let qualifier = association.qualifier.key();
        let duration = match (&association.duration, qualifier.as_str()) {
            (Some(duration), _) => duration.clone(),
            (None, "L" | "D" | "SD" | "DS" | "SL") => {
                let message = format!("the qualifier {qualifier} needs a duration");
                let found = Diagnostic::error("U1015", message, association.qualifier.span());
                let help = format!("write `{}({qualifier}, T#2s)`", association.action);
                self.diagnostics.push(found.with_help(help));
                return;
            }
            _ => boolean(false, &span),
        };
        let is_timed = matches!(qualifier.as_str(), "L" | "D" | "DS");
        let timer = if is_timed { self.step_timer(step, &duration, &span) } else { String::new() };
        let is_over = || part(&timer, "Q", &span);
        match qualifier.as_str() {
            "" | "N" => deed.drives.push(is_active()),
            "S" => deed.sets.push(is_active()),
            "R" => deed.resets.push(is_active()),
            "P" | "P1" => deed.drives.push(begins()),
            "P0" => {
                let ends = join(was_active(), Operator::And, not(is_active()));
                deed.drives.push(ends);
            }
            "L" => deed.drives.push(join(is_active(), Operator::And, not(is_over()))),
            "D" => deed.drives.push(join(is_active(), Operator::And, is_over())),
            "DS" => deed.sets.push(join(is_active(), Operator::And, is_over())),
            "SD" | "SL" => {
                let what = format!("{}.{step}", association.action);
                let stored = self.hidden(&format!("stored.{what}"), Elementary::Bool, &span);
                let timer = self.timer(&what, &span);
                let set = assign(path(&stored, None, &span), boolean(true, &span), &span);
                let is_new = join(begins(), Operator::And, not(variable(&stored, &span)));
                deed.before.push(when(is_new, vec![set], &span));
                let given = [("IN", variable(&stored, &span)), ("PT", duration)];
                deed.timers.push(invoke(&timer, given, &span));
                let passed = part(&timer, "Q", &span);
                let passed = if qualifier == "SD" { passed } else { not(passed) };
                deed.drives.push(join(variable(&stored, &span), Operator::And, passed));
                deed.memories.push(stored);
            }
            _ => {
                let message = format!("`{qualifier}` is not a qualifier of an action");
                let found = Diagnostic::error("U1015", message, association.qualifier.span());
                let help = "use N, R, S, L, D, P, P0, P1, SD, DS or SL";
                self.diagnostics.push(found.with_help(help));
            }
        }
    }

    fn deed(&mut self, name: &Name, mut deed: Deed) {
        let span = name.span();
        let action = self.chart.actions.iter().find(|action| action.name == *name);
        self.statements.append(&mut deed.before);
        let mut memories = std::mem::take(&mut deed.memories);
        if !deed.sets.is_empty() || !deed.resets.is_empty() && memories.is_empty() {
            // A variable that nothing else drives is its own memory.
            let stored = match action {
                None if deed.drives.is_empty() => name.as_str().to_owned(),
                _ => {
                    let stored = self.hidden(&format!("stored.{name}"), Elementary::Bool, &span);
                    deed.drives.push(variable(&stored, &span));
                    stored
                }
            };
            if !deed.sets.is_empty() {
                let sets = all(std::mem::take(&mut deed.sets), Operator::Or, &span);
                let set = assign(path(&stored, None, &span), boolean(true, &span), &span);
                self.statements.push(when(sets, vec![set], &span));
            }
            memories.push(stored);
        }
        if !deed.resets.is_empty() {
            let resets = all(deed.resets, Operator::Or, &span);
            let reset = memories.iter().map(|memory| {
                let to: Path = path(memory, None, &span);
                assign(to, boolean(false, &span), &span)
            });
            let reset = reset.collect();
            self.statements.push(when(resets, reset, &span));
        }
        self.statements.append(&mut deed.timers);
        if deed.drives.is_empty() {
            return;
        }
        let condition = all(deed.drives, Operator::Or, &span);
        self.statements.push(match action {
            Some(action) => when(condition, action.body.clone(), &span),
            None => assign(path(name.as_str(), None, &span), condition, &span),
        });
    }
}

//! Names of lists of global variables in front of these (`GVL.x`), which only TwinCAT and CODESYS know.

use std::collections::HashSet;

use understudy_structured_text::syntax::{
    Argument, Body, Class, Declaration, Expression, ExpressionKind, File, Initializer, Path,
    Statement, StatementKind, Step, TypeKind, TypeName, Unit,
};

/// Leaves out the names of lists, except where a unit has a variable of its own with the name of the global variable.
pub(crate) fn without_lists(file: &mut File) {
    let globals: HashSet<String> = file.globals.iter().map(|global| global.name.key()).collect();
    if globals.is_empty() {
        return;
    }
    let mut declared = globals.clone();
    declared.extend(["THIS", "SUPER"].map(str::to_owned));
    declared.extend(file.types.iter().map(|definition| definition.name.key()));
    declared.extend(file.instances.iter().map(|instance| instance.name.key()));
    for part in file.units.iter().flat_map(parts) {
        declared.insert(part.name.key());
        declared.extend(part.declarations.iter().map(|found| found.name.key()));
        if let Body::Chart(chart) = &part.body {
            declared.extend(chart.steps.iter().map(|step| step.name.key()));
            declared.extend(chart.actions.iter().map(|action| action.name.key()));
        }
    }
    let mut lists = Lists { declared, globals, own: HashSet::new() };
    lists.declarations(&mut file.globals);
    for definition in &mut file.types {
        lists.of_type(&mut definition.of);
        definition.initial.iter_mut().for_each(|initial| lists.initializer(initial));
    }
    for task in &mut file.tasks {
        task.single.iter_mut().for_each(|event| lists.expression(event));
    }
    for instance in &mut file.instances {
        lists.arguments(&mut instance.connections);
    }
    for unit in &mut file.units {
        let own = parts(unit).flat_map(|part| &part.declarations);
        let own = own.filter(|declaration| declaration.class != Class::External);
        lists.own = own.map(|declaration| declaration.name.key()).collect();
        lists.unit(unit);
    }
}

/// A unit and its methods.
fn parts(unit: &Unit) -> impl Iterator<Item = &Unit> {
    std::iter::once(unit).chain(&unit.methods)
}

struct Lists {
    /// All names in front of a dot that are no list.
    declared: HashSet<String>,
    globals: HashSet<String>,
    /// Names of the unit that is looked at.
    own: HashSet<String>,
}

impl Lists {
    fn unit(&self, unit: &mut Unit) {
        self.declarations(&mut unit.declarations);
        match &mut unit.body {
            Body::Statements(statements) => self.statements(statements),
            Body::Chart(chart) => {
                for step in &mut chart.steps {
                    let durations = step.associations.iter_mut();
                    let durations = durations.filter_map(|found| found.duration.as_mut());
                    durations.for_each(|duration| self.expression(duration));
                }
                for transition in &mut chart.transitions {
                    self.expression(&mut transition.condition);
                }
                for action in &mut chart.actions {
                    self.statements(&mut action.body);
                }
            }
            Body::Instructions(lines) => {
                lines.iter_mut().for_each(|line| self.arguments(&mut line.operands));
            }
        }
        unit.methods.iter_mut().for_each(|method| self.unit(method));
    }

    fn declarations(&self, declarations: &mut [Declaration]) {
        for declaration in declarations {
            self.of_type(&mut declaration.of);
            declaration.initial.iter_mut().for_each(|initial| self.initializer(initial));
        }
    }

    fn of_type(&self, of: &mut TypeName) {
        match &mut of.kind {
            TypeKind::Named(_) => {}
            TypeKind::Subrange(_, low, high) => {
                self.expression(low);
                self.expression(high);
            }
            TypeKind::Text { length, .. } => {
                length.iter_mut().for_each(|length| self.expression(length));
            }
            TypeKind::Array(bounds, element) => {
                for (low, high) in bounds {
                    self.expression(low);
                    self.expression(high);
                }
                self.of_type(element);
            }
            TypeKind::OpenArray(_, element) | TypeKind::Pointer(element) => self.of_type(element),
            TypeKind::Structure(fields) => self.declarations(fields),
            TypeKind::Enumeration(values, _) => {
                let values = values.iter_mut().filter_map(|(_, value)| value.as_mut());
                values.for_each(|value| self.expression(value));
            }
        }
    }

    fn initializer(&self, initial: &mut Initializer) {
        match initial {
            Initializer::Value(value) => self.expression(value),
            Initializer::Array(groups, _) => {
                for (count, values) in groups {
                    count.iter_mut().for_each(|count| self.expression(count));
                    values.iter_mut().for_each(|value| self.initializer(value));
                }
            }
            Initializer::Structure(fields, _) => {
                fields.iter_mut().for_each(|(_, value)| self.initializer(value));
            }
        }
    }

    fn statements(&self, statements: &mut [Statement]) {
        for statement in statements {
            match &mut statement.kind {
                StatementKind::Assign(to, value) => {
                    self.path(to);
                    self.expression(value);
                }
                StatementKind::Call(path, arguments) => {
                    self.path(path);
                    self.arguments(arguments);
                }
                StatementKind::If(branches, otherwise) => {
                    for (condition, body) in branches {
                        self.expression(condition);
                        self.statements(body);
                    }
                    self.statements(otherwise);
                }
                StatementKind::Case(selector, cases, otherwise) => {
                    self.expression(selector);
                    for (labels, body) in cases {
                        for label in labels {
                            self.expression(&mut label.first);
                            label.last.iter_mut().for_each(|last| self.expression(last));
                        }
                        self.statements(body);
                    }
                    self.statements(otherwise);
                }
                StatementKind::For(written) => {
                    self.path(&mut written.counter);
                    self.expression(&mut written.from);
                    self.expression(&mut written.to);
                    written.by.iter_mut().for_each(|by| self.expression(by));
                    self.statements(&mut written.body);
                }
                StatementKind::While(condition, body) | StatementKind::Repeat(body, condition) => {
                    self.expression(condition);
                    self.statements(body);
                }
                StatementKind::Exit
                | StatementKind::Continue
                | StatementKind::Return
                | StatementKind::Code(_)
                | StatementKind::Nothing => {}
            }
        }
    }

    fn arguments(&self, arguments: &mut [Argument]) {
        for argument in arguments {
            match argument {
                Argument::Placed(value) | Argument::Given(_, value) => self.expression(value),
                Argument::Taken { to, .. } => self.path(to),
            }
        }
    }

    fn path(&self, path: &mut Path) {
        if let Some(Step::Field(name)) = path.steps.first()
            && !self.declared.contains(&path.root.key())
            && self.globals.contains(&name.key())
            && !self.own.contains(&name.key())
        {
            path.root = name.clone();
            path.steps.remove(0);
        }
        for step in &mut path.steps {
            if let Step::Index(indices) = step {
                indices.iter_mut().for_each(|index| self.expression(index));
            }
        }
    }

    fn expression(&self, expression: &mut Expression) {
        match &mut expression.kind {
            ExpressionKind::Variable(path) => self.path(path),
            ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => self.expression(inner),
            ExpressionKind::Chain(first, rest) => {
                self.expression(first);
                rest.iter_mut().for_each(|(_, value)| self.expression(value));
            }
            ExpressionKind::Call(path, arguments) => {
                self.path(path);
                self.arguments(arguments);
            }
            ExpressionKind::Literal(_) | ExpressionKind::Qualified(..) | ExpressionKind::Faulty => {
            }
        }
    }
}

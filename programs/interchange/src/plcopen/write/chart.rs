//! A chart as a body in SFC, placed as it is drawn, with its actions and the conditions that are more than an expression.
//!
//! Steps and transitions are written in the order of the syntax, on which the order of actions depends; where transitions compete, each has the
//! priority that it has there.

use understudy_diagram::Place;
use understudy_diagram::blocks::{Kind, Network};
use understudy_diagram::chart::{Chart, ChartObject, ChartPlan, Part, lay_out};
use understudy_structured_text::print;
use understudy_structured_text::syntax::{
    self, Action, Association, Body, Expression, ExpressionKind, File, Statement, StatementKind,
    Unit,
};

use super::blocks;
use super::sheet::position;
use super::tree::Tree;
use crate::diagrams::{Style, Widths, chart as drawn, networks};

/// Height of the row of an action.
const ACTION: i64 = 22;

/// Writes the actions and the transitions of a unit, which stand before its body.
///
/// # Errors
/// What is not written, in words.
pub(super) fn parts(
    tree: &mut Tree,
    file: &File,
    unit: &Unit,
    of: &syntax::Chart,
) -> Result<(), String> {
    if !of.actions.is_empty() {
        tree.open("actions", &[]);
        for action in &of.actions {
            tree.open("action", &[("name", action.name.as_str())]);
            tree.open("body", &[]);
            deed(tree, unit, action);
            tree.close("body");
            tree.close("action");
        }
        tree.close("actions");
    }
    let conditions: Vec<&Unit> = of
        .transitions
        .iter()
        .filter_map(|transition| method(unit, &transition.condition))
        .map(|(method, _)| method)
        .collect();
    if !conditions.is_empty() {
        tree.open("transitions", &[]);
        for method in conditions {
            tree.open("transition", &[("name", method.name.as_str())]);
            tree.open("body", &[]);
            condition(tree, file, unit, method)?;
            tree.close("body");
            tree.close("transition");
        }
        tree.close("transitions");
    }
    Ok(())
}

/// The body of an action: a list that is called, or statements.
fn deed(tree: &mut Tree, unit: &Unit, action: &Action) {
    let called = match action.body.as_slice() {
        [Statement { kind: StatementKind::Call(path, arguments), .. }]
            if arguments.is_empty() && path.steps.is_empty() =>
        {
            unit.methods.iter().find(|method| method.name == path.root)
        }
        _ => None,
    };
    match called.map(|method| &method.body) {
        Some(Body::Instructions(list)) => {
            tree.formatted("IL", print::instructions(list).trim_end())
        }
        _ => tree.formatted("ST", print::statements(&action.body).trim_end()),
    }
}

/// The method that a condition is, and whether it is the opposite of it.
fn method<'u>(unit: &'u Unit, condition: &Expression) -> Option<(&'u Unit, bool)> {
    match &condition.kind {
        ExpressionKind::Not(inner) => {
            method(unit, inner).map(|(method, negated)| (method, !negated))
        }
        ExpressionKind::Call(path, arguments) if arguments.is_empty() && path.steps.is_empty() => {
            let found = unit.methods.iter().find(|method| method.name == path.root);
            found.map(|method| (method, false))
        }
        _ => None,
    }
}

/// A condition that is a list or a network. A network writes the variable that is called as the transition.
fn condition(tree: &mut Tree, file: &File, unit: &Unit, method: &Unit) -> Result<(), String> {
    let statements = match &method.body {
        Body::Instructions(list) => {
            tree.formatted("IL", print::instructions(list).trim_end());
            return Ok(());
        }
        Body::Statements(statements) => statements,
        Body::Chart(_) => return Err("a chart in a condition".to_owned()),
    };
    let answer = statements.split_last().and_then(|(last, before)| match &last.kind {
        StatementKind::Assign(to, value) if to.root == method.name => Some((before, value)),
        _ => None,
    });
    let (before, value) = match answer {
        Some((before, value)) => (before, print::expression(value)),
        None => (statements.as_slice(), "FALSE".to_owned()),
    };
    let name = method.name.as_str();
    let mut made = networks(file, unit, before, Style::Blocks, Widths::Exact)
        .map_err(|reason| format!("a condition that is a network with {reason}"))?;
    let mut is_written = false;
    for object in made.iter_mut().flat_map(|network| &mut network.objects) {
        if let Kind::Target(text) = &mut object.kind
            && *text == value
        {
            name.clone_into(text);
            is_written = true;
        }
    }
    if !is_written {
        let mut network = Network::default();
        let from = network.value(value);
        network.target(name, (from, 0));
        made.push(network);
    }
    blocks::write(tree, file, &made, Style::Blocks);
    Ok(())
}

/// Writes the body.
///
/// # Errors
/// What is not written, in words.
pub(super) fn body(tree: &mut Tree, unit: &Unit, of: &syntax::Chart) -> Result<(), String> {
    let (chart, order) = drawn(of)?;
    let plan = lay_out(&chart, 20);
    let mut sheet =
        Sheet { tree, unit, of, chart: &chart, plan: &plan, next: plan.objects.len() + 1 };
    let competes = |step: usize| {
        let transitions = chart.transitions.iter();
        transitions.filter(|it| it.from.contains(&step)).count() > 1
    };
    let has_priorities = (0..chart.steps.len()).any(competes);
    sheet.tree.open("SFC", &[]);
    for step in 0..chart.steps.len() {
        sheet.each(|part| part == Part::Step(step), Sheet::step)?;
        sheet.each(|part| part == Part::Actions(step), Sheet::actions)?;
    }
    for at in 0..of.transitions.len() {
        let place = order.iter().position(|other| *other == at).unwrap_or(at);
        let priority = has_priorities.then_some(place + 1);
        sheet.each(
            |part| part == Part::Transition(place),
            |sheet, id, object| sheet.transition(id, object, &of.transitions[at], priority),
        )?;
    }
    let is_other = |part| !matches!(part, Part::Step(_) | Part::Actions(_) | Part::Transition(_));
    sheet.each(is_other, Sheet::other)?;
    sheet.tree.close("SFC");
    Ok(())
}

struct Sheet<'a> {
    tree: &'a mut Tree,
    unit: &'a Unit,
    of: &'a syntax::Chart,
    chart: &'a Chart,
    plan: &'a ChartPlan,
    /// The localId of the next action.
    next: usize,
}

impl Sheet<'_> {
    /// Writes the objects of some kind.
    fn each(
        &mut self,
        is: impl Fn(Part) -> bool,
        write: impl Fn(&mut Self, &str, &ChartObject) -> Result<(), String>,
    ) -> Result<(), String> {
        let objects = self.plan.objects.iter().enumerate();
        for (place, object) in objects.filter(|(_, object)| is(object.part)) {
            write(self, &(place + 1).to_string(), object)?;
        }
        Ok(())
    }

    fn open(&mut self, name: &str, id: &str, place: Place, more: &[(&str, &str)]) {
        let (width, height) = (place.width.to_string(), place.height.max(1).to_string());
        let mut attributes = vec![("localId", id), ("width", &width), ("height", &height)];
        attributes.extend(more);
        self.tree.open(name, &attributes);
        position(self.tree, "position", place.x, place.y);
    }

    /// An input for each line into an object, or one for all of them.
    fn inputs(&mut self, object: &ChartObject) {
        let is_convergence =
            matches!(object.part, Part::SelectionConvergence | Part::SimultaneousConvergence);
        if object.inputs.is_empty() {
            return;
        }
        let each = if is_convergence { 1 } else { object.inputs.len() };
        for links in object.inputs.chunks(each) {
            self.tree.open("connectionPointIn", &[]);
            if let Some(end) = links.first().and_then(|link| link.points.last()) {
                let (x, y) = (end.x - object.place.x, end.y - object.place.y);
                position(self.tree, "relPosition", x, y);
            }
            for link in links {
                let id = (link.from + 1).to_string();
                self.tree.open("connection", &[("refLocalId", &id)]);
                for point in link.points.iter().rev() {
                    position(self.tree, "position", point.x, point.y);
                }
                self.tree.close("connection");
            }
            self.tree.close("connectionPointIn");
        }
    }

    /// The lines out of an object, at its lower edge. Steps and divergences name each.
    fn outputs(&mut self, object: &ChartObject, name: Option<&str>) {
        let own = object as *const ChartObject;
        let place = self.plan.objects.iter().position(|other| std::ptr::eq(other, own));
        for output in 0..object.outputs {
            let links = self.plan.objects.iter().flat_map(|other| &other.inputs);
            let mut links = links.filter(|link| Some(link.from) == place && link.output == output);
            let begin = links.next().and_then(|link| link.points.first());
            let x = begin.map_or(object.place.width / 2, |begin| begin.x - object.place.x);
            let attributes: Vec<_> =
                name.map(|name| ("formalParameter", name)).into_iter().collect();
            self.tree.open("connectionPointOut", &attributes);
            position(self.tree, "relPosition", x, object.place.height);
            self.tree.close("connectionPointOut");
        }
    }

    fn step(&mut self, id: &str, object: &ChartObject) -> Result<(), String> {
        let Part::Step(step) = object.part else {
            return Ok(());
        };
        let step = &self.chart.steps[step];
        let initial = if step.is_initial { "true" } else { "false" };
        let more = [("name", step.name.as_str()), ("initialStep", initial)];
        self.open("step", id, object.place, &more);
        self.inputs(object);
        self.outputs(object, Some("sfc"));
        if !step.actions.is_empty() {
            let attributes = [("formalParameter", "sfc")];
            self.tree.open("connectionPointOutAction", &attributes);
            let (x, y) = (object.place.width, object.place.height / 2);
            position(self.tree, "relPosition", x, y);
            self.tree.close("connectionPointOutAction");
        }
        self.tree.close("step");
        Ok(())
    }

    fn actions(&mut self, id: &str, object: &ChartObject) -> Result<(), String> {
        let Part::Actions(step) = object.part else {
            return Ok(());
        };
        let of = self.of;
        self.open("actionBlock", id, object.place, &[("negated", "false")]);
        self.inputs(object);
        for (association, row) in of.steps[step].associations.iter().zip(0..) {
            self.association(association, row * ACTION)?;
        }
        self.tree.close("actionBlock");
        Ok(())
    }

    fn association(&mut self, association: &Association, y: i64) -> Result<(), String> {
        if !association.indicators.is_empty() {
            return Err(format!("an indicator variable at the action `{}`", association.action));
        }
        let id = self.next.to_string();
        self.next += 1;
        let qualifier = association.qualifier.key();
        let qualifier = if qualifier.is_empty() { "N" } else { &qualifier };
        let duration = association.duration.as_ref().map(print::expression);
        let mut attributes = vec![("localId", id.as_str()), ("qualifier", qualifier)];
        attributes.extend(duration.as_deref().map(|duration| ("duration", duration)));
        self.tree.open("action", &attributes);
        position(self.tree, "relPosition", 0, y);
        let name = association.action.as_str();
        self.tree.empty("reference", &[("name", name)]);
        self.tree.close("action");
        Ok(())
    }

    fn transition(
        &mut self,
        id: &str,
        object: &ChartObject,
        of: &syntax::Transition,
        priority: Option<usize>,
    ) -> Result<(), String> {
        let priority = priority.map(|priority| priority.to_string());
        let more: Vec<_> = priority.as_deref().map(|it| ("priority", it)).into_iter().collect();
        self.open("transition", id, object.place, &more);
        self.inputs(object);
        self.outputs(object, None);
        match method(self.unit, &of.condition) {
            Some((method, negated)) => {
                let attributes: Vec<_> =
                    negated.then_some(("negated", "true")).into_iter().collect();
                self.tree.open("condition", &attributes);
                self.tree.empty("reference", &[("name", method.name.as_str())]);
            }
            None => {
                self.tree.open("condition", &[]);
                let name = of.name.as_ref().map_or("", |name| name.as_str());
                self.tree.open("inline", &[("name", name)]);
                self.tree.formatted("ST", &print::expression(&of.condition));
                self.tree.close("inline");
            }
        }
        self.tree.close("condition");
        self.tree.close("transition");
        Ok(())
    }

    fn other(&mut self, id: &str, object: &ChartObject) -> Result<(), String> {
        let (name, formal) = match object.part {
            Part::Jump(step) => {
                let target = [("targetName", self.chart.steps[step].name.as_str())];
                self.open("jumpStep", id, object.place, &target);
                self.inputs(object);
                self.tree.close("jumpStep");
                return Ok(());
            }
            Part::SelectionDivergence => ("selectionDivergence", Some("sfc")),
            Part::SelectionConvergence => ("selectionConvergence", None),
            Part::SimultaneousDivergence => ("simultaneousDivergence", Some("sfc")),
            _ => ("simultaneousConvergence", None),
        };
        self.open(name, id, object.place, &[]);
        self.inputs(object);
        self.outputs(object, formal);
        self.tree.close(name);
        Ok(())
    }
}

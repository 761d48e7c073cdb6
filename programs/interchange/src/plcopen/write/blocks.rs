//! Networks of function blocks as a body in FBD, and those of a ladder as one in LD, placed as they are drawn.
//!
//! In FBD blocks, functions and variables have an `executionOrderId`, so every tool executes the body in the order of its statements. In LD
//! nothing has one: OpenPLC and Beremiz know none of a coil, and execute what has one before all that has none. There the order is by y.

use understudy_diagram::blocks::{
    BRANCH, BlockPlan, CONTACT_HEAD, CONTACT_ROW, Coil, Contacts, Input, Kind, Network, lay_out,
};
use understudy_diagram::{Place, Point};
use understudy_structured_text::syntax::{Class, File};

use super::sheet::position;
use super::tree::Tree;
use crate::diagrams::Style;
use crate::plcopen::typed::values::unit;

/// Between two networks.
const GAP: i64 = 20;
/// The left edge of the rail.
const RAIL: i64 = 10;
const CONTACT_WIDTH: i64 = 21;
const CONTACT_HEIGHT: i64 = 20;
const COIL_WIDTH: i64 = 21;

/// A wire, with its corners as far as they are known.
type Bent = (End, Vec<Point>);

/// Writes networks below each other as a body.
pub(super) fn write(tree: &mut Tree, file: &File, networks: &[Network], style: Style) {
    let mut top = GAP;
    let mut plans = Vec::new();
    for network in networks {
        let plan = lay_out(network, top);
        top = plan.bottom + GAP;
        plans.push(plan);
    }
    let body = match style {
        Style::Blocks => "FBD",
        Style::Ladder => "LD",
    };
    tree.open(body, &[]);
    let order = (style == Style::Blocks).then_some(0);
    let mut sheet =
        Sheet { tree, file, next: 1, order, rail: None, ends: Vec::new(), coils: Vec::new() };
    if style == Style::Ladder {
        sheet.left_rail(top);
    }
    for (network, plan) in networks.iter().zip(&plans) {
        sheet.network(network, plan);
    }
    if style == Style::Ladder {
        let right = plans.iter().map(|plan| plan.right).max();
        sheet.right_rail(right.unwrap_or(GAP) + GAP, top);
    }
    tree.close(body);
}

/// Where a wire comes from.
#[derive(Debug, Clone)]
struct End {
    /// localId of the object.
    id: usize,
    /// The output of a block.
    pin: Option<String>,
    at: Point,
}

struct Sheet<'a> {
    tree: &'a mut Tree,
    file: &'a File,
    /// The next localId.
    next: usize,
    /// The last `executionOrderId`; nothing in a ladder.
    order: Option<usize>,
    /// The rail on the left.
    rail: Option<usize>,
    /// Of each object of this network and each of its outputs.
    ends: Vec<Vec<Vec<End>>>,
    /// What leads to the rail on the right.
    coils: Vec<End>,
}

impl Sheet<'_> {
    fn network(&mut self, network: &Network, plan: &BlockPlan) {
        if !network.comments.is_empty() {
            let id = self.id();
            self.open("comment", id, plan.comments, &[]);
            let text = network.comments.join("\n");
            self.tree.formatted("content", &text);
            self.tree.close("comment");
        }
        self.ends.clear();
        for at in 0..network.objects.len() {
            let ends = self.object(network, plan, at);
            self.ends.push(ends);
        }
    }

    fn id(&mut self) -> usize {
        self.next += 1;
        self.next - 1
    }

    fn open(&mut self, name: &str, id: usize, place: Place, more: &[(&str, &str)]) {
        let (width, height) = (place.width.to_string(), place.height.max(1).to_string());
        let id = id.to_string();
        let mut attributes = vec![("localId", id.as_str())];
        attributes.extend([("width", width.as_str()), ("height", height.as_str())]);
        attributes.extend(more);
        self.tree.open(name, &attributes);
        position(self.tree, "position", place.x, place.y);
    }

    fn left_rail(&mut self, bottom: i64) {
        let id = self.id();
        let place = Place { x: RAIL, y: 0, width: 2, height: bottom };
        self.rail = Some(id);
        self.open("leftPowerRail", id, place, &[]);
        self.tree.open("connectionPointOut", &[("formalParameter", "")]);
        position(self.tree, "relPosition", place.width, GAP);
        self.tree.close("connectionPointOut");
        self.tree.close("leftPowerRail");
    }

    fn right_rail(&mut self, x: i64, bottom: i64) {
        let id = self.id();
        let place = Place { x, y: 0, width: 2, height: bottom };
        self.open("rightPowerRail", id, place, &[]);
        for coil in std::mem::take(&mut self.coils) {
            let to = Point { x, y: coil.at.y };
            self.connection_in(to, place, &[(coil, Vec::new())]);
        }
        self.tree.close("rightPowerRail");
    }

    /// Writes an object; where the wires of its outputs come from.
    fn object(&mut self, network: &Network, plan: &BlockPlan, at: usize) -> Vec<Vec<End>> {
        let object = &network.objects[at];
        let placed = &plan.objects[at];
        let place = placed.place;
        if let Kind::Contacts(contacts) = &object.kind {
            let from = Point { x: place.x, y: place.y + CONTACT_HEAD };
            let inputs = (0..object.inputs.len()).map(|input| self.wires(plan, (at, input)));
            let inputs: Vec<Vec<_>> = inputs.collect();
            let rail =
                self.rail.map(|id| End { id, pin: None, at: Point { x: RAIL + 2, y: from.y } });
            let before: Vec<_> = rail.into_iter().map(|end| (end, Vec::new())).collect();
            let ends = self.contacts(contacts, from, before, &inputs);
            return vec![ends.into_iter().map(|(end, _)| end).collect()];
        }
        let id = self.id();
        match &object.kind {
            Kind::Contacts(_) => {}
            Kind::Value(text) => {
                self.open("inVariable", id, place, &[("negated", "false")]);
                self.out(place, placed.outputs[0]);
                self.tree.text("expression", text);
                self.tree.close("inVariable");
            }
            Kind::Target(text) => {
                let order = self.turn();
                let mut more = vec![("negated", "false")];
                more.extend(in_order(order.as_deref()));
                self.open("outVariable", id, place, &more);
                self.input(plan, (at, 0));
                self.tree.text("expression", text);
                self.tree.close("outVariable");
            }
            Kind::Coil(text, kind) => {
                let order = self.turn();
                let negated = (*kind == Coil::Negated).to_string();
                let mut more = vec![("negated", negated.as_str())];
                more.extend(in_order(order.as_deref()));
                more.extend(match kind {
                    Coil::Plain | Coil::Negated => None,
                    Coil::Set => Some(("storage", "set")),
                    Coil::Reset => Some(("storage", "reset")),
                });
                let sign = Place { width: COIL_WIDTH, ..place };
                self.open("coil", id, sign, &more);
                self.input(plan, (at, 0));
                self.out(sign, placed.inputs[0]);
                self.tree.text("variable", text);
                self.tree.close("coil");
                let at = Point { x: sign.right(), y: place.y + placed.inputs[0] };
                self.coils.push(End { id, pin: None, at });
            }
            Kind::Block { of, instance } => {
                // Functions too: elsewhere what has no turn comes after all that has one.
                let order = self.turn();
                let mut more = vec![("typeName", of.as_str())];
                more.extend(instance.as_deref().map(|name| ("instanceName", name)));
                more.extend(in_order(order.as_deref()));
                self.open("block", id, place, &more);
                self.pins(network, plan, at, of);
                self.tree.close("block");
            }
        }
        let is_block = matches!(object.kind, Kind::Block { .. });
        let outputs = object.outputs.iter().zip(&placed.outputs);
        let end = |name: &str, row: i64| End {
            id,
            pin: is_block.then(|| name.to_owned()),
            at: Point { x: place.right(), y: place.y + row },
        };
        outputs.map(|(output, row)| vec![end(&output.name, *row)]).collect()
    }

    /// Writes contacts behind wires; the wires behind them.
    fn contacts(
        &mut self,
        contacts: &Contacts,
        from: Point,
        before: Vec<Bent>,
        inputs: &[Vec<Bent>],
    ) -> Vec<Bent> {
        match contacts {
            Contacts::Power(input) => inputs.get(*input).cloned().unwrap_or_default(),
            Contacts::Contact { name, negated, .. } => {
                let id = self.id();
                let place = Place {
                    x: from.x + (contacts.width() - CONTACT_WIDTH) / 2,
                    y: from.y - CONTACT_HEIGHT / 2,
                    width: CONTACT_WIDTH,
                    height: CONTACT_HEIGHT,
                };
                let negated = negated.to_string();
                self.open("contact", id, place, &[("negated", &negated)]);
                let to = Point { x: place.x, y: from.y };
                self.connection_in(to, place, &before);
                self.out(place, CONTACT_HEIGHT / 2);
                self.tree.text("variable", name);
                self.tree.close("contact");
                let at = Point { x: place.right(), y: from.y };
                vec![(End { id, pin: None, at }, Vec::new())]
            }
            Contacts::Series(all) => {
                let mut at = (from.x, before);
                for contacts in all {
                    let behind = self.contacts(contacts, Point { x: at.0, ..from }, at.1, inputs);
                    at = (at.0 + contacts.width(), behind);
                }
                at.1
            }
            Contacts::Parallel(all) => {
                let x = from.x + BRANCH;
                let mut y = from.y;
                let mut behind = Vec::new();
                for branch in all {
                    let begin = Point { x, y };
                    behind.extend(self.contacts(branch, begin, before.clone(), inputs));
                    y += branch.rows() * CONTACT_ROW;
                }
                behind
            }
        }
    }

    /// The next place in the order, where the body has one.
    fn turn(&mut self) -> Option<String> {
        self.order.as_mut().map(|order| {
            *order += 1;
            order.to_string()
        })
    }

    /// The inputs and outputs of a block. What is both is written once.
    fn pins(&mut self, network: &Network, plan: &BlockPlan, at: usize, of: &str) {
        let object = &network.objects[at];
        let placed = &plan.objects[at];
        let called = unit(self.file, of);
        let is_both = |name: &str| {
            let mut declarations = called.iter().flat_map(|unit| &unit.declarations);
            declarations.any(|it| it.class == Class::InOut && it.name.is(name))
        };
        for (list, both) in [("inputVariables", false), ("inOutVariables", true)] {
            self.tree.open(list, &[]);
            for (place, Input { name, negated, .. }) in object.inputs.iter().enumerate() {
                if is_both(name) != both {
                    continue;
                }
                let mut attributes = vec![("formalParameter", name.as_str())];
                attributes.extend(negated.then_some(("negated", "true")));
                self.tree.open("variable", &attributes);
                self.input(plan, (at, place));
                if both {
                    self.out(placed.place, placed.inputs[place]);
                }
                self.tree.close("variable");
            }
            self.tree.close(list);
        }
        self.tree.open("outputVariables", &[]);
        for (output, row) in object.outputs.iter().zip(&placed.outputs) {
            if !is_both(&output.name) {
                let attributes = [("formalParameter", output.name.as_str())];
                self.tree.open("variable", &attributes);
                self.out(placed.place, *row);
                self.tree.close("variable");
            }
        }
        self.tree.close("outputVariables");
    }

    /// The wires into an input, each with its corners.
    fn wires(&self, plan: &BlockPlan, to: (usize, usize)) -> Vec<Bent> {
        let wires = plan.wires.iter().filter(|wire| wire.to == to);
        let ends = wires.flat_map(|wire| {
            let (object, output) = wire.from;
            let ends = self.ends[object][output].iter();
            ends.map(|end| (end.clone(), wire.points.clone()))
        });
        ends.collect()
    }

    fn input(&mut self, plan: &BlockPlan, to: (usize, usize)) {
        let placed = &plan.objects[to.0];
        let at = Point { x: placed.place.x, y: placed.place.y + placed.inputs[to.1] };
        let wires = self.wires(plan, to);
        self.connection_in(at, placed.place, &wires);
    }

    /// An input with its wires, each of which is written from its end to its beginning.
    fn connection_in(&mut self, to: Point, place: Place, wires: &[Bent]) {
        self.tree.open("connectionPointIn", &[]);
        position(self.tree, "relPosition", to.x - place.x, to.y - place.y);
        for (end, corners) in wires {
            let mut from = end.at;
            if self.rail == Some(end.id) {
                from.y = to.y;
            }
            let id = end.id.to_string();
            let mut attributes = vec![("refLocalId", id.as_str())];
            attributes.extend(end.pin.as_deref().map(|pin| ("formalParameter", pin)));
            self.tree.open("connection", &attributes);
            for point in bends(from, corners, to) {
                position(self.tree, "position", point.x, point.y);
            }
            self.tree.close("connection");
        }
        self.tree.close("connectionPointIn");
    }

    fn out(&mut self, place: Place, row: i64) {
        self.tree.open("connectionPointOut", &[]);
        position(self.tree, "relPosition", place.width, row);
        self.tree.close("connectionPointOut");
    }
}

fn in_order(order: Option<&str>) -> Option<(&str, &str)> {
    order.map(|order| ("executionOrderId", order))
}

/// The corners of a wire from its end `to` back to its beginning.
fn bends(from: Point, corners: &[Point], to: Point) -> Vec<Point> {
    let mut points = vec![to];
    points.extend(corners.iter().rev());
    if let Some(last) = points.last().copied()
        && last.y != from.y
    {
        let x = last.x.max(from.x + BRANCH) - BRANCH / 2;
        points.push(Point { x, y: last.y });
        points.push(Point { x, y: from.y });
    }
    points.push(from);
    points.dedup();
    points
}

//! Networks of function blocks as a body in FBD, placed as they are drawn.
//!
//! Blocks and variables have an `executionOrderId`, so every tool executes the body in the order of its statements.

use understudy_diagram::Place;
use understudy_diagram::blocks::{BlockPlan, Input, Kind, Network, lay_out};
use understudy_structured_text::syntax::{Class, File};

use super::sheet::position;
use super::tree::Tree;
use crate::plcopen::typed::is_call;
use crate::plcopen::typed::values::unit;

/// Between two networks.
const GAP: i64 = 20;

/// Writes the objects of networks below each other.
pub(super) fn write(tree: &mut Tree, file: &File, networks: &[Network]) {
    let mut sheet = Sheet {
        tree,
        file,
        first: 1,
        order: 0,
    };
    let mut top = GAP;
    for network in networks {
        let plan = lay_out(network, top);
        sheet.network(network, &plan);
        top = plan.bottom + GAP;
    }
}

struct Sheet<'a> {
    tree: &'a mut Tree,
    file: &'a File,
    /// The localId of the first object of a network.
    first: usize,
    order: usize,
}

impl Sheet<'_> {
    fn network(&mut self, network: &Network, plan: &BlockPlan) {
        let count = network.objects.len();
        if !network.comments.is_empty() {
            let id = (self.first + count).to_string();
            self.open("comment", &id, plan.comments, &[]);
            let text = network.comments.join("\n");
            self.tree.formatted("content", &text);
            self.tree.close("comment");
        }
        for at in 0..count {
            self.object(network, plan, at);
        }
        self.first += count + 1;
    }

    fn open(&mut self, name: &str, id: &str, place: Place, more: &[(&str, &str)]) {
        let (width, height) = (place.width.to_string(), place.height.max(1).to_string());
        let mut attributes = vec![("localId", id), ("width", &width), ("height", &height)];
        attributes.extend(more);
        self.tree.open(name, &attributes);
        position(self.tree, "position", place.x, place.y);
    }

    fn object(&mut self, network: &Network, plan: &BlockPlan, at: usize) {
        let object = &network.objects[at];
        let placed = &plan.objects[at];
        let id = (self.first + at).to_string();
        match &object.kind {
            Kind::Value(text) => {
                self.open("inVariable", &id, placed.place, &[("negated", "false")]);
                self.out(placed.place, placed.outputs[0]);
                self.tree.text("expression", text);
                self.tree.close("inVariable");
            }
            Kind::Target(text) => {
                let order = self.turn();
                let more = [("executionOrderId", order.as_str()), ("negated", "false")];
                self.open("outVariable", &id, placed.place, &more);
                self.input(network, plan, (at, 0));
                self.tree.text("expression", text);
                self.tree.close("outVariable");
            }
            Kind::Block { of, instance } => {
                let acts = instance.is_some() || is_call(self.file, of);
                let order = acts.then(|| self.turn());
                let mut more = vec![("typeName", of.as_str())];
                more.extend(instance.as_deref().map(|name| ("instanceName", name)));
                more.extend(order.as_deref().map(|order| ("executionOrderId", order)));
                self.open("block", &id, placed.place, &more);
                self.pins(network, plan, at, of);
                self.tree.close("block");
            }
        }
    }

    fn turn(&mut self) -> String {
        self.order += 1;
        self.order.to_string()
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
                self.input(network, plan, (at, place));
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

    /// An input with its wire, which is written from its end to its beginning.
    fn input(&mut self, network: &Network, plan: &BlockPlan, to: (usize, usize)) {
        let row = plan.objects[to.0].inputs[to.1];
        self.tree.open("connectionPointIn", &[]);
        position(self.tree, "relPosition", 0, row);
        for wire in plan.wires.iter().filter(|wire| wire.to == to) {
            let id = (self.first + wire.from.0).to_string();
            let source = &network.objects[wire.from.0];
            let mut attributes = vec![("refLocalId", id.as_str())];
            if matches!(source.kind, Kind::Block { .. }) {
                let pin = source.outputs[wire.from.1].name.as_str();
                attributes.push(("formalParameter", pin));
            }
            self.tree.open("connection", &attributes);
            for point in wire.points.iter().rev() {
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

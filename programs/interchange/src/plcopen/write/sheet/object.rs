//! One object of a sheet, as elements of the file.

use understudy_ladder::{CoilKind, ContactKind};

use super::super::tree::Tree;
use super::place::{Place, position};

/// Between the upper edge of a row and its wire.
pub(super) const WIRE: i64 = 10;

/// An object with its place and what feeds it.
pub(super) struct Object {
    pub(super) place: Place,
    pub(super) what: What,
}

pub(super) enum What {
    LeftRail,
    RightRail(Vec<Source>),
    Contact(ContactKind, String, Vec<Source>),
    Coil(CoilKind, String, Vec<Source>),
    /// Type, instance, inputs and outputs.
    Block(&'static str, Option<String>, Vec<(&'static str, Vec<Source>)>, Vec<&'static str>),
    InVariable(String),
    Comment(String),
}

/// An output of an object, by the object's number, and where it is.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) id: usize,
    pub(super) pin: Option<&'static str>,
    pub(super) x: i64,
    pub(super) y: i64,
}

impl Object {
    pub(super) fn write(&self, number: usize, tree: &mut Tree) {
        let id = number.to_string();
        let width = self.place.width.to_string();
        let height = self.place.height.to_string();
        let common =
            [("localId", id.as_str()), ("height", height.as_str()), ("width", width.as_str())];
        match &self.what {
            What::LeftRail => {
                tree.open("leftPowerRail", &common);
                position(tree, "position", self.place.x, self.place.y);
                tree.open("connectionPointOut", &[("formalParameter", "")]);
                position(tree, "relPosition", self.place.width, WIRE);
                tree.close("connectionPointOut");
                tree.close("leftPowerRail");
            }
            What::RightRail(ends) => {
                tree.open("rightPowerRail", &common);
                position(tree, "position", self.place.x, self.place.y);
                for end in ends {
                    self.place.input(tree, end.y - self.place.y, std::slice::from_ref(end));
                }
                tree.close("rightPowerRail");
            }
            What::Contact(kind, variable, sources) => {
                let (negated, edge) = match kind {
                    ContactKind::NormallyOpen => ("false", None),
                    ContactKind::NormallyClosed => ("true", None),
                    ContactKind::Rising => ("false", Some(("edge", "rising"))),
                    ContactKind::Falling => ("false", Some(("edge", "falling"))),
                };
                self.element(tree, "contact", &common, negated, edge, sources, variable);
            }
            What::Coil(kind, variable, sources) => {
                let (negated, more) = match kind {
                    CoilKind::Plain => ("false", None),
                    CoilKind::Negated => ("true", None),
                    CoilKind::Set => ("false", Some(("storage", "set"))),
                    CoilKind::Reset => ("false", Some(("storage", "reset"))),
                    CoilKind::Rising => ("false", Some(("edge", "rising"))),
                    CoilKind::Falling => ("false", Some(("edge", "falling"))),
                };
                self.element(tree, "coil", &common, negated, more, sources, variable);
            }
            What::Block(word, instance, inputs, outputs) => {
                let mut attributes = common.to_vec();
                attributes.push(("typeName", word));
                if let Some(instance) = instance {
                    attributes.push(("instanceName", instance));
                }
                tree.open("block", &attributes);
                position(tree, "position", self.place.x, self.place.y);
                tree.open("inputVariables", &[]);
                let mut y = 30;
                for (pin, sources) in inputs {
                    tree.open("variable", &[("formalParameter", pin)]);
                    self.place.input(tree, y, sources);
                    tree.close("variable");
                    y += 20;
                }
                tree.close("inputVariables");
                tree.empty("inOutVariables", &[]);
                tree.open("outputVariables", &[]);
                let mut y = 30;
                for pin in outputs {
                    tree.open("variable", &[("formalParameter", pin)]);
                    self.place.output(tree, y);
                    tree.close("variable");
                    y += 20;
                }
                tree.close("outputVariables");
                tree.close("block");
            }
            What::InVariable(text) => {
                let mut attributes = common.to_vec();
                attributes.push(("negated", "false"));
                tree.open("inVariable", &attributes);
                position(tree, "position", self.place.x, self.place.y);
                self.place.output(tree, WIRE);
                tree.text("expression", text);
                tree.close("inVariable");
            }
            What::Comment(text) => {
                tree.open("comment", &common);
                position(tree, "position", self.place.x, self.place.y);
                tree.formatted("content", text);
                tree.close("comment");
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one element")]
    fn element(
        &self,
        tree: &mut Tree,
        name: &str,
        common: &[(&str, &str)],
        negated: &str,
        more: Option<(&str, &str)>,
        sources: &[Source],
        variable: &str,
    ) {
        let mut attributes = common.to_vec();
        attributes.push(("negated", negated));
        attributes.extend(more);
        tree.open(name, &attributes);
        position(tree, "position", self.place.x, self.place.y);
        self.place.input(tree, WIRE, sources);
        self.place.output(tree, WIRE);
        tree.text("variable", variable);
        tree.close(name);
    }
}

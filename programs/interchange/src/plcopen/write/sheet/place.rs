//! The position of an object, its connection points, and the bends of the wires between them.

use super::Source;
use crate::plcopen::write::tree::Tree;

/// Top left corner and size, in the units of the file.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub(super) x: i64,
    pub(super) y: i64,
    pub(super) width: i64,
    pub(super) height: i64,
}

pub(in crate::plcopen::write) fn position(tree: &mut Tree, element: &str, x: i64, y: i64) {
    tree.empty(element, &[("x", &x.to_string()), ("y", &y.to_string())]);
}

impl Place {
    /// An input at the left edge with its wires, each drawn from its end to its beginning.
    pub(super) fn input(&self, tree: &mut Tree, y: i64, sources: &[Source]) {
        tree.open("connectionPointIn", &[]);
        position(tree, "relPosition", 0, y);
        for source in sources {
            let id = source.id.to_string();
            let mut attributes = vec![("refLocalId", id.as_str())];
            attributes.extend(source.pin.map(|pin| ("formalParameter", pin)));
            tree.open("connection", &attributes);
            let end = (self.x, self.y + y);
            position(tree, "position", end.0, end.1);
            if source.y != end.1 {
                position(tree, "position", end.0 - 10, end.1);
                position(tree, "position", end.0 - 10, source.y);
            }
            position(tree, "position", source.x, source.y);
            tree.close("connection");
        }
        tree.close("connectionPointIn");
    }

    /// An output at the right edge.
    pub(super) fn output(&self, tree: &mut Tree, y: i64) {
        tree.open("connectionPointOut", &[]);
        position(tree, "relPosition", self.width, y);
        tree.close("connectionPointOut");
    }
}

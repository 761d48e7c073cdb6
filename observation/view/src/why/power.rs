//! Which elements of a rung let power through, and which hold it back.

use understudy_ladder::{Block, Element, ElementFlow, Series};

/// An element with what the power did in it, and what is inside of it.
pub(super) struct Node<'e> {
    pub(super) element: &'e Element,
    pub(super) flow: &'e ElementFlow,
    /// Branches, or what feeds the pins of a block.
    parts: Vec<Vec<Node<'e>>>,
}

/// The elements of a rung's network; `flows` are in the order of [`understudy_ladder::visit`].
pub(super) fn nodes<'e>(
    series: &'e Series,
    flows: &mut std::slice::Iter<'e, ElementFlow>,
) -> Vec<Node<'e>> {
    let mut found = Vec::new();
    for element in series {
        let parts = match element {
            Element::Branches(branches) => {
                branches.iter().map(|branch| nodes(branch, flows)).collect()
            }
            Element::Block(block) => {
                let feeds = block.pins.iter();
                feeds.map(|feed| nodes(&feed.network, flows)).collect()
            }
            Element::Contact(_) | Element::Comparison(_) => Vec::new(),
        };
        if let Some(flow) = flows.next() {
            found.push(Node { element, flow, parts });
        }
    }
    found
}

impl Node<'_> {
    /// Whether it may have power behind it that does not come to it: a block that is on without power at its wire, or branches with one.
    fn holds(&self) -> bool {
        match self.element {
            Element::Block(block) => !block.kind.needs_power(),
            Element::Branches(_) => self.parts.iter().any(|branch| has_holder(branch)),
            Element::Contact(_) | Element::Comparison(_) => false,
        }
    }
}

fn has_holder(series: &[Node<'_>]) -> bool {
    series.iter().any(Node::holds)
}

/// A way through a series that has power behind it: one branch of each. What has no power in front of a block that is on all the same is no cause.
pub(super) fn conducting<'n, 'e>(series: &'n [Node<'e>]) -> Vec<&'n Node<'e>> {
    let last = series.iter().rposition(Node::holds);
    let is_fed = last.is_none_or(|last| series[last].flow.enters);
    let series = if is_fed { series } else { &series[last.unwrap_or_default()..] };
    let mut way = Vec::new();
    for node in series {
        match node.element {
            Element::Branches(_) => {
                let through = node
                    .parts
                    .iter()
                    .find(|branch| branch.last().map_or(node.flow.enters, |last| last.flow.leaves));
                way.extend(through.map(|branch| conducting(branch)).unwrap_or_default());
            }
            _ => way.push(node),
        }
    }
    way
}

/// The elements at which all the power of a series ends: in each branch the first that does not pass it.
pub(super) fn blocking<'n, 'e>(series: &'n [Node<'e>]) -> Vec<&'n Node<'e>> {
    let last = series.iter().rposition(Node::holds);
    let Some(last) = last else {
        return ends(series);
    };
    let node = &series[last];
    if node.flow.leaves {
        return ends(&series[last + 1..]);
    }
    let Element::Branches(_) = node.element else {
        return vec![node];
    };
    let is_open = |branch: &&Vec<Node<'e>>| has_holder(branch) || node.flow.enters;
    let mut found = Vec::new();
    if !node.parts.iter().all(|branch| is_open(&branch)) {
        found.extend(blocking(&series[..last]));
    }
    found.extend(node.parts.iter().filter(is_open).flat_map(|branch| blocking(branch)));
    found
}

/// As [`blocking`], of a series without a block that is on without power.
fn ends<'n, 'e>(series: &'n [Node<'e>]) -> Vec<&'n Node<'e>> {
    let Some(node) = series.iter().find(|node| node.flow.enters && !node.flow.leaves) else {
        return Vec::new();
    };
    match node.element {
        Element::Branches(_) => {
            let branches = node.parts.iter();
            branches.flat_map(|branch| blocking(branch)).collect()
        }
        _ => vec![node],
    }
}

/// Why there is power behind a series, or why not.
pub(super) fn behind<'n, 'e>(series: &'n [Node<'e>], power: bool) -> Vec<&'n Node<'e>> {
    if power { conducting(series) } else { blocking(series) }
}

/// A block, and why there is power at its wire or why not.
pub(super) struct AtBlock<'n, 'e> {
    pub(super) block: &'e Block,
    pub(super) node: &'n Node<'e>,
    pub(super) wire: Vec<&'n Node<'e>>,
}

/// Looks for a block in a series.
pub(super) fn at_block<'n, 'e>(series: &'n [Node<'e>], name: &str) -> Option<AtBlock<'n, 'e>> {
    for (place, node) in series.iter().enumerate() {
        let before = &series[..place];
        match node.element {
            Element::Block(block) if block.name.as_str() == name => {
                return Some(AtBlock { block, node, wire: behind(before, node.flow.enters) });
            }
            Element::Branches(_) => {
                let inside = node.parts.iter().find_map(|branch| at_block(branch, name));
                if let Some(mut inside) = inside {
                    if !node.flow.enters {
                        inside.wire = blocking(before);
                    } else if inside.node.flow.enters {
                        inside.wire.splice(0..0, conducting(before));
                    }
                    return Some(inside);
                }
            }
            // What feeds a pin begins at the rail.
            Element::Block(_) => {
                let inside = node.parts.iter().find_map(|feed| at_block(feed, name));
                if inside.is_some() {
                    return inside;
                }
            }
            Element::Contact(_) | Element::Comparison(_) => {}
        }
    }
    None
}

impl<'e> AtBlock<'_, 'e> {
    /// What feeds a pin, and whether there is power behind it; a pin that nothing feeds has none.
    pub(super) fn feed(&self, pin: &str) -> (bool, Vec<&Node<'e>>) {
        let place = self.block.pins.iter().position(|feed| feed.pin.as_str() == pin);
        let Some(nodes) = place.and_then(|place| self.node.parts.get(place)) else {
            return (false, Vec::new());
        };
        let power = nodes.last().is_none_or(|last| last.flow.leaves);
        (power, behind(nodes, power))
    }
}

//! Places of the parts of a network: what feeds a block is to its left, in the order of its inputs, and each part has rows of its own.

use super::{CONTACT_HEAD, CONTACT_ROW, Contacts, Kind, Network, Object};
use crate::{CHARACTER, Place, Point, width};

/// Distance between two pins of a block.
const ROW: i64 = 24;
/// Height of a value or a target.
const HEIGHT: i64 = 20;
/// From the upper edge of a block to the row of its first pin.
const HEAD: i64 = 32;
/// Below a block.
const GAP: i64 = 12;
/// From a part to the wires behind it, and from these to the next part.
const CHANNEL: i64 = 14;
/// Between two wires in a channel.
const LANE: i64 = 8;
/// Above a block with an instance, for its name.
const INSTANCE: i64 = 18;
/// Width of a coil; its name is behind it.
pub(crate) const COIL: i64 = 30;
/// The left and upper edge of all.
const MARGIN: i64 = 20;
/// Height of a line of a comment.
const LINE: i64 = 18;

/// A part with its place.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Its outline. The name of an instance is above it.
    pub place: Place,
    /// How far below its upper edge its inputs are.
    pub inputs: Vec<i64>,
    /// How far below its upper edge its outputs are.
    pub outputs: Vec<i64>,
}

/// A connection.
#[derive(Debug, Clone)]
pub struct Wire {
    /// Object and output.
    pub from: (usize, usize),
    /// Object and input.
    pub to: (usize, usize),
    /// Corners of the line, from its begin to its end.
    pub points: Vec<Point>,
}

/// Where the parts of a network are.
#[derive(Debug, Clone, Default)]
pub struct BlockPlan {
    /// The place of each object, in the order of the network's objects.
    pub objects: Vec<Placed>,
    /// All connections.
    pub wires: Vec<Wire>,
    /// The place of the comments; its height is 0 without comments.
    pub comments: Place,
    /// The right edge.
    pub right: i64,
    /// The lower edge.
    pub bottom: i64,
}

/// Places a network below `top`.
pub fn lay_out(network: &Network, top: i64) -> BlockPlan {
    let mut layout = Layout::new(network);
    let lines = i64::try_from(network.comments.len()).unwrap_or(0);
    let widest = network.comments.iter().map(|line| width(line)).max();
    let comments =
        Place { x: MARGIN, y: top, width: widest.unwrap_or(0) + CHARACTER, height: lines * LINE };
    let mut bottom = comments.bottom();
    if lines > 0 {
        bottom += LINE / 2;
    }
    for object in 0..network.objects.len() {
        // A root: nothing is connected to it, and what assigns a target places it.
        let is_target = network.objects[object].kind.target().is_some();
        if layout.consumer[object].is_none() && !is_target {
            bottom = layout.tree(object, bottom).bottom + GAP;
        }
    }
    let wires = layout.wires();
    let places = layout.objects.iter().map(|placed| placed.place.right());
    let right = places.chain([comments.right()]).max();
    BlockPlan { wires, right: right.unwrap_or(MARGIN), comments, objects: layout.objects, bottom }
}

/// The size of a block or of contacts, and where its pins are.
struct Shape {
    /// From the upper edge to the first input.
    head: i64,
    /// For what is above the upper edge.
    above: i64,
    /// How far below the upper edge the inputs are.
    inputs: Vec<i64>,
    /// How far below it the outputs are.
    outputs: Vec<i64>,
    width: i64,
    height: i64,
}

impl Shape {
    fn of(shown: &Object) -> Self {
        match &shown.kind {
            Kind::Contacts(contacts) => Self::contacts(contacts),
            Kind::Block { of, instance } => Self::block(shown, of, instance.as_deref()),
            Kind::Value(_) | Kind::Target(_) | Kind::Coil(..) => Self::block(shown, "", None),
        }
    }

    fn contacts(contacts: &Contacts) -> Self {
        let rows = contacts.inputs(0).into_iter();
        let inputs: Vec<i64> = rows.map(|row| CONTACT_HEAD + row * CONTACT_ROW).collect();
        Self {
            head: inputs.first().copied().unwrap_or(CONTACT_HEAD),
            above: 0,
            inputs,
            outputs: vec![CONTACT_HEAD],
            width: contacts.width(),
            height: contacts.rows() * CONTACT_ROW,
        }
    }

    fn block(shown: &Object, of: &str, instance: Option<&str>) -> Self {
        let name = |name: &str| if name.is_empty() { 0 } else { width(name) };
        let inputs = shown.inputs.iter().map(|input| name(&input.name)).max();
        let outputs = shown.outputs.iter().map(|output| name(&output.name)).max();
        let pins = inputs.unwrap_or(0) + outputs.unwrap_or(0) + 4 * CHARACTER;
        let heading = width(of).max(instance.map_or(0, width));
        let count = shown.inputs.len().max(shown.outputs.len()).max(1);
        let rows = |count: usize| (HEAD..).step_by(ROW as usize).take(count).collect();
        Self {
            head: HEAD,
            above: instance.map_or(0, |_| INSTANCE),
            inputs: rows(shown.inputs.len()),
            outputs: rows(shown.outputs.len()),
            width: pins.max(heading + 2 * CHARACTER),
            height: HEAD + ROW * i64::try_from(count).unwrap_or(1) - ROW / 2 + 4,
        }
    }
}

/// Where a tree has come to.
struct Reached {
    /// The right edge of all its parts.
    right: i64,
    bottom: i64,
}

struct Layout<'n> {
    network: &'n Network,
    objects: Vec<Placed>,
    /// The block that takes an output of the object.
    consumer: Vec<Option<usize>>,
    /// The targets of the object, with the output of each.
    targets: Vec<Vec<(usize, usize)>>,
    /// Wires into the object bend here, by input.
    bends: Vec<Vec<i64>>,
}

impl<'n> Layout<'n> {
    fn new(network: &'n Network) -> Self {
        let count = network.objects.len();
        let mut consumer = vec![None; count];
        let mut targets = vec![Vec::new(); count];
        for (place, object) in network.objects.iter().enumerate() {
            for (from, output) in object.inputs.iter().filter_map(|input| input.from) {
                match object.kind.target() {
                    Some(_) => targets[from].push((place, output)),
                    None => consumer[from] = Some(place),
                }
            }
        }
        let objects = network.objects.iter().map(|object| Placed {
            place: Place::default(),
            inputs: vec![0; object.inputs.len()],
            outputs: vec![0; object.outputs.len()],
        });
        Self {
            network,
            objects: objects.collect(),
            consumer,
            targets,
            bends: vec![Vec::new(); count],
        }
    }

    /// The row of an output.
    fn row(&self, (object, output): (usize, usize)) -> i64 {
        let placed = &self.objects[object];
        placed.place.y + placed.outputs.get(output).copied().unwrap_or(HEIGHT / 2)
    }

    /// Places an object, what feeds it and its targets at or below `top`.
    fn tree(&mut self, object: usize, top: i64) -> Reached {
        if self.is_block(object) {
            return self.block(object, top);
        }
        let place = Place { x: MARGIN, y: top, width: self.text(object), height: HEIGHT };
        self.simple(object, place);
        let right = self.place_targets(object);
        Reached { right, bottom: top + ROW }
    }

    /// A value or a target at its place.
    fn simple(&mut self, object: usize, place: Place) {
        let placed = &mut self.objects[object];
        placed.place = place;
        placed.inputs.fill(HEIGHT / 2);
        placed.outputs.fill(HEIGHT / 2);
    }

    fn block(&mut self, object: usize, top: i64) -> Reached {
        let network = self.network;
        let shown = &network.objects[object];
        let Shape { head, above, inputs: pins, outputs, width, height } = Shape::of(shown);
        let offset = |input: usize| pins[input] - head;
        let sources: Vec<Option<(usize, usize)>> =
            shown.inputs.iter().map(|input| input.from).collect();
        let mut first = top + above + head;
        let mut free = top;
        // The right edge of the blocks that feed it, and the width of the values, which are in a column behind these.
        let (mut blocks, mut values) = (None, 0);
        let mut rows: Vec<i64> = Vec::with_capacity(sources.len());
        let mut last: Option<i64> = None;
        for (input, source) in sources.iter().enumerate() {
            let pin = first + offset(input);
            // No source is above its pin, nor above the source before it: so no wire crosses another.
            let least = last.map_or(pin, |last| pin.max(last + ROW));
            let mut row = least;
            match source {
                Some((source, output)) if self.is_block(*source) => {
                    let mut reached = self.block(*source, free);
                    let down = (least - self.row((*source, *output))).max(0);
                    self.shift(*source, down);
                    reached.bottom += down;
                    row = self.row((*source, *output));
                    free = reached.bottom + GAP;
                    let right = reached.right + self.label(*source, *output);
                    blocks = blocks.max(Some(right));
                }
                Some((source, _)) => values = values.max(self.text(*source)),
                None => {
                    rows.push(pin);
                    continue;
                }
            }
            if input == 0 {
                first = row;
            }
            last = Some(row);
            rows.push(row);
        }
        let right = match blocks {
            Some(blocks) if values > 0 => blocks + CHANNEL + values,
            Some(blocks) => blocks,
            None => MARGIN + values,
        };
        let row_of = |input: usize| first + offset(input);
        let bends = rows.iter().enumerate();
        let bends: Vec<bool> = bends.map(|(input, row)| *row > row_of(input)).collect();
        let before = |input: usize| bends[..input].iter().filter(|bends| **bends).count();
        let lane =
            |input: usize| right + CHANNEL + LANE * i64::try_from(before(input)).unwrap_or(0);
        self.bends[object] = (0..rows.len()).map(lane).collect();
        // Contacts without an input begin at the rail.
        let x = match (&shown.kind, rows.len()) {
            (Kind::Contacts(_), 0) => MARGIN,
            (_, count) => lane(count) + CHANNEL,
        };
        let place = Place { x, y: first - head, width, height };
        let placed = &mut self.objects[object];
        placed.place = place;
        placed.inputs = pins;
        placed.outputs = outputs;
        for (source, row) in sources.iter().zip(&rows) {
            if let Some((source, _)) = source
                && !self.is_block(*source)
            {
                let width = self.text(*source);
                let value = Place { x: right - width, y: row - HEIGHT / 2, width, height: HEIGHT };
                self.simple(*source, value);
            }
        }
        let right = self.place_targets(object);
        let last = last.map_or(top, |last| last + ROW / 2);
        Reached { right, bottom: free.max(last).max(place.bottom()) }
    }

    /// Moves an object, what feeds it and its targets down.
    fn shift(&mut self, object: usize, down: i64) {
        self.objects[object].place.y += down;
        for (target, _) in self.targets[object].clone() {
            self.objects[target].place.y += down;
        }
        let sources = self.network.objects[object].inputs.iter();
        for (source, _) in sources.filter_map(|input| input.from) {
            self.shift(source, down);
        }
    }

    /// Whether it has a place of its own, behind what feeds it.
    fn is_block(&self, object: usize) -> bool {
        let kind = &self.network.objects[object].kind;
        matches!(kind, Kind::Block { .. } | Kind::Contacts(_))
    }

    /// Width of a value with its value in the scan.
    fn text(&self, object: usize) -> i64 {
        let shown = &self.network.objects[object];
        match &shown.kind {
            Kind::Value(text) => {
                let value = shown.outputs.first().and_then(|output| output.value.as_ref());
                let value = value.map_or(0, |value| width(value) + CHARACTER);
                width(text) + value + CHARACTER
            }
            Kind::Target(text) => width(text) + CHARACTER,
            Kind::Coil(text, _) => COIL + width(text) + CHARACTER,
            Kind::Block { .. } | Kind::Contacts(_) => self.objects[object].place.width,
        }
    }

    /// Width of the value that is written above the begin of a wire.
    fn label(&self, object: usize, output: usize) -> i64 {
        let outputs = &self.network.objects[object].outputs;
        let value = outputs.get(output).and_then(|output| output.value.as_ref());
        value.map_or(0, |value| width(value) + CHARACTER)
    }

    /// Places the targets of an object to its right; the right edge of all.
    fn place_targets(&mut self, object: usize) -> i64 {
        let own = self.objects[object].place.right();
        let targets = self.targets[object].clone();
        let labels = targets.iter().map(|(_, output)| self.label(object, *output));
        let is_block = self.is_block(object);
        let label = labels.max().filter(|_| is_block).unwrap_or(0);
        let x = own + label + 2 * CHANNEL;
        let mut right = own;
        for (target, output) in targets {
            let place = Place {
                x,
                y: self.row((object, output)) - HEIGHT / 2,
                width: self.text(target),
                height: HEIGHT,
            };
            self.simple(target, place);
            right = right.max(place.right());
        }
        right
    }

    fn wires(&self) -> Vec<Wire> {
        let mut wires = Vec::new();
        for (place, object) in self.network.objects.iter().enumerate() {
            for (number, input) in object.inputs.iter().enumerate() {
                let Some(from) = input.from else { continue };
                let (source, own) = (&self.objects[from.0], &self.objects[place]);
                let y = own.place.y + own.inputs[number];
                let begin = Point { x: source.place.right(), y: self.row(from) };
                let mut points = vec![begin];
                if begin.y != y {
                    let bends = self.bends[place].get(number);
                    let x = bends.copied().unwrap_or(own.place.x - CHANNEL);
                    points.push(Point { x, y: begin.y });
                    points.push(Point { x, y });
                }
                points.push(Point { x: own.place.x, y });
                wires.push(Wire { from, to: (place, number), points });
            }
        }
        wires
    }
}

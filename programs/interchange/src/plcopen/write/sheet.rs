//! Rungs as objects on a sheet, from left to right, each row below the one before it.

mod object;
mod place;

use understudy_ladder::{
    Block, Coil, Contact, Element, Relation, Rung, Series, StandardNames, standard_time,
};

use self::object::{Object, Source, WIRE, What};
use self::place::Place;
pub(super) use self::place::position;
use super::tree::Tree;

const LEFT: i64 = 40;
const COLUMN: i64 = 100;
const ROW: i64 = 40;

/// Where a series has come to.
struct Reached {
    sources: Vec<Source>,
    x: i64,
    /// The first free row below it.
    bottom: i64,
}

/// All objects of a program.
pub(super) struct Sheet<'a> {
    names: &'a StandardNames,
    objects: Vec<Object>,
}

impl<'a> Sheet<'a> {
    pub(super) fn of(rungs: &[Rung], footer: &[String], names: &'a StandardNames) -> Self {
        let mut sheet = Self { names, objects: Vec::new() };
        let mut y = ROW;
        for rung in rungs {
            y = sheet.rung(rung, y) + ROW / 2;
        }
        sheet.comment(footer, y);
        sheet
    }

    pub(super) fn write(&self, tree: &mut Tree) {
        for (number, object) in self.objects.iter().enumerate() {
            object.write(number + 1, tree);
        }
    }

    /// The number that the next object gets.
    fn add(&mut self, place: Place, what: What) -> usize {
        self.objects.push(Object { place, what });
        self.objects.len()
    }

    fn comment(&mut self, lines: &[String], y: i64) -> i64 {
        if lines.is_empty() {
            return y;
        }
        let height = 10 + 20 * i64::try_from(lines.len()).unwrap_or(1);
        let place = Place { x: LEFT, y, width: 500, height };
        self.add(place, What::Comment(lines.join("\n")));
        y + height + 10
    }

    fn rung(&mut self, rung: &Rung, top: i64) -> i64 {
        let lines: Vec<String> = rung.title.iter().chain(&rung.comments).cloned().collect();
        let top = self.comment(&lines, top);
        let rail = Place { x: LEFT, y: top, width: 10, height: ROW };
        let id = self.add(rail, What::LeftRail);
        let rail = Source { id, pin: None, x: LEFT + 10, y: top + WIRE };
        let reached =
            self.series(&rung.network, &rail, std::slice::from_ref(&rail), LEFT + COLUMN / 2, top);
        let mut y = top;
        let mut ends = Vec::new();
        for coil in &rung.coils {
            ends.push(self.coil(coil, &reached, y));
            y += ROW;
        }
        let x = reached.x + COLUMN;
        let bottom = reached.bottom.max(y);
        let place = Place { x, y: top, width: 10, height: bottom - top };
        self.add(place, What::RightRail(ends));
        bottom
    }

    fn coil(&mut self, coil: &Coil, reached: &Reached, y: i64) -> Source {
        let place = Place { x: reached.x, y, width: 21, height: 20 };
        let variable = self.names.operand(&coil.target);
        let id = self.add(place, What::Coil(coil.kind, variable, reached.sources.clone()));
        Source { id, pin: None, x: place.x + place.width, y: y + WIRE }
    }

    fn series(
        &mut self,
        series: &Series,
        rail: &Source,
        from: &[Source],
        x: i64,
        y: i64,
    ) -> Reached {
        let mut reached = Reached { sources: from.to_vec(), x, bottom: y + ROW };
        for element in series {
            let next = match element {
                Element::Contact(contact) => self.contact(contact, &reached, y),
                Element::Comparison(comparison) => {
                    let counter = format!("{}.CV", self.names.operand(&comparison.counter));
                    let value = comparison.value.to_string();
                    self.comparison(comparison.relation, counter, value, rail, &reached, y)
                }
                Element::Branches(branches) => self.branches(branches, rail, &reached, y),
                Element::Block(block) => self.block(block, rail, &reached, y),
            };
            reached = Reached { bottom: reached.bottom.max(next.bottom), ..next };
        }
        reached
    }

    fn contact(&mut self, contact: &Contact, from: &Reached, y: i64) -> Reached {
        let place = Place { x: from.x, y, width: 21, height: 20 };
        let variable = self.names.operand(&contact.operand);
        let id = self.add(place, What::Contact(contact.kind, variable, from.sources.clone()));
        let source = Source { id, pin: None, x: place.x + place.width, y: y + WIRE };
        Reached { sources: vec![source], x: from.x + COLUMN, bottom: y + ROW }
    }

    fn branches(&mut self, branches: &[Series], rail: &Source, from: &Reached, y: i64) -> Reached {
        let mut joined = Reached { sources: Vec::new(), x: from.x, bottom: y };
        for branch in branches {
            let reached = self.series(branch, rail, &from.sources, from.x, joined.bottom);
            joined.sources.extend(reached.sources);
            joined.x = joined.x.max(reached.x);
            joined.bottom = reached.bottom;
        }
        joined
    }

    /// A function that compares, and behind it one that adds the power before it.
    fn comparison(
        &mut self,
        relation: Relation,
        counter: String,
        value: String,
        rail: &Source,
        from: &Reached,
        y: i64,
    ) -> Reached {
        let word = match relation {
            Relation::Equal => "EQ",
            Relation::NotEqual => "NE",
            Relation::Less => "LT",
            Relation::LessOrEqual => "LE",
            Relation::Greater => "GT",
            Relation::GreaterOrEqual => "GE",
        };
        let counter = self.variable(counter, from.x, y);
        let value = self.variable(value, from.x, y + ROW / 2);
        let inputs = vec![("IN1", vec![counter]), ("IN2", vec![value])];
        let mut reached = self.function(word, inputs, from.x + COLUMN, y);
        let is_rail = matches!(from.sources.as_slice(), [only] if only.id == rail.id);
        if !is_rail {
            let inputs = vec![("IN1", from.sources.clone()), ("IN2", reached.sources.clone())];
            reached = self.function("AND", inputs, reached.x, y);
        }
        reached
    }

    fn function(
        &mut self,
        word: &'static str,
        inputs: Vec<(&'static str, Vec<Source>)>,
        x: i64,
        y: i64,
    ) -> Reached {
        let place = Place { x, y: y - WIRE, width: 60, height: 60 };
        let id = self.add(place, What::Block(word, None, inputs, vec!["OUT"]));
        let source = Source { id, pin: Some("OUT"), x: x + place.width, y: y + 20 };
        Reached { sources: vec![source], x: x + COLUMN, bottom: y + 2 * ROW }
    }

    fn variable(&mut self, text: String, x: i64, y: i64) -> Source {
        let place = Place { x, y, width: 60, height: 20 };
        let id = self.add(place, What::InVariable(text));
        Source { id, pin: None, x: x + place.width, y: y + WIRE }
    }

    fn block(&mut self, block: &Block, rail: &Source, from: &Reached, y: i64) -> Reached {
        let mut x = from.x;
        let mut bottom = y + ROW;
        let mut inputs = vec![(block.kind.wire_input(), from.sources.clone())];
        for (pin, _) in block.kind.side_inputs() {
            if let Some(feed) = block.pins.iter().find(|feed| feed.pin.as_str() == *pin) {
                let reached = self.series(
                    &feed.network,
                    rail,
                    std::slice::from_ref(rail),
                    LEFT + COLUMN / 2,
                    bottom,
                );
                x = x.max(reached.x);
                bottom = reached.bottom;
                inputs.push((pin, reached.sources));
            }
        }
        let preset = match (block.kind.preset_time(), block.kind.preset_value()) {
            (Some(time), _) => Some(("PT", standard_time(time))),
            (None, Some(value)) => Some(("PV", value.to_string())),
            (None, None) => None,
        };
        if let Some((pin, text)) = preset {
            let source = self.variable(text, x, bottom);
            bottom += ROW;
            x += COLUMN;
            inputs.push((pin, vec![source]));
        }
        let mut outputs = block.kind.outputs().to_vec();
        outputs.extend(pin_of_value(block));
        let rows = i64::try_from(inputs.len().max(outputs.len())).unwrap_or(1);
        let place = Place { x, y: y - 20, width: 60, height: 20 + 20 * rows };
        let name = self.names.signal(&block.name).to_owned();
        let first = block.kind.outputs()[0];
        let id = self.add(place, What::Block(block.kind.word(), Some(name), inputs, outputs));
        let source = Source { id, pin: Some(first), x: x + place.width, y: y + WIRE };
        Reached {
            sources: vec![source],
            x: x + COLUMN,
            bottom: bottom.max(place.y + place.height + WIRE),
        }
    }
}

/// The output that is not a bit: editors show it.
fn pin_of_value(block: &Block) -> Option<&'static str> {
    if block.kind.preset_time().is_some() {
        Some("ET")
    } else if block.kind.preset_value().is_some() {
        Some("CV")
    } else {
        None
    }
}

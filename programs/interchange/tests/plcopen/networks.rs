//! Random function block diagrams with all that a pin can have: wires with several ends, negations, edges, EN and ENO,
//! blocks that keep a value, rings, and objects with and without an executionOrderId. Each is executed by the rules of the
//! documentation alone, scan by scan.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_interchange::plcopen::read;
use understudy_logic::Running;
use understudy_testing::random::Dice;

use crate::numbers::{Scans, typed};
use crate::support::PERIOD;

/// Where a value comes from: the object of that number, or its ENO.
#[derive(Debug, Clone, Copy)]
enum Source {
    Value(usize),
    Eno(usize),
}

impl Source {
    fn object(self) -> usize {
        match self {
            Self::Value(at) | Self::Eno(at) => at,
        }
    }
}

#[derive(Debug, Clone, Copy, Default)]
struct Modifier {
    negated: bool,
    /// Whether it rises.
    edge: Option<bool>,
}

#[derive(Debug, Clone, Copy)]
struct Pin {
    source: Source,
    modifier: Modifier,
}

#[derive(Debug, Clone)]
enum Kind {
    Given(&'static str, Modifier),
    Function(&'static str),
    /// Shows what it was given in the last scan in which it acted.
    Delay,
    Taken(&'static str, Modifier),
}

#[derive(Debug, Clone)]
struct Object {
    kind: Kind,
    enable: Option<Pin>,
    pins: Vec<Pin>,
    order: u64,
    height: usize,
}

#[derive(Debug, Clone)]
struct Diagram {
    of: &'static str,
    objects: Vec<Object>,
}

const NUMBERS: [&str; 2] = ["a", "b"];
const BITS: [&str; 2] = ["e", "f"];
const OUTPUTS: [&str; 3] = ["o", "x", "y"];
const FLAGS: [&str; 2] = ["p", "q"];

fn random(seed: u64) -> Diagram {
    let mut dice = Dice::new(seed);
    let of = if seed.is_multiple_of(2) { "BOOL" } else { "INT" };
    let is_bit = of == "BOOL";
    let (givens, boxes, takens) = (2 + dice.below(4), 1 + dice.below(4), 2 + dice.below(4));
    let modifier = |dice: &mut Dice, has_any: bool| Modifier {
        negated: has_any && dice.rarely(4),
        edge: (has_any && dice.rarely(5)).then(|| dice.rarely(2)),
    };
    let mut objects: Vec<Object> = Vec::new();
    let plain = |kind| Object { kind, enable: None, pins: Vec::new(), order: 0, height: 0 };
    // Two bits are always there, whatever the type of the others is.
    for at in 0..2 + givens {
        let name = match at {
            0..2 => dice.pick(&[BITS, FLAGS].concat()),
            _ => dice.pick(&[&NUMBERS[..], &OUTPUTS].concat()),
        };
        let mut modifier = modifier(&mut dice, at < 2 || is_bit);
        // Which of the two acts first on a variable is nowhere said.
        modifier.negated &= modifier.edge.is_none();
        objects.push(plain(Kind::Given(name, modifier)));
    }
    let first_box = objects.len();
    let has_rings = dice.rarely(2);
    let words: &[&str] = if is_bit { &["AND", "OR", "XOR"] } else { &["ADD", "SUB", "MUL"] };
    for at in 0..boxes {
        let kind = if dice.rarely(4) { Kind::Delay } else { Kind::Function(dice.pick(words)) };
        let count = if matches!(kind, Kind::Delay) { 1 } else { 2 };
        let reach = if has_rings { boxes } else { at };
        let pin = |dice: &mut Dice, of_bit: bool, reach: usize| {
            let source = if of_bit {
                match dice.below(2 + reach) {
                    bit if bit < 2 => Source::Value(bit),
                    other => Source::Eno(first_box + other - 2),
                }
            } else {
                Source::Value(2 + dice.below(givens + reach))
            };
            Pin { source, modifier: modifier(dice, of_bit || is_bit) }
        };
        let enable = dice.rarely(2).then(|| pin(&mut dice, true, reach));
        let mut pins = Vec::new();
        for _ in 0..count {
            let of_bit = is_bit && dice.rarely(4);
            // A ring of numbers has the type of what comes into it.
            let is_typed = pins.is_empty() && has_rings && !is_bit;
            pins.push(pin(&mut dice, of_bit, if is_typed { 0 } else { reach }));
        }
        objects.push(Object { enable, pins, ..plain(kind) });
    }
    for _ in 0..takens {
        let flag = dice.rarely(3);
        let source = match flag {
            true if dice.rarely(4) => Source::Value(dice.below(2)),
            true => Source::Eno(first_box + dice.below(boxes)),
            false => Source::Value(2 + dice.below(givens + boxes)),
        };
        let name = if flag { dice.pick(&FLAGS) } else { dice.pick(&OUTPUTS) };
        let mut modifier = modifier(&mut dice, flag || is_bit);
        // Whether the edge of what is not written is seen is nowhere said.
        modifier.edge = None;
        let pin = Pin { source, modifier: Modifier::default() };
        objects.push(Object { pins: vec![pin], ..plain(Kind::Taken(name, modifier)) });
    }
    let mut places: Vec<usize> = (1..=objects.len()).collect();
    for at in 0..places.len() {
        places.swap(at, dice.below(at + 1));
    }
    let said = dice.below(3);
    for (object, place) in objects.iter_mut().zip(places) {
        let has_order = !matches!(object.kind, Kind::Given(..));
        match said {
            0 => object.height = place,
            1 if has_order => object.order = place as u64,
            2 if has_order && dice.rarely(2) => object.order = place as u64,
            _ => object.height = place,
        }
    }
    Diagram { of, objects }
}

impl Diagram {
    fn document(&self) -> String {
        let of = self.of;
        let declared = |names: &[&str], of: &str| -> String {
            let names = names.iter();
            names
                .map(|name| format!(r#"<variable name="{name}"><type><{of}/></type></variable>"#))
                .collect()
        };
        let mut body = String::new();
        let mut instances = String::new();
        let modifier = |modifier: Modifier| {
            let edge = match modifier.edge {
                None => "",
                Some(true) => r#" edge="rising""#,
                Some(false) => r#" edge="falling""#,
            };
            format!(r#" negated="{}"{edge}"#, modifier.negated)
        };
        let from = |source: Source| match source {
            Source::Value(at) => match self.objects[at].kind {
                Kind::Given(..) => format!(r#"<connection refLocalId="{}"/>"#, at + 1),
                Kind::Delay => {
                    format!(r#"<connection refLocalId="{}" formalParameter="s"/>"#, at + 1)
                }
                _ => format!(r#"<connection refLocalId="{}" formalParameter="OUT"/>"#, at + 1),
            },
            Source::Eno(at) => {
                format!(r#"<connection refLocalId="{}" formalParameter="ENO"/>"#, at + 1)
            }
        };
        for (at, object) in self.objects.iter().enumerate() {
            let id = at + 1;
            let order = match object.order {
                0 => String::new(),
                order => format!(r#" executionOrderId="{order}""#),
            };
            let position = format!(r#"<position x="1" y="{}"/>"#, object.height);
            let pin = |name: &str, pin: &Pin| {
                format!(
                    r#"<variable formalParameter="{name}"{}><connectionPointIn>{}</connectionPointIn></variable>"#,
                    modifier(pin.modifier),
                    from(pin.source)
                )
            };
            let enable = object.enable.as_ref().map(|enable| pin("EN", enable)).unwrap_or_default();
            let _ = match &object.kind {
                Kind::Given(name, how) => write!(
                    body,
                    r#"<inVariable localId="{id}"{}>{position}<connectionPointOut/><expression>{name}</expression></inVariable>"#,
                    modifier(*how)
                ),
                Kind::Taken(name, how) => write!(
                    body,
                    r#"<outVariable localId="{id}"{}{order}>{position}<connectionPointIn>{}</connectionPointIn><expression>{name}</expression></outVariable>"#,
                    modifier(*how),
                    from(object.pins[0].source)
                ),
                Kind::Delay => {
                    let _ = write!(
                        instances,
                        r#"<variable name="d{id}"><type><derived name="dly"/></type></variable>"#
                    );
                    let pins = enable + &pin("d", &object.pins[0]);
                    write!(
                        body,
                        r#"<block localId="{id}" typeName="dly" instanceName="d{id}"{order}>{position}<inputVariables>{pins}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="ENO"><connectionPointOut/></variable><variable formalParameter="s"><connectionPointOut/></variable></outputVariables></block>"#
                    )
                }
                Kind::Function(word) => {
                    let pins = enable + &pin("IN1", &object.pins[0]) + &pin("IN2", &object.pins[1]);
                    write!(
                        body,
                        r#"<block localId="{id}" typeName="{word}"{order}>{position}<inputVariables>{pins}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="ENO"><connectionPointOut/></variable><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#
                    )
                }
            };
        }
        let inputs = declared(&NUMBERS, of) + &declared(&BITS, "BOOL");
        let outputs = declared(&OUTPUTS, of) + &declared(&FLAGS, "BOOL");
        format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous>
<pou name="dly" pouType="functionBlock"><interface><inputVars><variable name="d"><type><{of}/></type></variable></inputVars><outputVars><variable name="s"><type><{of}/></type></variable></outputVars><localVars><variable name="k"><type><{of}/></type></variable></localVars></interface><body><ST><p>s := k; k := d;</p></ST></body></pou>
<pou name="main" pouType="program"><interface><inputVars>{inputs}</inputVars><outputVars>{outputs}</outputVars><localVars>{instances}</localVars></interface><body><FBD>{body}</FBD></body></pou></pous></types><instances><configurations/></instances></project>"#
        )
    }

    fn sources(&self, at: usize) -> impl Iterator<Item = usize> {
        let object = &self.objects[at];
        object.enable.iter().chain(&object.pins).map(|pin| pin.source.object())
    }

    fn reaches(&self, from: usize) -> Vec<bool> {
        let mut reached = vec![false; self.objects.len()];
        let mut waiting: Vec<usize> = self.sources(from).collect();
        while let Some(at) = waiting.pop() {
            if !std::mem::replace(&mut reached[at], true) {
                waiting.extend(self.sources(at));
            }
        }
        reached
    }
}

/// The diagram in execution.
struct Rules<'a> {
    diagram: &'a Diagram,
    reaches: Vec<Vec<bool>>,
    /// The place of each object in the order of those that act.
    rank: Vec<usize>,
    variables: HashMap<&'static str, u16>,
    /// Of functions: the last results.
    results: Vec<u16>,
    enabled: Vec<bool>,
    /// Of delays: what they show, and what they were given.
    delays: Vec<(u16, u16)>,
    /// What was at each pin with an edge, by object and pin.
    before: HashMap<(usize, usize), bool>,
    /// Values of this scan.
    given: Vec<Option<u16>>,
    is_open: Vec<bool>,
    is_done: Vec<bool>,
}

impl<'a> Rules<'a> {
    fn new(diagram: &'a Diagram) -> Self {
        let count = diagram.objects.len();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&at| {
            let object = &diagram.objects[at];
            (if object.order == 0 { u64::MAX } else { object.order }, object.height)
        });
        let mut rank = vec![0; count];
        for (place, &at) in order.iter().enumerate() {
            rank[at] = place;
        }
        let names = [&NUMBERS[..], &BITS, &OUTPUTS, &FLAGS].concat();
        Self {
            diagram,
            reaches: (0..count).map(|at| diagram.reaches(at)).collect(),
            rank,
            variables: names.into_iter().map(|name| (name, 0)).collect(),
            results: vec![0; count],
            enabled: vec![false; count],
            delays: vec![(0, 0); count],
            before: HashMap::new(),
            given: vec![None; count],
            is_open: vec![false; count],
            is_done: vec![false; count],
        }
    }

    fn scan(&mut self) {
        let count = self.diagram.objects.len();
        self.given = vec![None; count];
        self.is_open = vec![false; count];
        self.is_done = vec![false; count];
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&at| self.rank[at]);
        let acts = |at: usize| match self.diagram.objects[at].kind {
            Kind::Given(..) => false,
            Kind::Taken(..) | Kind::Delay => true,
            // What drives nothing is left out.
            Kind::Function(_) => (0..count).any(|other| {
                let is_end =
                    matches!(self.diagram.objects[other].kind, Kind::Taken(..) | Kind::Delay);
                is_end && self.reaches[other][at]
            }),
        };
        let acting: Vec<usize> = order.into_iter().filter(|&at| acts(at)).collect();
        for at in acting {
            self.act(at);
        }
    }

    fn act(&mut self, at: usize) {
        if self.is_done[at] {
            return;
        }
        self.is_open[at] = true;
        let object = &self.diagram.objects[at];
        if let Kind::Taken(name, modifier) = object.kind {
            let source = object.pins[0].source;
            let value = self.value(source, at);
            let is_written = match source {
                Source::Value(from) => {
                    let from_object = &self.diagram.objects[from];
                    !matches!(from_object.kind, Kind::Function(_))
                        || from_object.enable.is_none()
                        || self.enabled[from]
                }
                Source::Eno(_) => true,
            };
            if is_written {
                self.variables.insert(name, if modifier.negated { 1 - value } else { value });
            }
            self.is_done[at] = true;
            return;
        }
        let before = self.enabled[at];
        let enabled = object.enable.is_none_or(|pin| self.pin(at, 9, pin) == 1);
        let mut pins = Vec::new();
        for (number, pin) in object.pins.iter().enumerate() {
            // Its own pins see what is at EN; all else sees it when the object has acted.
            let is_own = pin.source.object() == at;
            self.enabled[at] = if is_own { enabled } else { before };
            pins.push(self.pin(at, number, *pin));
        }
        self.enabled[at] = enabled;
        if enabled {
            match object.kind {
                Kind::Function(word) => self.results[at] = result(word, pins[0], pins[1]),
                _ => self.delays[at] = (self.delays[at].1, pins[0]),
            }
        }
        self.is_done[at] = true;
    }

    fn pin(&mut self, at: usize, number: usize, pin: Pin) -> u16 {
        let value = self.value(pin.source, at);
        self.changed((at, number), value, pin.modifier)
    }

    fn changed(&mut self, place: (usize, usize), value: u16, modifier: Modifier) -> u16 {
        let value = if modifier.negated { 1 - value } else { value };
        let Some(rises) = modifier.edge else {
            return value;
        };
        let is_on = (value == 1) == rises;
        let before = self.before.insert(place, is_on).unwrap_or(false);
        u16::from(is_on && !before)
    }

    /// What `asker` gets.
    fn value(&mut self, source: Source, asker: usize) -> u16 {
        let at = source.object();
        let object = &self.diagram.objects[at];
        if let Kind::Given(name, modifier) = object.kind {
            if let Some(known) = self.given[at] {
                return known;
            }
            let value = self.changed((at, 0), self.variables[name], modifier);
            self.given[at] = Some(value);
            return value;
        }
        let comes_later = self.diagram.objects[asker].order != 0
            && self.rank[at] > self.rank[asker]
            && self.reaches[at][asker];
        if !self.is_done[at] && !self.is_open[at] && !comes_later {
            self.act(at);
        }
        match (source, &object.kind) {
            (Source::Eno(_), _) => u16::from(object.enable.is_none() || self.enabled[at]),
            (_, Kind::Delay) => self.delays[at].0,
            _ => self.results[at],
        }
    }
}

fn result(word: &str, left: u16, right: u16) -> u16 {
    match word {
        "AND" => left & right,
        "OR" => left | right,
        "XOR" => left ^ right,
        "ADD" => left.wrapping_add(right),
        "SUB" => left.wrapping_sub(right),
        _ => left.wrapping_mul(right),
    }
}

/// Compares readings of a diagram with the rules, scan by scan; whether it was compared as a ladder too.
fn check(diagram: &Diagram, seed: u64) -> bool {
    let text = diagram.document();
    let program = typed(&text, PERIOD).unwrap_or_else(|found| panic!("{seed}: {found:#?}\n{text}"));
    let mut scans = Scans::new(program);
    let reading = read(&text, None);
    let circuit = reading.program.filter(|_| diagram.of == "BOOL");
    let circuit = circuit.map(|program| program.lower(PERIOD).expect("a circuit"));
    let mut running = circuit.as_ref().map(Running::new);
    let mut rules = Rules::new(diagram);
    let mut dice = Dice::new(seed);
    for scan in 0..20 {
        let most = if diagram.of == "BOOL" { 2 } else { 40_000 };
        let mut given = Vec::new();
        for (name, most) in
            NUMBERS.iter().map(|name| (name, most)).chain(BITS.iter().map(|name| (name, 2)))
        {
            let value = u16::try_from(dice.below(most)).expect("small");
            rules.variables.insert(name, value);
            given.push(u64::from(value));
        }
        rules.scan();
        let names = OUTPUTS.iter().chain(&FLAGS);
        let expected: Vec<u64> = names.map(|name| u64::from(rules.variables[name])).collect();
        assert_eq!(scans.scan(&given), expected, "seed {seed}, scan {scan}: {text}");
        if let Some(running) = &mut running {
            let given: Vec<bool> = given.iter().map(|value| *value == 1).collect();
            let shown = running.step(&given);
            let expected: Vec<bool> = expected.iter().map(|value| *value == 1).collect();
            assert_eq!(shown, expected, "as a ladder, seed {seed}, scan {scan}: {text}");
        }
    }
    running.is_some()
}

#[test]
fn random_networks_are_executed_by_the_rules() {
    let ladders = (0..1200).filter(|&seed| check(&random(seed), seed)).count();
    assert!(ladders > 100, "{ladders}");
}

//! Each box has its place in the order: what a function reads is what it was at its place, not where its result is used.

use std::collections::HashMap;

use understudy_interchange::plcopen::read;
use understudy_logic::Running;
use understudy_testing::random::Dice;

use crate::numbers::{Scans, typed};
use crate::support::PERIOD;

/// Where a value comes from.
#[derive(Debug, Clone, Copy)]
enum Source {
    /// A variable by its name.
    Variable(&'static str),
    /// The box of that number.
    Box(usize),
}

/// A diagram of boxes with two inputs, and of variables that are written.
#[derive(Debug, Clone)]
struct Diagram {
    boxes: Vec<(&'static str, [Source; 2])>,
    written: Vec<(&'static str, Source)>,
    /// A number for each box and then for each written variable, all of them different.
    places: Vec<u64>,
}

/// How the places are said in the document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Said {
    ByHeight,
    ById,
}

const INPUTS: [&str; 2] = ["a", "b"];
const OUTPUTS: [&str; 3] = ["o", "x", "y"];

impl Diagram {
    fn document(&self, of: &str, said: Said) -> String {
        let size = if of == "BOOL" { 'X' } else { 'W' };
        let variable = |(at, name): (usize, &&str), area: char| {
            let address = match of {
                "BOOL" => format!("%{area}{size}0.{at}"),
                _ => format!("%{area}{size}{at}"),
            };
            format!(
                r#"<variable name="{name}" address="{address}"><type><{of}/></type></variable>"#
            )
        };
        let inputs: String = INPUTS.iter().enumerate().map(|it| variable(it, 'I')).collect();
        let outputs: String = OUTPUTS.iter().enumerate().map(|it| variable(it, 'Q')).collect();
        let mut next = 100;
        let mut given = String::new();
        // Each use of a variable has an object of its own, at the bottom of the sheet.
        let mut from = |source: Source| match source {
            Source::Box(at) => {
                format!(r#"<connection refLocalId="{}" formalParameter="OUT"/>"#, at + 1)
            }
            Source::Variable(name) => {
                next += 1;
                given += &format!(
                    r#"<inVariable localId="{next}"><position x="1" y="9000"/><connectionPointOut/><expression>{name}</expression></inVariable>"#
                );
                format!(r#"<connection refLocalId="{next}"/>"#)
            }
        };
        let place = |at: usize| match said {
            Said::ByHeight => {
                (String::new(), format!(r#"<position x="10" y="{}"/>"#, 100 * self.places[at]))
            }
            Said::ById => {
                let id = self.places[at] + 1;
                (
                    format!(r#" executionOrderId="{id}""#),
                    format!(r#"<position x="10" y="{}"/>"#, 9000 - 10 * id),
                )
            }
        };
        let mut body = String::new();
        for (at, (word, sources)) in self.boxes.iter().enumerate() {
            let (order, position) = place(at);
            let pins: String = (1..)
                .zip(sources)
                .map(|(pin, source)| format!(r#"<variable formalParameter="IN{pin}"><connectionPointIn>{}</connectionPointIn></variable>"#, from(*source)))
                .collect();
            body += &format!(
                r#"<block localId="{}" typeName="{word}"{order}>{position}<inputVariables>{pins}</inputVariables><inOutVariables/><outputVariables><variable formalParameter="OUT"><connectionPointOut/></variable></outputVariables></block>"#,
                at + 1
            );
        }
        for (at, (name, source)) in self.written.iter().enumerate() {
            let (order, position) = place(self.boxes.len() + at);
            body += &format!(
                r#"<outVariable localId="{}"{order}>{position}<connectionPointIn>{}</connectionPointIn><expression>{name}</expression></outVariable>"#,
                50 + at,
                from(*source)
            );
        }
        format!(
            r#"<project xmlns="http://www.plcopen.org/xml/tc6_0201"><types><dataTypes/><pous><pou name="main" pouType="program"><interface><localVars>{inputs}{outputs}</localVars></interface><body><FBD>{body}{given}</FBD></body></pou></pous></types><instances><configurations/></instances></project>"#
        )
    }

    /// A scan by the rule alone: in the order of the places, and what feeds something before it.
    fn scan(&self, variables: &mut HashMap<&'static str, u16>) {
        let mut order: Vec<usize> = (0..self.places.len()).collect();
        order.sort_by_key(|at| self.places[*at]);
        let mut results = vec![None; self.boxes.len()];
        for at in order {
            match at.checked_sub(self.boxes.len()) {
                None => {
                    self.result(at, variables, &mut results);
                }
                Some(at) => {
                    let (name, source) = self.written[at];
                    let value = self.value(source, variables, &mut results);
                    variables.insert(name, value);
                }
            }
        }
    }

    fn result(
        &self,
        at: usize,
        variables: &HashMap<&'static str, u16>,
        results: &mut Vec<Option<u16>>,
    ) -> u16 {
        if let Some(known) = results[at] {
            return known;
        }
        let (word, sources) = self.boxes[at];
        let [left, right] = sources.map(|source| self.value(source, variables, results));
        let found = match word {
            "AND" => left & right,
            "OR" => left | right,
            "XOR" => left ^ right,
            "ADD" => left.wrapping_add(right),
            _ => left.wrapping_sub(right),
        };
        results[at] = Some(found);
        found
    }

    fn value(
        &self,
        source: Source,
        variables: &HashMap<&'static str, u16>,
        results: &mut Vec<Option<u16>>,
    ) -> u16 {
        match source {
            Source::Variable(name) => variables[name],
            Source::Box(at) => self.result(at, variables, results),
        }
    }

    /// Compares readings of the document with the rule, scan by scan.
    fn check(&self, of: &str, said: Said) {
        let text = self.document(of, said);
        let mut scans =
            Scans::new(typed(&text, PERIOD).unwrap_or_else(|found| panic!("{found:#?}\n{text}")));
        let circuit = (of == "BOOL").then(|| {
            let reading = read(&text, None);
            let program = reading.program.unwrap_or_else(|| panic!("{:#?}", reading.diagnostics));
            program.lower(PERIOD).expect("a circuit")
        });
        let mut running = circuit.as_ref().map(Running::new);
        let names = INPUTS.iter().chain(&OUTPUTS);
        let mut variables: HashMap<&'static str, u16> = names.map(|name| (*name, 0)).collect();
        let most = if of == "BOOL" { 2 } else { 40_000 };
        let mut dice = Dice::new(self.places.iter().fold(1, |seed, place| 31 * seed + place));
        for scan in 0..12 {
            let given = [0, 1].map(|_| u64::from(u16::try_from(dice.below(most)).expect("small")));
            for (name, value) in INPUTS.into_iter().zip(given) {
                variables.insert(name, value as u16);
            }
            self.scan(&mut variables);
            let expected = OUTPUTS.map(|name| u64::from(variables[name]));
            assert_eq!(scans.scan(&given), expected, "scan {scan}: {self:?} {said:?}");
            if let Some(running) = &mut running {
                let shown = running.step(&given.map(|value| value == 1));
                assert_eq!(
                    shown,
                    expected.map(|value| value == 1),
                    "scan {scan}: {self:?} {said:?}"
                );
            }
        }
    }
}

/// All orders of so many things.
fn orders(count: u64) -> Vec<Vec<u64>> {
    let Some(last) = count.checked_sub(1) else {
        return vec![Vec::new()];
    };
    let shorter = orders(last);
    let longer = shorter.iter().flat_map(|order| {
        (0..=order.len()).map(move |at| {
            let mut order = order.clone();
            order.insert(at, last);
            order
        })
    });
    longer.collect()
}

#[test]
fn a_function_reads_what_is_there_at_its_place() {
    use Source::{Box, Variable};
    for (word, of) in
        [("ADD", "INT"), ("SUB", "INT"), ("XOR", "BOOL"), ("AND", "BOOL"), ("OR", "BOOL")]
    {
        for places in orders(5) {
            let sources = [[Variable("o"), Variable("a")], [Box(0), Variable("x")]];
            let diagram = Diagram {
                boxes: sources.into_iter().map(|sources| (word, sources)).collect(),
                written: vec![("x", Box(1)), ("o", Variable("b")), ("y", Box(0))],
                places,
            };
            diagram.check(of, Said::ByHeight);
            diagram.check(of, Said::ById);
        }
    }
}

#[test]
fn random_diagrams_are_executed_in_their_order() {
    for seed in 0..150 {
        let mut dice = Dice::new(seed);
        let (of, words): (&str, &[&'static str]) =
            if seed % 2 == 0 { ("BOOL", &["AND", "OR", "XOR"]) } else { ("INT", &["ADD", "SUB"]) };
        let names: Vec<&'static str> = INPUTS.into_iter().chain(OUTPUTS).collect();
        let source = |dice: &mut Dice, boxes: usize| match dice.below(names.len() + boxes) {
            at if at < names.len() => Source::Variable(names[at]),
            at => Source::Box(at - names.len()),
        };
        let count = 1 + dice.below(4);
        let boxes: Vec<_> = (0..count)
            .map(|at| {
                (words[dice.below(words.len())], [source(&mut dice, at), source(&mut dice, at)])
            })
            .collect();
        let writes = 2 + dice.below(3);
        let written: Vec<_> =
            (0..writes).map(|_| (OUTPUTS[dice.below(3)], source(&mut dice, count))).collect();
        let mut places: Vec<u64> = (0..(count + writes) as u64).collect();
        for at in 0..places.len() {
            places.swap(at, dice.below(at + 1));
        }
        let diagram = Diagram { boxes, written, places };
        diagram.check(of, Said::ByHeight);
        diagram.check(of, Said::ById);
    }
}

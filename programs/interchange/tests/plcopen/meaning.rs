//! What graphs mean: against a naive walk over random ones, and one by one.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_interchange::plcopen::read;
use understudy_ladder::print;

use crate::numbers::{Scans, typed};
use crate::support::{PERIOD, circuit, data, findings, program};
use understudy_logic::Running;
use understudy_testing::random::Dice;

/// One contact or coil of a random ladder.
pub(crate) struct Cell {
    id: usize,
    variable: String,
    is_coil: bool,
    negated: bool,
    edge: Option<bool>,
    /// A coil that sets or resets.
    sets: Option<bool>,
    place: (usize, usize),
    /// 0 is the rail.
    sources: Vec<usize>,
}

/// The naive reference: each coil asks for its power, and what was asked for once in a scan is remembered.
struct Naive<'a> {
    cells: &'a [Cell],
    values: HashMap<String, bool>,
    /// The last value of each edge contact.
    last: HashMap<usize, bool>,
    asked: HashMap<usize, bool>,
}

impl Naive<'_> {
    fn power(&mut self, id: usize) -> bool {
        if id == 0 {
            return true;
        }
        if let Some(&known) = self.asked.get(&id) {
            return known;
        }
        let cell = &self.cells[id - 1];
        let mut power = false;
        for source in &cell.sources {
            power |= self.power(*source);
        }
        if !cell.is_coil {
            let value = self.values[&cell.variable];
            let passes = match cell.edge {
                None => value != cell.negated,
                Some(rising) => {
                    let input = value == rising;
                    let last = self.last.insert(id, input).unwrap_or(false);
                    input && !last
                }
            };
            power &= passes;
        }
        self.asked.insert(id, power);
        power
    }

    fn scan(&mut self, order: &[usize]) {
        self.asked.clear();
        for &id in order {
            let power = self.power(id);
            let cell = &self.cells[id - 1];
            let value = match (cell.sets, cell.edge) {
                (Some(sets), _) if power => sets,
                (Some(_), _) => continue,
                (None, None) => power != cell.negated,
                (None, Some(rising)) => {
                    let input = power == rising;
                    let last = self.last.insert(id, input).unwrap_or(false);
                    input && !last
                }
            };
            self.values.insert(cell.variable.clone(), value);
        }
    }
}

pub(crate) fn file(variables: &str, objects: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="utf-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0201" xmlns:xhtml="http://www.w3.org/1999/xhtml">
  <fileHeader companyName="a" productName="b" productVersion="1" creationDateTime="2026-01-01T00:00:00"/>
  <contentHeader name="c"><coordinateInfo><fbd><scaling x="1" y="1"/></fbd><ld><scaling x="1" y="1"/></ld><sfc><scaling x="1" y="1"/></sfc></coordinateInfo></contentHeader>
  <types><dataTypes/><pous><pou name="main" pouType="program"><interface>{variables}</interface><body><LD>
{objects}</LD></body></pou></pous></types>
  <instances><configurations/></instances>
</project>
"#
    )
}

pub(crate) fn variables(list: &[(&str, &str, &str)]) -> String {
    let mut text = String::new();
    for (section, name, kind) in list {
        let _ = write!(
            text,
            "<{section}Vars><variable name=\"{name}\"><type>{kind}</type></variable></{section}Vars>"
        );
    }
    text
}

fn wires(sources: &[usize]) -> String {
    sources.iter().map(|source| format!("<connection refLocalId=\"{source}\"/>")).collect()
}

pub(crate) fn element(cell: &Cell) -> String {
    let name = if cell.is_coil { "coil" } else { "contact" };
    let edge = match cell.edge {
        None => "",
        Some(true) => " edge=\"rising\"",
        Some(false) => " edge=\"falling\"",
    };
    let storage = match cell.sets {
        None => "",
        Some(true) => " storage=\"set\"",
        Some(false) => " storage=\"reset\"",
    };
    format!(
        "<{name} localId=\"{}\" negated=\"{}\"{edge}{storage}><position x=\"{}\" y=\"{}\"/><connectionPointIn>{}</connectionPointIn><connectionPointOut/><variable>{}</variable></{name}>\n",
        cell.id,
        cell.negated,
        cell.place.0,
        cell.place.1,
        wires(&cell.sources),
        cell.variable
    )
}

pub(crate) const RAIL: &str = "<leftPowerRail localId=\"0\"><position x=\"0\" y=\"0\"/><connectionPointOut formalParameter=\"\"/></leftPowerRail>\n";

/// Contacts and coils with wires to what stands to the left of them, and coils in between.
fn random_cells(dice: &mut Dice) -> Vec<Cell> {
    let mut cells: Vec<Cell> = Vec::new();
    let count = 4 + dice.below(14);
    for id in 1..=count {
        let is_coil = id > 3 && dice.rarely(3) || id == count;
        let mut sources: Vec<usize> = (0..1 + dice.below(3)).map(|_| dice.below(id)).collect();
        sources.sort_unstable();
        sources.dedup();
        let names = ["i0", "i1", "i2", "q0", "q1", "m0"];
        let first = if is_coil { 3 } else { 0 };
        let variable = names[first + dice.below(names.len() - first)].to_owned();
        let sets = (is_coil && dice.rarely(2)).then(|| dice.rarely(2));
        let edge = (sets.is_none() && dice.rarely(4)).then(|| dice.rarely(2));
        cells.push(Cell {
            id,
            variable,
            is_coil,
            negated: edge.is_none() && sets.is_none() && dice.rarely(3),
            edge,
            sets,
            place: (id * 10, dice.below(5) * 10),
            sources,
        });
    }
    cells
}

#[test]
fn random_graphs_mean_what_a_naive_walk_finds() {
    let declared = variables(&[
        ("input", "i0", "<BOOL/>"),
        ("input", "i1", "<BOOL/>"),
        ("input", "i2", "<BOOL/>"),
        ("output", "q0", "<BOOL/>"),
        ("output", "q1", "<BOOL/>"),
        ("output", "m0", "<BOOL/>"),
    ]);
    for seed in 0..400 {
        let mut dice = Dice::new(seed);
        let cells = random_cells(&mut dice);
        let objects: String = cells.iter().map(element).collect();
        let text = file(&declared, &format!("{RAIL}{objects}"));
        let circuit = circuit(&text);
        let mut run = Running::new(&circuit);
        let rungs = program(&text).lower(PERIOD).expect("sound rungs");
        let mut rungs = Running::new(&rungs);
        // With a number among its points the file is a program with numbers.
        let numbers = declared.clone() + &variables(&[("output", "n", "<INT/>")]);
        let numbers = typed(&file(&numbers, &format!("{RAIL}{objects}")), PERIOD);
        let mut scans = Scans::new(numbers.expect("it has no errors as a ladder"));
        let mut order: Vec<usize> =
            cells.iter().filter(|cell| cell.is_coil).map(|cell| cell.id).collect();
        order.sort_by_key(|id| (cells[id - 1].place.1, cells[id - 1].place.0));
        let mut naive = Naive {
            cells: &cells,
            values: ["i0", "i1", "i2", "q0", "q1", "m0"]
                .map(|name| (name.to_owned(), false))
                .into(),
            last: HashMap::new(),
            asked: HashMap::new(),
        };
        for scan in 0..24 {
            let inputs = dice.bits(3);
            for (name, value) in ["i0", "i1", "i2"].iter().zip(&inputs) {
                naive.values.insert((*name).to_owned(), *value);
            }
            naive.scan(&order);
            let expected: Vec<bool> =
                ["q0", "q1", "m0"].iter().map(|name| naive.values[*name]).collect();
            assert_eq!(run.step(&inputs), expected, "seed {seed}, scan {scan}\n{objects}");
            assert_eq!(rungs.step(&inputs), expected, "rungs: {seed}, scan {scan}\n{objects}");
            let given: Vec<u64> = inputs.iter().map(|bit| u64::from(*bit)).collect();
            let mut shown = scans.scan(&given);
            assert_eq!(shown.pop(), Some(0));
            let shown: Vec<bool> = shown.iter().map(|bit| *bit != 0).collect();
            assert_eq!(shown, expected, "with numbers: seed {seed}, scan {scan}\n{objects}");
        }
    }
}

#[test]
fn dancing_lights_do_what_another_compiler_s_code_does() {
    let (Some(file), Some(vectors)) =
        (data("ladder/dancinglights/plc.xml"), data("ladder/vectors/dancinglights.json"))
    else {
        return;
    };
    let text = std::fs::read_to_string(file).expect("a file that exists");
    let vectors = std::fs::read_to_string(vectors).expect("a file that exists");
    let vectors: serde_json::Value = serde_json::from_str(&vectors).expect("vectors");
    let circuit = circuit(&text);
    let mut run = Running::new(&circuit);
    let scans = vectors["scans"].as_array().expect("scans");
    for (number, scan) in scans.iter().enumerate() {
        let (inputs, outputs) =
            scan.as_str().and_then(|line| line.split_once(' ')).expect("two words");
        let inputs: Vec<bool> = inputs.chars().map(|bit| bit == '1').collect();
        let shown: String =
            run.step(&inputs).iter().map(|on| if *on { '1' } else { '0' }).collect();
        assert_eq!(shown, outputs, "scan {number}");
    }
    assert!(scans.len() >= 600);
}

/// Reads a ladder of the given variables and objects and shows it as text, with what was found.
fn shown(variables: &str, objects: &str) -> String {
    let text = file(variables, objects);
    let reading = read(&text, None);
    let mut lines = findings(&text, &reading);
    lines.retain(|line| !line.contains("U0151"));
    let notes = reading.fidelity.notes.iter().map(|note| format!("note: {}", note.message));
    lines.extend(notes);
    let program = reading.program.map(|program| print(&program)).unwrap_or_default();
    format!("{}\n{program}", lines.join("\n"))
}

pub(crate) const BITS: [(&str, &str, &str); 4] = [
    ("input", "a", "<BOOL/>"),
    ("input", "b", "<BOOL/>"),
    ("output", "y", "<BOOL/>"),
    ("output", "z", "<BOOL/>"),
];

pub(crate) fn contact(id: usize, variable: &str, sources: &[usize]) -> String {
    element(&Cell {
        id,
        variable: variable.to_owned(),
        is_coil: false,
        negated: false,
        edge: None,
        sets: None,
        place: (id * 10, id * 10),
        sources: sources.to_vec(),
    })
}

pub(crate) fn coil(id: usize, variable: &str, sources: &[usize]) -> String {
    contact(id, variable, sources).replace("contact", "coil")
}

pub(crate) fn block(id: usize, kind: &str, instance: &str, inputs: &[(&str, usize)]) -> String {
    let inputs: String = inputs
        .iter()
        .map(|(pin, source)| format!("<variable formalParameter=\"{pin}\"><connectionPointIn>{}</connectionPointIn></variable>", wires(&[*source])))
        .collect();
    let instance =
        if instance.is_empty() { String::new() } else { format!(" instanceName=\"{instance}\"") };
    format!(
        "<block localId=\"{id}\" typeName=\"{kind}\"{instance}><position x=\"{x}\" y=\"{x}\"/><inputVariables>{inputs}</inputVariables><inOutVariables/><outputVariables/></block>\n",
        x = id * 10
    )
}

pub(crate) fn value(id: usize, expression: &str) -> String {
    format!(
        "<inVariable localId=\"{id}\"><position x=\"{x}\" y=\"{x}\"/><connectionPointOut/><expression>{expression}</expression></inVariable>\n",
        x = id * 10
    )
}

#[test]
fn blocks_stay_in_the_wire() {
    let mut declared = variables(&BITS);
    declared += &variables(&[
        ("local", "T", "<derived name=\"TON\"/>"),
        ("local", "C", "<derived name=\"CTU\"/>"),
    ]);
    let objects = [
        RAIL.to_owned(),
        contact(1, "a", &[0]),
        value(2, "T#1m_30s"),
        block(3, "ton", "t", &[("IN", 1), ("PT", 2)]),
        coil(4, "Y", &[3]),
        value(5, "5"),
        contact(6, "b", &[0]),
        block(7, "CTU", "C", &[("CU", 4), ("R", 6), ("PV", 5)]),
        value(8, "C.CV"),
        value(9, "3"),
        block(10, "GE", "", &[("IN1", 8), ("IN2", 9)]),
        coil(11, "z", &[10]),
    ];
    insta::assert_snapshot!(shown(&declared, &objects.concat()));
}

#[test]
fn functions_of_bits_are_contacts() {
    let objects = [
        RAIL.to_owned(),
        value(1, "a"),
        value(2, "b"),
        block(3, "XOR", "", &[("IN1", 1), ("IN2", 2)]),
        block(4, "NOT", "", &[("IN", 3)]),
        coil(5, "y", &[4]),
        block(6, "OR", "", &[("IN1", 1), ("IN2", 2)]),
        block(7, "SEL", "", &[("G", 6), ("IN0", 1), ("IN1", 2)]),
        coil(8, "z", &[7]),
    ];
    insta::assert_snapshot!(shown(&variables(&BITS), &objects.concat()));
}

#[test]
fn what_a_rung_changes_is_not_read_again_for_its_next_coil() {
    let objects = [
        RAIL.to_owned(),
        contact(1, "a", &[0]),
        element(&Cell { negated: true, ..cell(2, "y", &[1]) }),
        coil(3, "y", &[2]),
        contact(4, "b", &[2]),
        coil(5, "z", &[4]),
    ];
    insta::assert_snapshot!(shown(&variables(&BITS), &objects.concat()));
}

fn cell(id: usize, variable: &str, sources: &[usize]) -> Cell {
    Cell {
        id,
        variable: variable.to_owned(),
        is_coil: false,
        negated: false,
        edge: None,
        sets: None,
        place: (id * 10, id * 10),
        sources: sources.to_vec(),
    }
}

#[test]
fn addresses_and_connectors() {
    let objects = [
        RAIL.to_owned(),
        contact(1, "%IX0.7", &[0]),
        "<connector localId=\"2\" name=\"over there\"><position x=\"20\" y=\"0\"/><connectionPointIn><connection refLocalId=\"1\"/></connectionPointIn></connector>".to_owned(),
        "<continuation localId=\"3\" name=\"over there\"><position x=\"0\" y=\"50\"/><connectionPointOut/></continuation>".to_owned(),
        contact(4, "a", &[3]),
        coil(5, "%QX1.0", &[4]),
    ];
    insta::assert_snapshot!(shown(&variables(&BITS), &objects.concat()));
}

/// A chart of a parallel branch: two steps run together until both are done.
const CHART: &str = r#"<SFC>
<step localId="1" name="rest" initialStep="true"><position x="0" y="0"/><connectionPointOut formalParameter=""/><connectionPointOutAction formalParameter=""/></step>
<transition localId="2"><position x="0" y="10"/><connectionPointIn><connection refLocalId="1"/></connectionPointIn><connectionPointOut/><condition><reference name="begin"/></condition></transition>
<simultaneousDivergence localId="3"><position x="0" y="20"/><connectionPointIn><connection refLocalId="2"/></connectionPointIn><connectionPointOut formalParameter=""/></simultaneousDivergence>
<step localId="4" name="left"><position x="0" y="30"/><connectionPointIn><connection refLocalId="3"/></connectionPointIn><connectionPointOut formalParameter=""/><connectionPointOutAction formalParameter=""/></step>
<step localId="5" name="right"><position x="50" y="30"/><connectionPointIn><connection refLocalId="3"/></connectionPointIn><connectionPointOut formalParameter=""/><connectionPointOutAction formalParameter=""/></step>
<simultaneousConvergence localId="6"><position x="0" y="40"/><connectionPointIn><connection refLocalId="4"/></connectionPointIn><connectionPointIn><connection refLocalId="5"/></connectionPointIn><connectionPointOut/></simultaneousConvergence>
<transition localId="7"><position x="0" y="50"/><connectionPointIn><connection refLocalId="6"/></connectionPointIn><connectionPointOut/><condition><inline name=""><ST><xhtml:p>b AND right.X</xhtml:p></ST></inline></condition></transition>
<jumpStep localId="8" targetName="rest"><position x="0" y="60"/><connectionPointIn><connection refLocalId="7"/></connectionPointIn></jumpStep>
<actionBlock localId="9"><position x="90" y="30"/><connectionPointIn><connection refLocalId="4"/></connectionPointIn><action localId="0"><relPosition x="0" y="0"/><reference name="work"/></action></actionBlock>
<actionBlock localId="10"><position x="90" y="40"/><connectionPointIn><connection refLocalId="5"/></connectionPointIn><action localId="0" qualifier="D" duration="T#200ms"><relPosition x="0" y="0"/><reference name="z"/></action></actionBlock>
</SFC>"#;

#[test]
fn a_sequence_steps_as_its_chart_says() {
    let declared = variables(&[
        ("input", "a", "<BOOL/>"),
        ("input", "b", "<BOOL/>"),
        ("output", "y", "<BOOL/>"),
        ("output", "z", "<BOOL/>"),
    ]);
    let coils = [RAIL.to_owned(), contact(1, "a", &[0]), coil(2, "begin", &[1])].concat();
    let actions = format!(
        "<actions><action name=\"work\"><body><LD>{RAIL}{}{}</LD></body></action></actions>",
        contact(1, "b", &[0]),
        coil(2, "y", &[1])
    );
    let transitions = format!(
        "<transitions><transition name=\"begin\"><body><LD>{coils}</LD></body></transition></transitions>"
    );
    let text = file(&declared, "").replace(
        "<body><LD>\n</LD></body>",
        &format!("{actions}{transitions}<body>{CHART}</body>"),
    );
    let circuit = circuit(&text);
    let mut run = Running::new(&circuit);
    // a, b and then y, z: both branches begin together; y follows b while its step is active and is left as it is after that; z comes
    // two scans after its step.
    let scans = [
        ("00", "00"),
        ("01", "00"),
        ("10", "00"),
        ("00", "00"),
        ("00", "01"),
        ("00", "01"),
        ("01", "00"),
        ("11", "10"),
        ("01", "10"),
    ];
    for (number, (inputs, outputs)) in scans.iter().enumerate() {
        let inputs: Vec<bool> = inputs.chars().map(|bit| bit == '1').collect();
        let shown: String =
            run.step(&inputs).iter().map(|on| if *on { '1' } else { '0' }).collect();
        assert_eq!(shown, *outputs, "scan {number}");
    }
}

#[test]
fn units_of_the_file_stand_in_place_of_their_calls() {
    let path = format!("{}/../../examples/plcopen/probes.xml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).expect("an example");
    let circuit = circuit(&text);
    let mut run = Running::new(&circuit);
    let mut dice = Dice::new(3);
    let mut doubts = 0;
    for scan in 0..200 {
        let [a, b, c] = [dice.rarely(6), dice.rarely(6), false];
        doubts = if a != b || a != c { (doubts + 1).min(9) } else { 0 };
        let agreed = u8::from(a) + u8::from(b) + u8::from(c) >= 2;
        let expected = vec![agreed, doubts >= 5];
        assert_eq!(run.step(&[a, b, c]), expected, "scan {scan}");
    }
}

#[test]
fn a_number_that_comes_from_outside_is_no_preset() {
    let mut declared = variables(&BITS);
    declared += &variables(&[("input", "n", "<INT/>"), ("local", "C", "<derived name=\"CTU\"/>")]);
    let objects = [
        RAIL.to_owned(),
        contact(1, "a", &[0]),
        value(2, "n"),
        block(3, "CTU", "C", &[("CU", 1), ("PV", 2)]),
        coil(4, "y", &[3]),
    ];
    // It is counted to all the same, but as a number of the plant: Structured Text has statements for it.
    let text = file(&declared, &objects.concat());
    let reading = read(&text, None);
    let program = reading.program.as_ref();
    let inputs = program.map(|program| program.inputs.len());
    assert!(inputs.is_none_or(|inputs| inputs > 2), "{:?}", findings(&text, &reading));
}

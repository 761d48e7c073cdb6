//! Rungs that jumps and returns skip, and blocks that EN calls or not: against a naive scan, rung by rung.

use std::collections::HashMap;
use std::fmt::Write;

use understudy_interchange::plcopen::read;
use understudy_interchange::{Bodies, Format, Wanted, typed_text};

use crate::meaning::{RAIL, block, coil, contact, file, value, variables};
use crate::support::{circuit, findings};
use understudy_logic::Running;
use understudy_testing::random::Dice;

const INPUTS: [&str; 3] = ["i0", "i1", "i2"];
const OUTPUTS: [&str; 3] = ["q0", "q1", "q2"];

/// What a rung does, with the variable of its contact.
#[derive(Debug)]
enum Rung {
    Coil(&'static str, &'static str),
    /// A contact on a rising edge.
    Edge(&'static str, &'static str),
    /// A TON of its own: EN, IN, the coil behind it, PT in scans.
    Timer(&'static str, &'static str, &'static str, u64),
    /// A CTU of its own, up to 2.
    Counter(&'static str, &'static str, &'static str),
    Label(usize),
    /// To a label further down.
    Jump(&'static str, usize),
    Return(&'static str),
}

fn rungs(dice: &mut Dice) -> Vec<Rung> {
    let all: Vec<&'static str> = INPUTS.into_iter().chain(OUTPUTS).collect();
    let count = 3 + dice.below(8);
    let mut labels = 0;
    let mut rungs = Vec::new();
    // From below: a jump knows the labels behind it.
    for _ in 0..count {
        let (read, written) = (dice.pick(&all), dice.pick(&OUTPUTS));
        rungs.push(match dice.below(8) {
            0 | 1 => Rung::Coil(read, written),
            2 => Rung::Edge(read, written),
            3 => Rung::Timer(read, dice.pick(&all), written, dice.below(4) as u64),
            4 => Rung::Counter(read, dice.pick(&all), written),
            5 if labels > 0 => Rung::Jump(read, dice.below(labels)),
            6 if dice.rarely(2) => Rung::Return(read),
            _ => {
                labels += 1;
                Rung::Label(labels - 1)
            }
        });
    }
    rungs.reverse();
    rungs
}

fn drawn(rungs: &[Rung]) -> String {
    let mut objects = RAIL.to_owned();
    for (place, rung) in rungs.iter().enumerate() {
        let id = 1 + 10 * place;
        let at = |id: usize| format!("<position x=\"{0}\" y=\"{0}\"/>", id * 10);
        let end = |name: &str, label: String| {
            format!(
                "<{name} localId=\"{}\"{label}>{}<connectionPointIn><connection refLocalId=\"{id}\"/></connectionPointIn></{name}>\n",
                id + 1,
                at(id + 1)
            )
        };
        match rung {
            Rung::Coil(read, written) => {
                objects += &contact(id, read, &[0]);
                objects += &coil(id + 1, written, &[id]);
            }
            Rung::Edge(read, written) => {
                objects +=
                    &contact(id, read, &[0]).replace("<contact ", "<contact edge=\"rising\" ");
                objects += &coil(id + 1, written, &[id]);
            }
            Rung::Timer(enable, read, written, scans) => {
                objects += &contact(id, enable, &[0]);
                objects += &contact(id + 1, read, &[0]);
                objects += &value(id + 2, &format!("T#{}ms", scans * 100));
                let pins = [("EN", id), ("IN", id + 1), ("PT", id + 2)];
                objects += &block(id + 3, "TON", &format!("b{place}"), &pins);
                objects += &coil(id + 4, written, &[id + 3]);
            }
            Rung::Counter(enable, read, written) => {
                objects += &contact(id, enable, &[0]);
                objects += &contact(id + 1, read, &[0]);
                objects += &value(id + 2, "2");
                let pins = [("EN", id), ("CU", id + 1), ("PV", id + 2)];
                objects += &block(id + 3, "CTU", &format!("b{place}"), &pins);
                objects += &coil(id + 4, written, &[id + 3]);
            }
            Rung::Label(label) => {
                let _ = writeln!(
                    objects,
                    "<label localId=\"{id}\" label=\"L{label}\">{}</label>",
                    at(id)
                );
            }
            Rung::Jump(read, label) => {
                objects += &contact(id, read, &[0]);
                objects += &end("jump", format!(" label=\"L{label}\""));
            }
            Rung::Return(read) => {
                objects += &contact(id, read, &[0]);
                objects += &end("return", String::new());
            }
        }
    }
    objects
}

/// A block between its calls.
#[derive(Default)]
struct Kept {
    /// Of the last call.
    input: bool,
    start: u64,
    count: u8,
    over: bool,
}

#[derive(Default)]
struct Naive {
    now: u64,
    values: HashMap<&'static str, bool>,
    blocks: HashMap<usize, Kept>,
}

impl Naive {
    fn is(&self, name: &str) -> bool {
        self.values.get(name).copied().unwrap_or(false)
    }

    fn scan(&mut self, rungs: &[Rung]) {
        let mut target = None;
        for (place, rung) in rungs.iter().enumerate() {
            if let Some(label) = target {
                if !matches!(rung, Rung::Label(found) if *found == label) {
                    continue;
                }
                target = None;
            }
            let block = self.blocks.entry(place).or_default();
            let is = |name: &str| self.values.get(name).copied().unwrap_or(false);
            match rung {
                Rung::Coil(read, written) => {
                    let power = is(read);
                    self.values.insert(written, power);
                }
                Rung::Edge(read, written) => {
                    let power = is(read) && !block.input;
                    block.input = is(read);
                    self.values.insert(written, power);
                }
                Rung::Timer(enable, read, written, scans) => {
                    if is(enable) {
                        let input = is(read);
                        let begins = input && !block.input;
                        if begins {
                            block.start = self.now;
                        }
                        // It looks at the clock from the call after its start.
                        block.over = input && !begins && block.start + scans <= self.now;
                        block.input = input;
                    }
                    self.values.insert(written, block.over);
                }
                Rung::Counter(enable, read, written) => {
                    if is(enable) {
                        let up = is(read) && !block.input;
                        block.input = is(read);
                        block.count = (block.count + u8::from(up)).min(2);
                        block.over = block.count == 2;
                    }
                    self.values.insert(written, block.over);
                }
                Rung::Label(_) => {}
                Rung::Jump(read, label) => target = is(read).then_some(*label),
                Rung::Return(read) => {
                    if is(read) {
                        break;
                    }
                }
            }
        }
        self.now += 1;
    }
}

#[test]
fn what_is_skipped_and_what_is_not_called_stays_as_it_is() {
    let mut declared = String::new();
    for (section, names) in [("input", INPUTS), ("output", OUTPUTS)] {
        declared += &variables(&names.map(|name| (section, name, "<BOOL/>")));
    }
    for seed in 0..120 {
        let mut dice = Dice::new(seed);
        let rungs = rungs(&mut dice);
        let mut all = declared.clone();
        for (place, rung) in rungs.iter().enumerate() {
            let kind = match rung {
                Rung::Timer(..) => "<derived name=\"TON\"/>",
                Rung::Counter(..) => "<derived name=\"CTU\"/>",
                _ => continue,
            };
            all += &variables(&[("local", &format!("b{place}"), kind)]);
        }
        let text = file(&all, &drawn(&rungs));
        let circuit = circuit(&text);
        let mut run = Running::new(&circuit);
        let mut naive = Naive::default();
        for scan in 0..30 {
            let inputs = dice.bits(INPUTS.len());
            naive.values.extend(INPUTS.into_iter().zip(inputs.iter().copied()));
            naive.scan(&rungs);
            assert_eq!(
                run.step(&inputs),
                OUTPUTS.map(|name| naive.is(name)),
                "seed {seed}, scan {scan}: {rungs:#?}"
            );
        }
    }
}

#[test]
fn jumps_that_are_not_taken_are_said() {
    let declared = variables(&[("input", "i0", "<BOOL/>"), ("output", "q0", "<BOOL/>")]);
    let jump = |id: usize, label: &str| {
        format!(
            "<jump localId=\"{id}\" label=\"{label}\"><position x=\"{0}\" y=\"{0}\"/><connectionPointIn><connection refLocalId=\"3\"/></connectionPointIn></jump>\n",
            id * 10
        )
    };
    let label = |id: usize, name: &str| {
        format!(
            "<label localId=\"{id}\" label=\"{name}\"><position x=\"{0}\" y=\"{0}\"/></label>\n",
            id * 10
        )
    };
    let objects = [
        RAIL.to_owned(),
        label(1, "again"),
        contact(3, "i0", &[0]),
        jump(4, "again"),
        jump(5, "nowhere"),
        jump(6, "end"),
        contact(7, "i0", &[0]).replace("<contact ", "<contact edge=\"rising\" "),
        coil(8, "q0", &[7]),
        label(9, "end"),
        label(10, "end"),
        coil(11, "q0", &[7]),
    ];
    let text = file(&declared, &objects.concat());
    let found = findings(&text, &read(&text, None));
    insta::assert_snapshot!(found.join("\n"));
}

#[test]
fn comments_stay_above_what_they_stand_above() {
    let declared = variables(&[("input", "i0", "<BOOL/>"), ("output", "q0", "<BOOL/>")]);
    let comment = |id: usize, text: &str| {
        format!(
            "<comment localId=\"{id}\" height=\"9\" width=\"9\"><position x=\"{0}\" y=\"{0}\"/><content><xhtml:p>{text}</xhtml:p></content></comment>\n",
            id * 10
        )
    };
    let objects = [
        RAIL.to_owned(),
        contact(1, "i0", &[0]),
        "<jump localId=\"2\" label=\"end\"><position x=\"20\" y=\"20\"/><connectionPointIn><connection refLocalId=\"1\"/></connectionPointIn></jump>".to_owned(),
        comment(3, "What (*is*) skipped"),
        contact(4, "i0", &[0]),
        coil(5, "q0", &[4]),
        "<label localId=\"6\" label=\"end\"><position x=\"60\" y=\"60\"/></label>".to_owned(),
    ];
    let text = file(&declared, &objects.concat());
    let form = Format::StructuredText;
    let written = typed_text("file.xml", &text, Wanted::default(), form, Bodies::AsRead);
    let written = written.expect("a text").0.expect("a program").text;
    let lines: Vec<&str> = written.lines().map(str::trim).collect();
    let place = lines.iter().position(|line| line.starts_with("(* What"));
    let place = place.unwrap_or_else(|| panic!("no comment: {written}"));
    assert!(lines[place].contains("skipped"), "{written}");
    assert!(lines[place + 1].starts_with("q0 := i0"), "{written}");
}

//! Random programs: what they do is what a naive execution of their elements does.

use std::collections::HashMap;

use proptest::prelude::*;
use understudy_bits::exact;
use understudy_testing::random::Dice;

use crate::{Running, program};

enum Element {
    Contacts(&'static str, bool),
    Coil(&'static str, usize),
    Shot(bool, usize),
    /// On delay or off delay, its number, its cycles.
    Timer(bool, usize, u64),
    /// CTU, CTD or CTC with its number among them.
    Counter(&'static str, usize, i64),
    Reset,
    Move(i64),
    Compare(&'static str, i64),
    Master,
    Parallel(Vec<Vec<Element>>),
}

const BITS: [&str; 6] = ["Xa", "Xb", "Yc", "Yd", "Re", "Rf"];
const WRITTEN: [&str; 4] = ["Yc", "Yd", "Re", "Rf"];

struct Maker {
    dice: Dice,
    count: usize,
    counters: &'static [&'static str],
}

impl Maker {
    fn series(&mut self, depth: usize, least: usize) -> Vec<Element> {
        let length = least + self.dice.below(3);
        (0..length).map(|_| self.element(depth)).collect()
    }

    fn element(&mut self, depth: usize) -> Element {
        self.count += 1;
        let count = self.count;
        let dice = &mut self.dice;
        let value = i64::try_from(dice.below(6)).expect("small") - 1;
        match dice.below(if depth == 0 { 14 } else { 18 }) {
            0..=4 => Element::Contacts(BITS[dice.below(6)], dice.below(2) == 1),
            5..=7 => Element::Coil(WRITTEN[dice.below(4)], dice.below(4)),
            8 => Element::Shot(dice.below(2) == 1, count),
            9 => Element::Timer(dice.below(2) == 1, count, 1 + dice.below(3) as u64),
            10 => Element::Counter(self.counters[dice.below(self.counters.len())], count, value),
            11 => {
                Element::Compare(["EQU", "NEQ", "GRT", "GEQ", "LES", "LEQ"][dice.below(6)], value)
            }
            12 if dice.below(3) == 0 => Element::Master,
            12 => Element::Reset,
            13 => Element::Move(value),
            _ => {
                let branches = 2 + self.dice.below(2);
                Element::Parallel((0..branches).map(|_| self.series(depth - 1, 1)).collect())
            }
        }
    }
}

fn write(series: &[Element], text: &mut String) {
    for element in series {
        let line = match element {
            Element::Contacts(name, negated) => format!("CONTACTS {name} {}", u8::from(*negated)),
            Element::Coil(name, kind) => {
                format!("COIL {name} {}", ["0 0 0", "1 0 0", "0 1 0", "0 0 1"][*kind])
            }
            Element::Shot(rising, _) => if *rising { "OSR" } else { "OSF" }.to_owned(),
            Element::Timer(on, number, cycles) => {
                format!("{} Tt{number} {}", if *on { "TON" } else { "TOF" }, cycles * 10_000)
            }
            Element::Counter(word, _, value) => format!("{word} Cn {value}"),
            Element::Reset => "RES Cn".to_owned(),
            Element::Move(value) => format!("MOVE Cn {value}"),
            Element::Compare(word, value) => format!("{word} Cn {value}"),
            Element::Master => "MASTER_RELAY".to_owned(),
            Element::Parallel(branches) => {
                text.push_str("PARALLEL\n");
                for branch in branches {
                    text.push_str("SERIES\n");
                    write(branch, text);
                    text.push_str("END\n");
                }
                "END".to_owned()
            }
        };
        text.push_str(&line);
        text.push('\n');
    }
}

#[derive(Default)]
struct Execution {
    bits: HashMap<&'static str, bool>,
    number: i64,
    /// What an element remembers, by its number.
    before: HashMap<usize, bool>,
    cycles: HashMap<usize, u64>,
    runs: bool,
}

impl Execution {
    fn series(&mut self, series: &[Element], mut power: bool) -> bool {
        for element in series {
            power = self.element(element, power);
        }
        power
    }

    fn element(&mut self, element: &Element, power: bool) -> bool {
        match element {
            Element::Contacts(name, negated) => {
                power && self.bits.get(name).copied().unwrap_or(false) != *negated
            }
            Element::Coil(name, kind) => {
                match (kind, power) {
                    (0, _) => drop(self.bits.insert(name, power)),
                    (1, _) => drop(self.bits.insert(name, !power)),
                    (2, true) => drop(self.bits.insert(name, true)),
                    (3, true) => drop(self.bits.insert(name, false)),
                    _ => {}
                }
                power
            }
            Element::Shot(rising, number) => {
                let before = self.before.insert(*number, power).unwrap_or(false);
                if *rising { power && !before } else { !power && before }
            }
            Element::Timer(true, number, most) => {
                let cycles = self.cycles.entry(*number).or_default();
                let full = *cycles == *most;
                *cycles = if power { (*cycles + 1).min(*most) } else { 0 };
                power && full
            }
            Element::Timer(false, number, most) => {
                // It starts as one whose time is over.
                let cycles = self.cycles.entry(*number).or_insert(*most);
                let full = *cycles == *most;
                *cycles = if power { 0 } else { (*cycles + 1).min(*most) };
                power || !full
            }
            Element::Counter(word, number, value) => {
                let before = self.before.insert(*number, power).unwrap_or(false);
                if power && !before {
                    self.number += if *word == "CTD" { -1 } else { 1 };
                    if *word == "CTC" && self.number > *value {
                        self.number = 0;
                    }
                }
                if *word == "CTC" { power } else { self.number >= *value }
            }
            Element::Reset => {
                if power {
                    self.number = 0;
                }
                power
            }
            Element::Move(value) => {
                if power {
                    self.number = *value;
                }
                power
            }
            Element::Compare(word, value) => {
                power
                    && match *word {
                        "EQU" => self.number == *value,
                        "NEQ" => self.number != *value,
                        "GRT" => self.number > *value,
                        "GEQ" => self.number >= *value,
                        "LES" => self.number < *value,
                        _ => self.number <= *value,
                    }
            }
            Element::Master => {
                self.runs = !self.runs || power;
                power
            }
            Element::Parallel(branches) => {
                let mut any = false;
                for branch in branches {
                    any |= self.series(branch, power);
                }
                any
            }
        }
    }
}

fn check(seed: u64) {
    let mut maker = Maker {
        dice: Dice::new(seed),
        count: 0,
        // One that only counts one way takes no more bits than its comparisons tell apart.
        counters: [&["CTU"][..], &["CTD"], &["CTC"], &["CTU", "CTD", "CTC"]]
            [usize::try_from(seed % 4).expect("small")],
    };
    let rungs: Vec<Vec<Element>> =
        (0..1 + maker.dice.below(5)).map(|_| maker.series(2, 1)).collect();
    let mut text =
        "LDmicro0.1\nCYCLE=10000\nIO LIST\nXa at 1\nXb at 2\nYc at 3\nYd at 4\nEND\nPROGRAM\n"
            .to_owned();
    for rung in &rungs {
        text.push_str("RUNG\n");
        write(rung, &mut text);
        text.push_str("END\n");
    }
    let program = program(&text);
    let mut running = Running::new(program.clone());
    let mut circuit = understudy_logic::Running::new(&exact(&program).expect("a circuit"));
    let mut execution = Execution::default();
    for scan in 0..40 {
        let all = maker.dice.bits(2);
        execution.bits.extend([("Xa", all[0]), ("Xb", all[1])]);
        execution.runs = true;
        for rung in &rungs {
            let rail = execution.runs;
            execution.series(rung, rail);
        }
        let named = program.inputs.iter().filter(|point| point.slot != 0);
        let inputs: Vec<bool> = named.map(|input| execution.bits[input.name.as_str()]).collect();
        let found = running.scan(&inputs);
        assert_eq!(circuit.step(&inputs), found);
        let outputs = program
            .outputs
            .iter()
            .filter(|point| point.slot != 0)
            .map(|output| execution.bits.get(output.name.as_str()).copied());
        let expected: Vec<bool> = outputs.map(Option::unwrap_or_default).collect();
        assert_eq!(found, expected, "cycle {scan}\n{text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_program_scans_as_its_elements_execute(seed: u64) {
        check(seed);
    }
}

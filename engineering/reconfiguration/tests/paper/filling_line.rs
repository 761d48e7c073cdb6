//! The filling line of section 7 as its tables have it.

use std::sync::Arc;

use understudy_reconfiguration::{Bits, Controller, Event, Relation, Row, Signals, State};

pub(crate) fn signals() -> Signals {
    let names = |text: &str| text.split(' ').map(str::to_owned).collect();
    Signals {
        inputs: names("Ready ps1 ps2 Filling_done Weight_recd"),
        outputs: names("Motor Filling Weighing Print"),
    }
}

/// Table 4. Row 11 as it stands there; Table 6 misprints it.
pub(crate) const STATES: [&str; 12] = [
    "00000_0000",
    "10000_1000",
    "00000_1000",
    "01000_0000",
    "01000_0100",
    "01010_0010",
    "01000_0010",
    "01001_1000",
    "01000_1000",
    "01100_0001",
    "01100_0000",
    "01100_0100",
];

/// Figure 6 is lost; these are the moves that Table 6 has a 1 for, by the numbers of Table 4, and ω where the outputs differ and
/// the inputs do not. From state 12 both ps2- and Filling_done+ are enabled and every other vector is missing from
/// Table 4, so the two change in one scan.
pub(crate) const MOVES: [(usize, usize); 13] = [
    (1, 2),
    (2, 3),
    (3, 4),
    (4, 5),
    (4, 10),
    (5, 6),
    (6, 7),
    (7, 8),
    (8, 9),
    (9, 3),
    (10, 11),
    (11, 12),
    (12, 6),
];

pub(crate) fn controller() -> Controller {
    let state = |text: &&str| {
        let (inputs, outputs) = text.split_once('_').expect("a vector");
        State {
            inputs: Bits::parse(inputs).expect("bits"),
            outputs: Bits::parse(outputs).expect("bits"),
            memory: Vec::new(),
            sibling: 0,
        }
    };
    let moves = MOVES.iter().map(|(from, to)| (from - 1, to - 1));
    Controller::new(signals(), Vec::new(), STATES.iter().map(state).collect(), moves)
}

/// Table 5.
pub(crate) fn relation() -> Relation {
    let signals = signals();
    let mut relation = Relation::new(STATES.len());
    let mut set = |name: &str, output: usize, except: &[usize]| {
        let event: Event = signals.event(name).expect("an event");
        let mut row = vec![None; 4];
        row[output] = Some(true);
        let rows: Arc<[Row]> = [Row(row)].into();
        for state in (1..=12).filter(|state| !except.contains(state)) {
            relation.set(state - 1, event, rows.clone());
        }
    };
    set("ps1+", 0, &[]);
    set("ps1-", 0, &[]);
    set("ps2+", 0, &[4, 10, 11, 12]);
    set("ps2-", 0, &[4, 10, 11, 12]);
    set("Filling_done+", 1, &[]);
    set("Weight_recd+", 2, &[]);
    relation
}

//! Examples 1 and 2, and the integer program against trying all outputs.

use std::sync::Arc;

use proptest::prelude::*;
use understudy_reconfiguration::command::{Demand, Unsolved, solve};
use understudy_reconfiguration::{
    Bits, Controller, Event, Feedback, Relation, Row, Signals, State, feedback,
};

/// `1 dc 0; dc 1 1`
fn rows(text: &str) -> Arc<[Row]> {
    let entry = |word: &str| match word {
        "1" => Some(true),
        "0" => Some(false),
        _ => None,
    };
    let row = |text: &str| Row(text.split_whitespace().map(entry).collect());
    text.split(';').map(row).collect()
}

fn demand(text: &str, enable: bool) -> Demand {
    Demand { rows: rows(text), enable }
}

#[test]
fn example_2_activates_outputs_1_and_3() {
    let demands = [
        demand("1 dc dc dc; dc 1 1 dc; 1 0 1 dc", true),
        demand("0 dc dc dc; 1 0 dc 1", false),
        demand("dc 0 dc dc; dc dc 0 0", true),
        demand("dc 0 1 0", true),
        demand("1 0 dc 1", false),
        demand("1 dc 1 0", true),
    ];
    let outputs = solve(&demands, &[1.0; 4]).expect("it is feasible");
    assert_eq!(outputs.to_string(), "1010");
}

#[test]
fn example_1_cannot_be_combined_on_outputs() {
    let signals =
        Signals { inputs: vec!["i1".into(), "i2".into()], outputs: vec!["o1".into(), "o2".into()] };
    // e1 is i1+, e2 is i2+.
    let (e1, e2) = (Event::Rises(0), Event::Rises(1));
    let state = |inputs, outputs| State {
        inputs: Bits::parse(inputs).expect("bits"),
        outputs: Bits::parse(outputs).expect("bits"),
        memory: Vec::new(),
        sibling: 0,
    };
    let states = vec![state("00", "10"), state("01", "00")];
    let controller = Controller::new(signals, Vec::new(), states, [(0, 1)]);
    let mut relation = Relation::new(2);
    relation.set(0, e1, rows("dc 1"));
    relation.set(1, e1, rows("1 1"));
    relation.set(0, e2, rows("dc 0"));
    relation.set(1, e2, rows("dc 0"));
    let table: Vec<&str> = [(0, e1), (0, e2), (1, e1), (1, e2)]
        .map(|(state, event)| feedback(&controller, &relation, state, event).text())
        .to_vec();
    assert_eq!(table, ["0", "1", "0", "dc"], "Table 2");
    assert_eq!(feedback(&controller, &relation, 0, Event::Falls(0)), Feedback::DontCare);
    // Free of conflicts on events; on outputs o1 differs, and there is still a command for both.
    assert_ne!(controller.states()[0].outputs, controller.states()[1].outputs);
    let demands = [demand("dc 1", false), demand("dc 0", true), demand("1 1", false)];
    assert_eq!(solve(&demands, &[1.0; 2]).expect("feasible").to_string(), "00");
}

#[test]
fn a_conflict_is_shown_by_its_rows() {
    let demands = [
        demand("1 dc", true),
        demand("dc 1", true),
        demand("dc 0", true),
        demand("0 dc; dc dc", true),
    ];
    assert_eq!(solve(&demands, &[1.0; 2]), Err(Unsolved::Conflict(vec![1, 2])));
}

#[test]
fn weights_choose_among_what_is_safe() {
    let either = [demand("1 dc; dc 1", true)];
    assert_eq!(solve(&either, &[2.0, 1.0]).expect("feasible").to_string(), "01");
    assert_eq!(solve(&either, &[1.0, 2.0]).expect("feasible").to_string(), "10");
    // Nearest to outputs that are on is a negative weight.
    assert_eq!(solve(&either, &[-1.0, -1.0]).expect("feasible").to_string(), "11");
}

fn any_demands() -> impl Strategy<Value = (usize, Vec<Demand>)> {
    (1_usize..=5).prop_flat_map(|outputs| {
        let entry = prop_oneof![2 => Just(None), 1 => Just(Some(true)), 1 => Just(Some(false))];
        let row = prop::collection::vec(entry, outputs).prop_map(Row);
        let rows = prop::collection::vec(row, 1..=3).prop_map(Arc::from);
        let demand = (rows, any::<bool>()).prop_map(|(rows, enable)| Demand { rows, enable });
        (Just(outputs), prop::collection::vec(demand, 0..=6))
    })
}

fn all_outputs(width: usize) -> impl Iterator<Item = Bits> {
    (0..1_usize << width).map(move |bits| Bits((0..width).map(|k| bits >> k & 1 == 1).collect()))
}

fn feasible(demands: &[&Demand], width: usize) -> Option<usize> {
    all_outputs(width)
        .filter(|outputs| demands.iter().all(|demand| demand.is_met(outputs)))
        .map(|outputs| outputs.0.iter().filter(|bit| **bit).count())
        .min()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn the_program_finds_what_trying_all_outputs_finds((width, demands) in any_demands()) {
        let all: Vec<&Demand> = demands.iter().collect();
        match solve(&demands, &vec![1.0; width]) {
            Ok(outputs) => {
                prop_assert!(demands.iter().all(|demand| demand.is_met(&outputs)));
                let active = outputs.0.iter().filter(|bit| **bit).count();
                prop_assert_eq!(Some(active), feasible(&all, width));
            }
            Err(Unsolved::Conflict(places)) => {
                prop_assert_eq!(feasible(&all, width), None);
                let kept: Vec<&Demand> = places.iter().map(|&place| &demands[place]).collect();
                prop_assert_eq!(feasible(&kept, width), None);
                for spared in 0..kept.len() {
                    let mut rest = kept.clone();
                    rest.remove(spared);
                    prop_assert!(feasible(&rest, width).is_some());
                }
            }
            Err(Unsolved::Solver(message)) => prop_assert!(false, "{}", message),
        }
    }
}

//! The history of a program against the naive scan of its ladder.

use std::sync::Arc;

use understudy_journal::moment;
use understudy_ladder::Interpreter;
use understudy_scenarios::{Network, Scenario};
use understudy_view::{Bounds, Model};
use understudy_wire::ProgramId;

use crate::support::{KILL_EACH, cell, model, records, scenario};

/// From the first sample on, every step is the naive interpreter's: outputs, and the power in every element.
#[test]
fn every_scan_is_the_one_that_was_evaluated() {
    let cell = cell();
    let model = model(&cell, &scenario(&cell, KILL_EACH), 1);
    let period = cell.agreement().schedule.period();
    for (place, controller) in cell.controllers().iter().enumerate() {
        let program = ProgramId(place as u8);
        let history = model.history(program).expect("it is there");
        assert!(!history.is_cut());
        let ladder = controller.ladder().expect("a ladder");
        let mut naive = Interpreter::new(ladder, period).expect("a right program");
        let mut scans = 0;
        for step in history.steps() {
            let Some(sampled) = &step.sampled else {
                continue;
            };
            assert!(!step.void);
            let inputs: Vec<bool> = sampled.inputs.bits().collect();
            let expected = naive.scan_observed(&inputs);
            let found = model.evaluation(program, step.cycle).expect("it is known");
            assert_eq!(found, expected, "{} in cycle {}", controller.name, step.cycle);
            let outputs: Vec<bool> = sampled.outputs.bits().collect();
            assert_eq!(outputs, expected.outputs);
            if let Some(driven) = &step.driven {
                assert_eq!(driven.outputs, sampled.outputs);
            }
            scans += 1;
        }
        assert!(scans >= 300, "{scans}");
    }
}

/// On a network that loses and reorders frames no word of a sound station differs from what the samples lead to, and nothing is
/// wrong; whatever was void is known to be.
#[test]
fn loss_is_no_value_fault() {
    let cell = cell();
    for seed in 0..20 {
        let network = Network { loss: 0.2, ..Network::default() };
        let lossy = Scenario {
            title: "lossy".into(),
            cycles: 120,
            network: Some(network),
            network_cycles: Some(0..100),
            ..Scenario::default()
        };
        let model = model(&cell, &lossy, seed);
        let wrong: Vec<_> = model
            .events()
            .filter(|event| ["word-differs", "wrong"].contains(&event.event))
            .collect();
        assert_eq!(wrong, Vec::<&understudy_view::Event>::new(), "seed {seed}");
        for program in 0..2 {
            let history = model.history(ProgramId(program)).expect("it is there");
            let chain: Vec<_> = history
                .steps()
                .iter()
                .filter(|step| !step.void)
                .filter_map(|step| step.sampled.as_ref())
                .collect();
            for pair in chain.windows(2) {
                assert_eq!(pair[0].after, pair[1].before, "seed {seed}");
            }
        }
    }
}

/// Whoever begins to listen in the middle of a run follows each program from the first state that a station tells, as whoever heard it all.
#[test]
fn a_journal_that_begins_in_the_middle_is_followed_from_a_state_that_was_told() {
    let cell = cell();
    let text = "title = \"a kill\"\ncycles = 700\n\
                [[step]]\nat = 500\naction = \"crash\"\nstation = \"press\"\n";
    let scenario = scenario(&cell, text);
    let all = records(&cell, &scenario, 1);
    let whole = model(&cell, &scenario, 1);
    let moment_of = |cycle| {
        let history = whole.history(ProgramId(0)).expect("it is there");
        history.at(cycle).expect("it is remembered").moment
    };
    // At several places between two of the records that tell of states.
    for begins in [100, 199, 200, 201, 255, 390] {
        let first = all.iter().position(|record| moment(&record.event) == Some(moment_of(begins)));
        let mut heard = Model::new(Arc::new(cell.clone()), Bounds::default());
        for record in all.iter().skip(first.expect("it is told of")) {
            heard.note(record);
        }
        for place in 0..cell.controllers().len() {
            let program = ProgramId(place as u8);
            let histories =
                [&whole, &heard].map(|model| model.history(program).expect("it is there"));
            let [complete, later] = histories;
            let mut known = 0;
            for step in later.steps() {
                let Some(sampled) = &step.sampled else {
                    assert_eq!(known, 0, "once known, it stays so");
                    continue;
                };
                let mut steps = complete.steps().iter();
                let same = steps.find(|same| same.moment == step.moment);
                assert_eq!(Some(sampled), same.and_then(|same| same.sampled.as_ref()));
                known += 1;
            }
            assert!(known >= 290, "{known} of those after {begins}");
        }
        let alarms: Vec<&str> = heard.alarms().map(|alarm| alarm.alarm).collect();
        assert_eq!(alarms, ["unprotected"], "what was not heard is no violation");
    }
}

//! The history of a program against the naive scan of its ladder.

use understudy_ladder::Interpreter;
use understudy_scenarios::{Network, Scenario};
use understudy_wire::ProgramId;

use crate::support::{KILL_EACH, cell, model, scenario};

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
        let mut naive = Interpreter::new(&controller.program, period).expect("a right program");
        let mut scans = 0;
        for step in history.steps() {
            let Some(sampled) = &step.sampled else {
                continue;
            };
            assert!(!step.void);
            let inputs: Vec<bool> = sampled.inputs.bits().collect();
            let expected = naive.scan_observed(&inputs);
            let found = model.evaluation(program, step.cycle).expect("it is known");
            assert_eq!(
                found, expected,
                "{} in cycle {}",
                controller.name, step.cycle
            );
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
        let network = Network {
            loss: 0.2,
            ..Network::default()
        };
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

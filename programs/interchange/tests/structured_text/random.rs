//! Random texts: what their ladders do is what a naive execution of the text does, statement by statement.

mod execution;
mod text;

use proptest::prelude::*;
use understudy_ladder::Interpreter;

use self::execution::Execution;
use self::text::Text;
use crate::support::{PERIOD, program};
use understudy_logic::Running;
use understudy_testing::random::Dice;

fn check(seed: u64) {
    let mut dice = Dice::new(seed);
    let text = Text::random(&mut dice);
    let source = text.to_string();
    let ladder = program(&source);
    let mut scans = Interpreter::new(&ladder, PERIOD).expect("a sound program");
    let mut circuit = Running::new(&ladder.lower(PERIOD).expect("a sound program"));
    let mut execution = Execution::new();
    let names: Vec<&str> = ladder
        .outputs
        .iter()
        .map(|output| output.name.as_str())
        .collect();
    for scan in 0..40 {
        let inputs = dice.bits(ladder.inputs.len());
        execution.execute(&text, &inputs);
        let found = scans.scan(&inputs);
        assert_eq!(circuit.step(&inputs), found, "scan {scan}\n{source}");
        let expected = execution.outputs(&names);
        assert_eq!(
            found,
            expected,
            "execution {scan} of {names:?}\n{source}\n{}",
            understudy_ladder::print(&ladder)
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_ladder_scans_as_its_text_executes(seed: u64) {
        check(seed);
    }
}

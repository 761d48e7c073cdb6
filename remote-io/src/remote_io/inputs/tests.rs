//! Which of several values an input has: the last one of the list of overlays, in every combination.

use std::sync::Arc;

use understudy_cycle::{
    Channel, OperatorInput, OperatorInputKind, PointPlace, SignalInput, SignalSource, StopPoints,
};
use understudy_typed::Elementary;
use understudy_wire::{ProgramId, Role, SignalPlace, Time};

use super::super::states::settings;
use super::*;

const FIELD: usize = 0;
const STATUS: usize = 1;
const OPERATOR: usize = 2;
const SIGNAL: usize = 3;
const RESET: usize = 4;

fn place(bit: usize) -> PointPlace {
    PointPlace { bit: bit as u16, of: Elementary::Bool }
}

/// An input of the field with a status, one of an operator and one for a signal, both of which are 1, and the reset.
fn layout() -> Layout {
    Layout {
        operator_inputs: vec![OperatorInput {
            place: place(OPERATOR),
            kind: OperatorInputKind::Level,
            initial: 1,
            role: Role::Operator,
            retains: false,
        }],
        signals: vec![SignalInput {
            from: ProgramId(1),
            output: 0,
            place: place(SIGNAL),
            valid: None,
            default: 1,
            stale_after: 2,
        }],
        signal_sources: vec![SignalSource { program: ProgramId(1), outputs: 1, stopped: None }],
        channels: vec![Channel { input: FIELD, status: STATUS }],
        stop: Some(StopPoints { stopped: 0, reset: RESET }),
        ..Layout::booleans(5, 1)
    }
}

#[test]
fn an_input_has_the_value_of_the_last_overlay_that_has_one() {
    let layout = Arc::new(layout());
    let settings = Settings { layout: Arc::clone(&layout), ..settings() };
    for case in 0..1_u32 << 7 {
        let bit = |place: u32| case >> place & 1 == 1;
        let [last_good, sensor, failed, resets, is_forced, forced, is_of_reset] =
            [0, 1, 2, 3, 4, 5, 6].map(bit);
        let mut inputs = Inputs::new(&settings);
        inputs.field = Image::from_bits([last_good, false, false, false, false]);
        let own = if is_of_reset { vec![RESET] } else { vec![FIELD, OPERATOR, SIGNAL] };
        for input in own.iter().filter(|_| is_forced) {
            inputs.forcing.put(SignalPlace::Input(*input as u16), forced.into(), Time(1));
        }
        let mut sensors = Image::from_bits([sensor; 5]);
        sensors.set(STATUS, failed);
        let sampled = inputs.sample(Sampling {
            moment: Moment::default(),
            layout: &layout,
            sensors,
            diagnosis: None,
            driven: (&Image::zero(1), true),
            newest: None,
            resets,
        });
        let of_force = |input| Some(forced).filter(|_| is_forced && own.contains(&input));
        let field = if failed { last_good } else { sensor };
        for (input, without) in [(FIELD, field), (OPERATOR, true), (SIGNAL, true), (RESET, sensor)]
        {
            let reset = (input == RESET && resets).then_some(true);
            let expected = reset.or(of_force(input)).unwrap_or(without);
            assert_eq!(sampled.inputs.get(input), expected, "{case:#b}: input {input}");
            let unforced = reset.unwrap_or(without);
            assert_eq!(sampled.unforced.get(input), unforced, "{case:#b}: input {input}");
        }
    }
}

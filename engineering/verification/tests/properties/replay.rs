//! The naive scan of a run that was found.

use understudy_logic::{Circuit, Variable};
use understudy_verification::symbolic::Trace;

/// Does the circuit do on the inputs of `trace` what the trace says? The check of what was found shares nothing with the search.
pub(crate) fn replays(circuit: &Circuit, trace: &Trace) -> bool {
    let graph = circuit.graph();
    let registers = circuit.registers();
    let mut state: Vec<bool> = registers.iter().map(|register| register.initial).collect();
    let mut entered = Vec::new();
    for row in &trace.scans {
        entered.push(state.clone());
        let value = |variable: Variable| match variable {
            Variable::Input(input) => row.inputs[input as usize],
            Variable::Register(register) => state[register as usize],
        };
        let outputs = circuit.outputs().iter();
        let same = outputs
            .zip(&row.outputs)
            .all(|(output, told)| graph.evaluate(output.value, value) == *told);
        if !same {
            return false;
        }
        state = registers.iter().map(|register| graph.evaluate(register.next, value)).collect();
    }
    trace.again_from.is_none_or(|from| entered.get(from).is_some())
}

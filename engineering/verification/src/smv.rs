//! Programs in the language of NuSMV 2.6.
//!
//! [`of_circuit`] is faithful: one module, one step a scan, every rung seeing what the rungs above it wrote, as the controller runs it.
//! [`of_rungs`] is the text of the paper on the deployment of controllers (its appendix 2): one module a rung, joined in `main`. There a rung
//! sees the values of the rungs before it one step late, so what is proved of it is not proved of the scan.

mod names;
mod rungs;

use std::fmt::Write as _;

use understudy_logic::{Circuit, Expression, Operation, Variable};

use crate::symbolic::{Resolved, Signal};
use names::Namer;

pub use rungs::of_rungs;

/// `circuit` as one module, with `properties` as specifications and `fair` as conditions of fairness.
pub fn of_circuit(circuit: &Circuit, properties: &[Resolved], fair: &[Resolved]) -> String {
    let mut namer = Namer::default();
    let inputs: Vec<String> = circuit.inputs().iter().map(|name| namer.name(name)).collect();
    let outputs = circuit.outputs().iter();
    let outputs: Vec<String> = outputs.map(|output| namer.name(&output.name)).collect();
    let registers = circuit.registers().iter();
    let registers: Vec<String> =
        registers.map(|register| namer.name(&format!("{}_before", register.name))).collect();
    let mut text = format!(
        "-- {}: one step is one scan; NAME_before is the value before it\nMODULE main\n",
        circuit.name()
    );
    let declare = inputs.iter().chain(&registers);
    if declare.clone().next().is_some() {
        text.push_str("VAR\n");
    }
    for name in declare {
        let _ = writeln!(text, "  {name} : boolean;");
    }
    let shared = Shared::new(circuit, &inputs, &registers, &mut namer);
    let next = circuit.registers().iter();
    let next: Vec<String> = next.map(|register| shared.text(register.next)).collect();
    let values = circuit.outputs().iter();
    let values: Vec<String> = values.map(|output| shared.text(output.value)).collect();
    if !registers.is_empty() {
        text.push_str("ASSIGN\n");
    }
    for ((name, register), next) in registers.iter().zip(circuit.registers()).zip(next) {
        let _ = writeln!(text, "  init({name}) := {};", constant(register.initial));
        let _ = writeln!(text, "  next({name}) := {next};");
    }
    text.push_str("DEFINE\n");
    for (name, value) in &shared.defined {
        let _ = writeln!(text, "  {name} := {value};");
    }
    for (name, value) in outputs.iter().zip(values) {
        let _ = writeln!(text, "  {name} := {value};");
    }
    let name = |signal: &Signal| {
        Some(match signal {
            Signal::Output(output) => outputs[*output].clone(),
            Signal::Input(input) => inputs[*input].clone(),
        })
    };
    for condition in fair.iter().filter_map(|condition| condition.map(&name)) {
        let _ = writeln!(text, "FAIRNESS {condition};");
    }
    for property in properties.iter().filter_map(|property| property.map(&name)) {
        let _ = writeln!(text, "CTLSPEC {property};");
    }
    text
}

fn constant(value: bool) -> &'static str {
    if value { "TRUE" } else { "FALSE" }
}

/// Writes expressions; what is used more than once and is more than a variable gets a name of its own.
struct Shared {
    texts: Vec<String>,
    defined: Vec<(String, String)>,
}

impl Shared {
    fn new(circuit: &Circuit, inputs: &[String], registers: &[String], namer: &mut Namer) -> Self {
        let graph = circuit.graph();
        let roots = circuit.roots();
        let reached = graph.reached(&roots);
        let mut uses = vec![0_u32; graph.operations().len()];
        for (place, operation) in graph.operations().iter().enumerate() {
            if reached[place] {
                for operand in operation.operands() {
                    uses[operand.index()] += 1;
                }
            }
        }
        let mut shared =
            Self { texts: vec![String::new(); graph.operations().len()], defined: Vec::new() };
        for (place, &operation) in graph.operations().iter().enumerate() {
            if !reached[place] {
                continue;
            }
            let of = |operand: Expression| shared.texts[operand.index()].as_str();
            let text = match operation {
                Operation::Constant(value) => constant(value).to_owned(),
                Operation::Variable(Variable::Input(input)) => inputs[input as usize].clone(),
                Operation::Variable(Variable::Register(register)) => {
                    registers[register as usize].clone()
                }
                Operation::Not(operand) => format!("!{}", of(operand)),
                Operation::And(left, right) => format!("({} & {})", of(left), of(right)),
                Operation::Or(left, right) => format!("({} | {})", of(left), of(right)),
                Operation::Xor(left, right) => format!("({} xor {})", of(left), of(right)),
            };
            let two =
                matches!(operation, Operation::And(..) | Operation::Or(..) | Operation::Xor(..));
            shared.texts[place] = if two && uses[place] > 1 {
                let name = namer.name(&format!("shared_{}", shared.defined.len() + 1));
                shared.defined.push((name.clone(), text));
                name
            } else {
                text
            };
        }
        shared
    }

    fn text(&self, root: Expression) -> String {
        self.texts[root.index()].clone()
    }
}

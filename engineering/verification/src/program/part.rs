//! The part of a circuit that some properties depend on, as a circuit of its own: it has fewer states to list than the whole.

use understudy_logic::{Circuit, CircuitBuilder, Expression, Variable};

use crate::symbolic::{Cone, Resolved, Signal};

/// What some properties depend on.
pub(super) struct Part {
    pub(super) circuit: Circuit,
    /// Its outputs, by their places in the whole.
    outputs: Vec<usize>,
    /// The inputs of the part, by their places in the whole.
    inputs: Vec<usize>,
    /// Number of inputs of the whole.
    count: usize,
}

impl Part {
    /// The part of `whole` with the variables and signals of `cone`.
    pub(super) fn of(whole: &Circuit, cone: &Cone) -> Self {
        let mut builder = CircuitBuilder::new(whole.name());
        let (mut inputs, mut registers) = (Vec::new(), Vec::new());
        let (mut of_input, mut of_register) = (Vec::new(), Vec::new());
        for variable in &cone.variables {
            match *variable {
                Variable::Input(input) => {
                    of_input.push(builder.input(&whole.inputs()[input as usize]));
                    inputs.push(input as usize);
                }
                Variable::Register(register) => {
                    let of = &whole.registers()[register as usize];
                    of_register.push(builder.register(&of.name, of.initial));
                    registers.push(register as usize);
                }
            }
        }
        let outputs: Vec<usize> = (cone.signals.iter())
            .filter_map(|signal| match signal {
                Signal::Output(output) => Some(*output),
                Signal::Input(_) => None,
            })
            .collect();
        let next = registers.iter().map(|&register| whole.registers()[register].next);
        let values = outputs.iter().map(|&output| whole.outputs()[output].value);
        let roots: Vec<Expression> = next.chain(values).collect();
        // Variables and signals of a cone are in ascending order.
        let place = |places: &[usize], of: usize| {
            places.binary_search(&of).expect("a cone holds what its functions read")
        };
        let copies = builder.graph().import(whole.graph(), &roots, |_, variable| match variable {
            Variable::Input(input) => of_input[place(&inputs, input as usize)],
            Variable::Register(register) => of_register[place(&registers, register as usize)].1,
        });
        let (next, values) = copies.split_at(registers.len());
        for (&(register, _), &next) in of_register.iter().zip(next) {
            builder.set_next(register, next);
        }
        for (&output, &value) in outputs.iter().zip(values) {
            builder.output(&whole.outputs()[output].name, value);
        }
        Self {
            circuit: builder.finish().expect("the names are those of a circuit"),
            count: whole.inputs().len(),
            outputs,
            inputs,
        }
    }

    /// A property of the whole as one of the part, which has its signals.
    pub(super) fn property(&self, property: &Resolved) -> Resolved {
        let property = property.map(&|signal: &Signal| match *signal {
            Signal::Output(output) => self.outputs.binary_search(&output).ok().map(Signal::Output),
            Signal::Input(input) => self.inputs.binary_search(&input).ok().map(Signal::Input),
        });
        property.expect("a cone holds the signals of its property")
    }

    /// The inputs of a run of the part as those of the whole; the others are 0.
    pub(super) fn run_of_whole(&self, run: Vec<Vec<bool>>) -> Vec<Vec<bool>> {
        let scans = run.into_iter().map(|scan| {
            let mut all = vec![false; self.count];
            self.inputs.iter().zip(scan).for_each(|(&input, value)| all[input] = value);
            all
        });
        scans.collect()
    }
}

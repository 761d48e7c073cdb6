//! Registers that keep their first value in every run, as constants, and registers that are equal in every run, as one: a search back from a property
//! would go through states in which they are not.
//!
//! Let v be the registers, each added to its first value, so that all begin with 0. A partition of them, with the constant 0 in one of the parts, is kept:
//!
//! ```text
//! base   v = 0
//! step   for each x with equal v in each part, and each u, f(x, u) has equal v in each part too
//! ```
//!
//! Scans of such x at random split most parts, and a SAT solver splits the others, until it shows that no scan does.

use std::cell::Cell;
use std::collections::HashMap;

use understudy_logic::{Circuit, CircuitBuilder, Random, Scan, Scratch, Variable};

use super::clauses::{Patience, Unrolling};
use crate::effort::ALWAYS;
use crate::symbolic::Cone;

/// Rounds of scans at random that split nothing, after which the solver goes on.
const ROUNDS: u32 = 16;

/// Steps of all searches together.
const STEPS: u64 = 20_000;

/// The same circuit, in which of equal registers one alone is read; its signals have the places that they had.
pub(crate) fn reduced(circuit: &Circuit) -> Circuit {
    let parts = Parts::of(circuit);
    let mut builder = CircuitBuilder::like(circuit);
    let values = builder.copy_functions(circuit, |graph, variable| {
        let Variable::Register(register) = variable else {
            return graph.variable(variable);
        };
        let initial = |place: usize| circuit.registers()[place].initial;
        let register = register as usize;
        let Some(first) = parts.0[register] else {
            return graph.constant(initial(register));
        };
        let value = graph.variable(Variable::Register(first as u32));
        if initial(first) == initial(register) { value } else { graph.not(value) }
    });
    for (output, value) in circuit.outputs().iter().zip(values) {
        builder.output(&output.name, value);
    }
    builder.finish().expect("the names are those of a circuit")
}

/// For each register the first one of its part; nothing in the part of the constant.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Parts(Vec<Option<usize>>);

impl Parts {
    /// Those of which no scan splits any; each register for itself, where that takes too long to find.
    fn of(circuit: &Circuit) -> Self {
        let mut parts = Self(vec![None; circuit.registers().len()]);
        parts.split_at_random(circuit);
        let mut equal = parts.equal();
        if equal.is_empty() {
            return parts;
        }
        let all: Vec<usize> =
            equal.iter().flat_map(|(one, other)| [Some(*one), *other]).flatten().collect();
        let cone = Cone::of_registers(circuit, &all);
        let patience = Patience { go_on: ALWAYS, scans: 0, steps: Cell::new(STEPS) };
        let mut scan = Unrolling::new(circuit, &cone, false, patience);
        while !equal.is_empty() {
            match scan.difference(&equal) {
                None => parts.0 = (0..parts.0.len()).map(Some).collect(),
                Some(None) => break,
                Some(Some(ones)) => {
                    parts.split(|register| u64::from(ones.contains(&register)));
                }
            }
            equal = parts.equal();
        }
        parts
    }

    /// Each register that is not the first of its part, with that one.
    fn equal(&self) -> Vec<(usize, Option<usize>)> {
        let all = self.0.iter().copied().enumerate();
        all.filter(|&(register, first)| first != Some(register)).collect()
    }

    /// Splits each part by the values of its registers in some x, each added to its first one; whether any was split.
    fn split(&mut self, value: impl Fn(usize) -> u64) -> bool {
        let mut firsts = HashMap::new();
        let mut is_split = false;
        for (register, part) in self.0.iter_mut().enumerate() {
            let value = value(register);
            if part.is_some() || value != 0 {
                let first = *firsts.entry((*part, value)).or_insert(register);
                is_split |= *part != Some(first);
                *part = Some(first);
            }
        }
        is_split
    }

    fn split_at_random(&mut self, circuit: &Circuit) {
        let scan = Scan::new(circuit);
        let (mut scratch, mut random) = (Scratch::default(), Random(1));
        let first =
            |register: usize| u64::from(circuit.registers()[register].initial).wrapping_neg();
        let mut inputs = vec![[0; 1]; scan.input_count()];
        let mut outputs = vec![[0; 1]; scan.output_count()];
        let mut state = vec![[0; 1]; scan.register_count()];
        let mut quiet = 0;
        while quiet < ROUNDS && !self.equal().is_empty() {
            inputs.fill_with(|| [random.number()]);
            for (register, part) in self.0.iter().enumerate() {
                state[register][0] = first(register)
                    ^ match *part {
                        None => 0,
                        Some(own) if own == register => often_equal(&mut random),
                        Some(other) => state[other][0] ^ first(other),
                    };
            }
            scan.step_wide(&mut scratch, &mut state, &inputs, &mut outputs);
            quiet += 1;
            if self.split(|register| state[register][0] ^ first(register)) {
                quiet = 0;
            }
        }
    }
}

/// The values of a register in 64 states: half of them any, the others 1 in few, in most or in all, as counts need it that are nearly over.
fn often_equal(random: &mut Random) -> u64 {
    let [one, two, three] = [0; 3].map(|_: u64| random.number());
    let few = one & two & three & 0xffff << 32;
    let many = (one | two | three) & 0xff << 48;
    one & 0xffff_ffff | few | many | 0xff << 56
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use understudy_logic::{Expression, Operation, Running};

    use super::*;

    /// A circuit of these operations, whose registers have operations of it as their functions.
    fn circuit(operations: &[(u8, usize, usize)], next: &[(bool, usize)]) -> Circuit {
        let mut builder = CircuitBuilder::new("random");
        let mut made: Vec<Expression> =
            ["a", "b"].map(|name| builder.input(name)).into_iter().collect();
        let registers: Vec<_> = next
            .iter()
            .enumerate()
            .map(|(place, (initial, _))| builder.register(format!("x{place}"), *initial))
            .collect();
        made.extend(registers.iter().map(|(_, value)| *value));
        for &(kind, left, right) in operations {
            let (left, right) = (made[left % made.len()], made[right % made.len()]);
            let graph = builder.graph();
            made.push(match kind % 4 {
                0 => graph.and(left, right),
                1 => graph.or(left, right),
                2 => graph.xor(left, right),
                _ => graph.not(left),
            });
        }
        for (&(register, _), &(_, of)) in registers.iter().zip(next) {
            builder.set_next(register, made[of % made.len()]);
        }
        builder.output("y", made[made.len() - 1]);
        builder.output("z", made[made.len() / 2]);
        builder.finish().expect("the names are different")
    }

    proptest! {
        #[test]
        fn every_run_has_the_same_outputs(
            operations in proptest::collection::vec((any::<u8>(), 0..60_usize, 0..60_usize), 1..40),
            next in proptest::collection::vec((any::<bool>(), 0..60_usize), 1..12),
            inputs in proptest::collection::vec(any::<[bool; 2]>(), 1..40),
        ) {
            let circuit = circuit(&operations, &next);
            let reduced = reduced(&circuit);
            let (mut one, mut other) = (Running::new(&circuit), Running::new(&reduced));
            for inputs in inputs {
                prop_assert_eq!(one.step(&inputs), other.step(&inputs));
            }
        }
    }

    /// A latch that nothing can set, and one behind it that could be set by the first alone.
    #[test]
    fn registers_that_begin_by_each_other_are_constants() {
        let mut builder = CircuitBuilder::new("latches");
        let a = builder.input("a");
        let (first, x) = builder.register("x", false);
        let (second, y) = builder.register("y", false);
        let (third, z) = builder.register("z", false);
        let graph = builder.graph();
        let (set, other) = (graph.and(a, y), graph.or(x, y));
        builder.set_next(first, set);
        builder.set_next(second, other);
        builder.set_next(third, a);
        let shown = builder.graph().or(y, z);
        builder.output("shown", shown);
        let circuit = builder.finish().expect("the names are different");
        assert_eq!(Parts::of(&circuit).0, [None, None, Some(2)]);
        let reduced = reduced(&circuit);
        let shown = reduced.graph().operation(reduced.outputs()[0].value);
        assert_eq!(shown, Operation::Variable(Variable::Register(2)));
    }

    /// Two counters of one input, of which the second counts down from 3, and is read with the first.
    #[test]
    fn registers_that_are_equal_are_one() {
        let mut builder = CircuitBuilder::new("counters");
        let a = builder.input("a");
        let count = |builder: &mut CircuitBuilder, name: &str, initial: bool| {
            let (low, x) = builder.register(format!("{name}.0"), initial);
            let (high, y) = builder.register(format!("{name}.1"), initial);
            let graph = builder.graph();
            let (not, carried) = (graph.not(x), graph.and(a, x));
            let carried = if initial { graph.and(a, not) } else { carried };
            let next = (graph.xor(x, a), graph.xor(y, carried));
            builder.set_next(low, next.0);
            builder.set_next(high, next.1);
            y
        };
        let (up, down) = (count(&mut builder, "up", false), count(&mut builder, "down", true));
        let both = builder.graph().xor(up, down);
        builder.output("both", both);
        let circuit = builder.finish().expect("the names are different");
        assert_eq!(Parts::of(&circuit).0, [Some(0), Some(1), Some(0), Some(1)]);
        let reduced = reduced(&circuit);
        let both = reduced.graph().operation(reduced.outputs()[0].value);
        assert_eq!(both, Operation::Constant(true));
    }
}

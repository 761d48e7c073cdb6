//! The canonical texts behind the hashes: equal texts mean equal behaviour, and whatever does not matter to behaviour is not in
//! them (addresses, file names, comments, titles of rungs).

use std::fmt::Write;

use understudy_executable::Interface;
use understudy_logic::{Circuit, Expression, Operation, Variable};
use understudy_typed::Program as TypedProgram;
use understudy_wire::PointsHash;

/// A circuit, line by line: its inputs, registers with initial values, outputs, and the operations that they reach; and the registers that a warm
/// start keeps, `retentive`, where there are any.
///
/// Operations are numbered in the order in which a depth-first walk from the roots leaves them, so that the order in which
/// they were made does not matter.
pub(crate) fn circuit_text(circuit: &Circuit, retentive: &[u64]) -> String {
    let mut walk = Walk {
        circuit,
        numbers: vec![None; circuit.graph().operations().len()],
        count: 0,
        text: String::new(),
    };
    for input in circuit.inputs() {
        walk.line(format_args!("input {input}"));
    }
    for register in circuit.registers() {
        let initial = u8::from(register.initial);
        walk.line(format_args!("register {} {initial}", register.name));
    }
    for register in circuit.registers() {
        let number = walk.number(register.next);
        walk.line(format_args!("next {number}"));
    }
    for output in circuit.outputs() {
        let number = walk.number(output.value);
        walk.line(format_args!("output {} {number}", output.name));
    }
    for register in 0..circuit.registers().len() {
        if retentive.get(register / 64).is_some_and(|word| word >> (register % 64) & 1 == 1) {
            walk.line(format_args!("retained {register}"));
        }
    }
    walk.text
}

/// Identifies the points of a program: by names, places, types with their subranges, and the names of values.
pub(crate) fn points_hash(Interface { inputs, outputs }: &Interface) -> PointsHash {
    let mut text = String::new();
    let sides = [("input", inputs), ("output", outputs)];
    let points =
        sides.into_iter().flat_map(|(side, points)| points.iter().map(move |it| (side, it)));
    for (side, point) in points {
        // Writing to a text cannot fail.
        let _ = write!(text, "{side} {} at {} {}", point.name, point.bit, point.of);
        if let Some((low, high)) = point.range {
            let _ = write!(text, " {low}..{high}");
        }
        for (name, value) in point.values.iter().flat_map(|known| &known.values) {
            let _ = write!(text, " {name}={value}");
        }
        text.push('\n');
    }
    PointsHash::of(text.as_bytes())
}

/// A typed program: its layout, its routines with the lines that a fault names, and its initial state. The names and types of its variables are in it,
/// because a program after it takes over their values by them.
pub(crate) fn typed_text(program: &TypedProgram) -> String {
    let TypedProgram {
        name: _,
        period,
        budget,
        enumerations,
        structures,
        routines,
        tasks,
        variables,
        hidden,
        inputs,
        outputs,
        state,
        frames,
        initial,
        retained,
        details: _,
    } = program;
    // A program that keeps nothing has the text that it always had.
    let kept = match retained.is_empty() {
        true => String::new(),
        false => format!("retained {retained:?}\n"),
    };
    let hidden = match hidden.is_empty() {
        true => String::new(),
        false => format!("hidden {hidden:?}\n"),
    };
    format!(
        "typed program\nperiod {period}\nbudget {budget}\nmemory {state} {frames}\n{inputs:#?}\n{outputs:#?}\n{tasks:#?}\n{initial:?}\n{routines:#?}\n{variables:?}\n{structures:?}\n{enumerations:?}\n{kept}{hidden}"
    )
}

struct Walk<'a> {
    circuit: &'a Circuit,
    numbers: Vec<Option<usize>>,
    count: usize,
    text: String,
}

impl Walk<'_> {
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        writeln!(self.text, "{line}").expect("a string takes everything");
    }

    /// Writes what `root` reaches and was not written yet. Not recursive: ladders may be deep.
    fn number(&mut self, root: Expression) -> usize {
        let graph = self.circuit.graph();
        let mut stack = vec![root];
        while let Some(&expression) = stack.last() {
            if self.numbers[expression.index()].is_some() {
                stack.pop();
                continue;
            }
            let operation = graph.operation(expression);
            let open: Vec<Expression> = operation
                .operands()
                .filter(|operand| self.numbers[operand.index()].is_none())
                .collect();
            if open.is_empty() {
                self.write(operation);
                self.numbers[expression.index()] = Some(self.count);
                self.count += 1;
                stack.pop();
            } else {
                stack.extend(open.into_iter().rev());
            }
        }
        self.numbers[root.index()].expect("it was written")
    }

    fn write(&mut self, operation: Operation) {
        let operands: Vec<String> = operation
            .operands()
            .map(|operand| {
                let number = self.numbers[operand.index()].expect("operands come first");
                number.to_string()
            })
            .collect();
        let operands = operands.join(" ");
        match operation {
            Operation::Constant(value) => self.line(format_args!("constant {}", u8::from(value))),
            Operation::Variable(Variable::Input(index)) => self.line(format_args!("u {index}")),
            Operation::Variable(Variable::Register(index)) => self.line(format_args!("x {index}")),
            Operation::Not(_) => self.line(format_args!("not {operands}")),
            Operation::And(..) => self.line(format_args!("and {operands}")),
            Operation::Or(..) => self.line(format_args!("or {operands}")),
            Operation::Xor(..) => self.line(format_args!("xor {operands}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use understudy_logic::CircuitBuilder;

    use super::*;

    /// x(t+1) = a ∧ ¬x, y = x, with operations made in either order and with some that nothing reaches.
    fn circuit(detour: bool, initial: bool) -> Circuit {
        let mut builder = CircuitBuilder::new(if detour { "b" } else { "a" });
        let a = builder.input("a");
        if detour {
            let zero = builder.graph().constant(false);
            builder.graph().any([zero, a]);
        }
        let (register, x) = builder.register("x", initial);
        if detour {
            builder.graph().xor(x, a);
        }
        let negated = builder.graph().not(x);
        let next = builder.graph().and(a, negated);
        builder.set_next(register, next);
        builder.output("y", x);
        builder.finish().expect("a circuit")
    }

    #[test]
    fn the_text_depends_on_behaviour_alone() {
        let circuit_text = |circuit: &Circuit| circuit_text(circuit, &[0]);
        let text = circuit_text(&circuit(false, true));
        assert_eq!(text, "input a\nregister x 1\nu 0\nx 0\nnot 1\nand 0 2\nnext 3\noutput y 1\n");
        assert_eq!(circuit_text(&circuit(true, true)), text);
        assert_ne!(circuit_text(&circuit(true, false)), text);
        let kept = super::circuit_text(&circuit(true, true), &[1]);
        assert_eq!(kept, format!("{text}retained 0\n"));
    }
}

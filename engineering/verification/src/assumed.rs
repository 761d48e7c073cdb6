//! Properties of the runs in which assumptions about the inputs hold in every scan.
//!
//! A register keeps whether they have held so far (*ok*); it never becomes 1 again. So each operator asks for it where its run ends:
//!
//! ```text
//! AG p      AG (ok -> p)          EF p      EF (ok & p)
//! AF p      AF (p | !ok)          EG p      EG (ok & p)
//! A[p U q]  A[p U (q | !ok)]      E[p U q]  E[p U (ok & q)]
//! ```
//!
//! Assumptions are about inputs, which are free in every scan, so each such run goes on. Where fairness is asked for, *ok* is a condition of it too: the
//! way on that is fair may be another one.

use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph, Variable};

use crate::property::{Formula, Path};
use crate::symbolic::{Resolved, Signal};

/// The name of the output that says whether the assumptions have held so far.
pub const SO_FAR: &str = "assumptions hold";

/// The circuit with one output more, its last: whether all of `assumed`, formulas of one scan, have held so far.
pub fn with_assumptions(circuit: &Circuit, assumed: &[Resolved]) -> Circuit {
    let mut builder = CircuitBuilder::like(circuit);
    let values = builder.copy_functions(circuit, Graph::variable);
    let inputs = (0..circuit.inputs().len() as u32).map(Variable::Input);
    let inputs: Vec<Expression> = inputs.map(|input| builder.graph().variable(input)).collect();
    let value = |signal: &Signal| match *signal {
        Signal::Input(input) => inputs[input],
        Signal::Output(output) => values[output],
    };
    let (before, so_far) = builder.register(SO_FAR, true);
    let graph = builder.graph();
    let mut all = so_far;
    for formula in assumed {
        let holds = expression(graph, formula, &value);
        all = graph.and(all, holds);
    }
    builder.set_next(before, all);
    for (output, value) in circuit.outputs().iter().zip(values) {
        builder.output(&output.name, value);
    }
    builder.output(SO_FAR, all);
    builder.finish().expect("the names are those of a circuit, and one more")
}

/// A formula of one scan as an expression.
fn expression(
    graph: &mut Graph,
    formula: &Resolved,
    value: &impl Fn(&Signal) -> Expression,
) -> Expression {
    let mut of = |inner: &Resolved| expression(graph, inner, value);
    match formula {
        Formula::Signal(signal) => value(signal),
        Formula::Not(inner) => {
            let inner = of(inner);
            graph.not(inner)
        }
        Formula::And(left, right) => {
            let (left, right) = (of(left), of(right));
            graph.and(left, right)
        }
        Formula::Or(left, right) => {
            let (left, right) = (of(left), of(right));
            graph.or(left, right)
        }
        Formula::Implies(left, right) => {
            let (left, right) = (of(left), of(right));
            let not = graph.not(left);
            graph.or(not, right)
        }
        Formula::Same(left, right) => {
            let (left, right) = (of(left), of(right));
            let other = graph.xor(left, right);
            graph.not(other)
        }
        Formula::Constant(value) => graph.constant(*value),
        // Assumptions are of one scan.
        _ => graph.constant(true),
    }
}

/// What `formula` says of the runs in which the assumptions hold; `ok` is the signal of [`with_assumptions`].
pub fn assuming(formula: &Resolved, ok: Signal) -> Resolved {
    let within = relative(formula, ok);
    match within {
        // It says nothing of a run that begins otherwise.
        Formula::Always(Path::All, _) => within,
        _ => Formula::Signal(ok).implies(within),
    }
}

fn relative(formula: &Resolved, ok: Signal) -> Resolved {
    let inner = |formula: &Resolved| relative(formula, ok);
    let of = |formula: &Resolved| Box::new(inner(formula));
    // Where a run ends or goes on: for all runs it need not, once the assumptions are broken; for some run they have held.
    let end = |path: Path, formula: &Resolved| {
        let holds = Formula::Signal(ok);
        Box::new(match path {
            Path::All => holds.implies(inner(formula)),
            Path::Some => holds.and(inner(formula)),
        })
    };
    match formula {
        Formula::Constant(_) | Formula::Signal(_) => formula.clone(),
        Formula::Not(inner) => Formula::Not(of(inner)),
        Formula::And(left, right) => Formula::And(of(left), of(right)),
        Formula::Or(left, right) => Formula::Or(of(left), of(right)),
        Formula::Implies(left, right) => Formula::Implies(of(left), of(right)),
        Formula::Same(left, right) => Formula::Same(of(left), of(right)),
        Formula::Next(path, inner) => Formula::Next(*path, end(*path, inner)),
        Formula::Eventually(path, inner) => Formula::Eventually(*path, end(*path, inner)),
        Formula::Always(path, inner) => Formula::Always(*path, end(*path, inner)),
        Formula::Until(path, left, right) => Formula::Until(*path, of(left), end(*path, right)),
        Formula::Within(path, scans, inner) => Formula::Within(*path, *scans, end(*path, inner)),
    }
}

//! The equations of a parity controller: polynomials as in (34), (35) and Boolean functions as in (39), (40).
//!
//! Each stands in two styles: in the symbols of the paper, and with the names of the signals. The symbol x(N+1, k) counts k from 1
//! through all states; u(i, k) keeps the program's own number i and counts k from 0, as section V does; a comma parts the
//! numbers where one of them has more than one digit, as in `x3,10`.
//!
//! A Boolean function that has no sum of GF(2) in it is printed as its program has it. One that has is the inverse (6) of
//! its polynomial, brought into a short factored form; where even that is long, as it is for a sum of many programs, it keeps ⊕
//! between its parts.

use std::fmt::Write as _;

use serde::Serialize;
use understudy_logic::bdd::Diagrams;
use understudy_logic::notation::{self, FormulaTooLarge};
use understudy_logic::{Circuit, Cover, Expression, Graph, Operation, Polynomial, Variable};

use crate::generate::{ParityController, Summand};

/// Nodes of the diagrams of one function, at most, while a short formula is looked for.
const NODES: usize = 20_000;

/// What stands for a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// x31, u13, y31.
    Symbols,
    /// `robot.moving_right`.
    Names,
}

/// One text in both styles.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Formula {
    /// In the paper's symbols.
    pub symbols: String,
    /// In the signals' names.
    pub names: String,
}

/// A signal with its symbol.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Legend {
    /// Such as `x31`.
    pub symbol: String,
    /// Such as `robot.moving_right`.
    pub name: String,
}

/// One row of f(N+1) or h(N+1).
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Equation {
    /// What is defined: the state at t+1, or the output at t.
    pub defines: Legend,
    /// x(0), for a state.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<bool>,
    /// Over GF(2), as in (34), (35); absent where it is too large to be read.
    pub polynomial: Option<Formula>,
    /// In Boolean algebra, as in (39), (40); absent where it is too large to be read.
    pub boolean: Option<Formula>,
}

/// All equations of a parity controller.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Equations {
    /// The programs, in order.
    pub programs: Vec<String>,
    /// u(N+1).
    pub inputs: Vec<Legend>,
    /// f(N+1), (34) and (39).
    pub states: Vec<Equation>,
    /// h(N+1), (35) and (40).
    pub outputs: Vec<Equation>,
}

impl Equations {
    /// The equations of `controller`.
    ///
    /// Its cost is that of printing all of them; what is too large to be read is left out, never attempted.
    pub fn of(controller: &ParityController) -> Self {
        let circuit = controller.circuit();
        let summands = controller.summands();
        let own = summands.len() + 1;
        let legend = |variable| Legend {
            symbol: symbol_of(summands, variable),
            name: circuit.variable_name(variable).to_owned(),
        };
        let equation = |defines: Legend, initial, root| Equation {
            defines,
            initial,
            polynomial: polynomial(circuit, summands, root),
            boolean: boolean(circuit, summands, root),
        };
        let states = (0..).zip(circuit.registers()).map(|(index, register)| {
            let defines = legend(Variable::Register(index));
            equation(defines, Some(register.initial), register.next)
        });
        let outputs = circuit.outputs().iter().enumerate().map(|(place, output)| {
            let defines = Legend { symbol: symbol('y', own, place + 1), name: output.name.clone() };
            equation(defines, None, output.value)
        });
        Self {
            programs: summands.iter().map(|summand| summand.name.clone()).collect(),
            inputs: (0..)
                .zip(circuit.inputs())
                .map(|(index, _)| legend(Variable::Input(index)))
                .collect(),
            states: states.collect(),
            outputs: outputs.collect(),
        }
    }

    /// The text that a person reads: legend, polynomials, Boolean functions.
    pub fn to_text(&self, style: Style) -> String {
        let mut text = String::new();
        let pick = |formula: &Formula| match style {
            Style::Symbols => formula.symbols.clone(),
            Style::Names => formula.names.clone(),
        };
        let left = |legend: &Legend| match style {
            Style::Symbols => legend.symbol.clone(),
            Style::Names => legend.name.clone(),
        };
        let _ = writeln!(text, "Parity controller of {}", self.programs.join(", "));
        if style == Style::Symbols {
            let _ = writeln!(text, "\nSymbols");
            let states = self.states.iter().map(|state| &state.defines);
            let outputs = self.outputs.iter().map(|output| &output.defines);
            for legend in self.inputs.iter().chain(states).chain(outputs) {
                let _ = writeln!(text, "  {:<6} {}", legend.symbol, legend.name);
            }
        }
        type Side = fn(&Equation) -> Option<&Formula>;
        let polynomial: Side = |equation| equation.polynomial.as_ref();
        let boolean: Side = |equation| equation.boolean.as_ref();
        let sections: [(&str, &[Equation], &str, Side); 4] = [
            ("Next state over GF(2), (34)", &self.states, "(t+1)", polynomial),
            ("Outputs over GF(2), (35)", &self.outputs, "(t)", polynomial),
            ("Next state in Boolean algebra, (39)", &self.states, "(t+1)", boolean),
            ("Outputs in Boolean algebra, (40)", &self.outputs, "(t)", boolean),
        ];
        for (title, equations, time, side) in sections {
            let _ = writeln!(text, "\n{title}");
            for equation in equations {
                let right = side(equation).map_or_else(|| "too large to print".to_owned(), pick);
                let _ = writeln!(text, "  {}{time} = {right}", left(&equation.defines));
            }
        }
        text
    }
}

fn symbol(letter: char, first: usize, second: usize) -> String {
    if first > 9 || second > 9 {
        format!("{letter}{first},{second}")
    } else {
        format!("{letter}{first}{second}")
    }
}

fn symbol_of(summands: &[Summand], variable: Variable) -> String {
    match variable {
        Variable::Register(index) => symbol('x', summands.len() + 1, index as usize + 1),
        Variable::Input(index) => {
            let index = index as usize;
            // Members without inputs have empty ranges, so the last that starts at or before the input holds it.
            let summand = summands.partition_point(|summand| summand.inputs.start <= index);
            let start = summands[summand - 1].inputs.start;
            symbol('u', summand, index - start)
        }
    }
}

fn both(
    circuit: &Circuit,
    summands: &[Summand],
    print: impl Fn(Style, &Naming<'_>) -> String,
) -> Formula {
    Formula {
        symbols: print(Style::Symbols, &|variable| symbol_of(summands, variable)),
        names: print(Style::Names, &|variable| circuit.variable_name(variable).to_owned()),
    }
}

type Naming<'a> = dyn Fn(Variable) -> String + 'a;

fn polynomial(circuit: &Circuit, summands: &[Summand], root: Expression) -> Option<Formula> {
    let polynomial = Polynomial::of(circuit.graph(), root).ok()?;
    Some(both(circuit, summands, |style, name| {
        polynomial.print(name, if style == Style::Symbols { "" } else { "·" })
    }))
}

fn boolean(circuit: &Circuit, summands: &[Summand], root: Expression) -> Option<Formula> {
    let print = |graph: &Graph, root: Expression| -> Result<Formula, FormulaTooLarge> {
        notation::boolean(graph, root, &|variable| symbol_of(summands, variable))?;
        Ok(both(circuit, summands, |_, name| {
            notation::boolean(graph, root, name).unwrap_or_default()
        }))
    };
    let graph = circuit.graph();
    if !has_sum(graph, root)? {
        return print(graph, root).ok();
    }
    let mut short = Graph::new();
    let formula = match short_form(graph, root, &mut short) {
        Some(formula) => formula,
        None => {
            // Too long as a whole; its parts may still be short.
            let Operation::Xor(left, right) = graph.operation(root) else {
                return print(graph, root).ok();
            };
            let mut parts = Vec::new();
            let mut pending = vec![right, left];
            while let Some(part) = pending.pop() {
                if let Operation::Xor(left, right) = graph.operation(part) {
                    pending.extend([right, left]);
                } else {
                    parts.push(short_form(graph, part, &mut short)?);
                }
            }
            short.sum(parts)
        }
    };
    print(&short, formula).ok()
}

/// Whether a sum of GF(2) occurs; `None` where the expression is too large to be printed anyway.
fn has_sum(graph: &Graph, root: Expression) -> Option<bool> {
    let cone = graph.cone(root, NODES)?;
    let is_sum =
        |&expression: &Expression| matches!(graph.operation(expression), Operation::Xor(..));
    Some(cone.iter().any(is_sum))
}

fn short_form(graph: &Graph, root: Expression, target: &mut Graph) -> Option<Expression> {
    let diagrams = Diagrams::for_roots(graph, &[root], NODES);
    let diagram = diagrams.of(graph, root).ok()?;
    let cover = Cover::of(&diagrams, &diagram, SHORT_COVER).ok()?;
    Some(cover.factored(target))
}

/// Products, at most, of a sum of products that is still shorter to read than ⊕.
const SHORT_COVER: usize = 24;

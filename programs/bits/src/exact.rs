//! The circuit that does in every scan what the program does.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::fmt;

use understudy_logic::{Circuit, CircuitBuilder, Expression, Operation, Variable as Bit};
use understudy_typed::{Comparison, Elementary, Program};

use crate::beside::{self, Disagreement};
use crate::circuit::{Derivation, Meaning, unique};
use crate::execute::Unsupported;
use crate::extent::Extent;
use crate::layout::Layout;
use crate::statements::told;
use crate::system::System;
use crate::term::{Node, Term, Variable};

/// Why a program has no exact circuit.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Inexact {
    /// A statement cannot be followed.
    #[error(transparent)]
    Unsupported(#[from] Unsupported),
    /// Values that are not followed bit by bit.
    #[error("{}", gaps(.0))]
    Gaps(Vec<Gap>),
    /// A scan in which the circuit differs from the program.
    #[error(transparent)]
    Differs(#[from] Box<Disagreement>),
}

impl Inexact {
    /// The code of a defect of the derivation; `usual` of everything else.
    pub fn code_or(&self, usual: &'static str) -> &'static str {
        match self {
            Self::Differs(_) => Disagreement::CODE,
            Self::Unsupported(_) | Self::Gaps(_) => usual,
        }
    }

    /// The same, where each value has the variable that takes it and the statement of the program in which it is met.
    #[must_use]
    pub fn told_by(self, program: &Program) -> Self {
        match self {
            Self::Gaps(gaps) => Self::Gaps(told(gaps, program)),
            other => other,
        }
    }
}

/// A value that is not followed bit by bit.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Gap {
    /// The variable or the expression.
    pub what: String,
    /// Its type.
    pub of: Elementary,
    /// The routine and the line of the statement that computes or reads it first.
    pub at: Option<(String, u32)>,
}

impl fmt::Display for Gap {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "`{}` : {}", self.what, self.of)?;
        match &self.at {
            Some((routine, line)) => write!(formatter, " ({routine}, line {line})"),
            None => Ok(()),
        }
    }
}

fn gaps(gaps: &[Gap]) -> String {
    let shown: Vec<String> = gaps.iter().take(3).map(Gap::to_string).collect();
    let more = match gaps.len().saturating_sub(shown.len()) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("no bits for {}{more}", shown.join(", "))
}

/// What a circuit shows beside the outputs of its program.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shown<'a> {
    /// BOOL variables, as they are after the scan.
    pub variables: &'a [String],
    /// Numbers that are compared.
    pub compared: &'a [Compared],
    /// It keeps all that the program keeps: what no output depends on too.
    pub keeps_all: bool,
    /// Where the program has retentive variables, it is restarted warm in any scans, by the input [`POWER_RETURNS`](crate::POWER_RETURNS) behind all
    /// others.
    pub restarts: bool,
}

/// A number of a program, compared with a value.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The name of the output.
    pub name: String,
    /// The variable.
    pub number: String,
    /// How.
    pub comparison: Comparison,
    /// The value, as it is stored.
    pub stored: u64,
}

/// A circuit that does in every scan what a program does.
#[derive(Debug, Clone)]
pub struct Exact {
    /// The circuit.
    pub circuit: Circuit,
    /// What its registers are in the state of the program.
    pub layout: Layout,
    /// Outputs that are bits of points; behind them stands what is shown.
    points: usize,
}

/// The circuit of a program whose values are finite; see [`Exact::new`].
///
/// # Errors
/// What of the program is not followed, or not bit by bit.
pub fn exact(program: &Program) -> Result<Circuit, Inexact> {
    Exact::new(program, Shown::default()).map(|exact| exact.circuit)
}

impl Exact {
    /// The circuit of a program whose values are finite. Its inputs and outputs are the bits of the points, in their order: a BOOL under its own name,
    /// the bits of another point as `NAME.0` for the lowest and so on; behind them stands what is shown. A number has as many registers as its values
    /// need; the bits of a BOOL, of a timer or of a counter stand behind the name of the variable. A program that never stops by a fault has
    /// neither the reset nor the fault among them. Both make the same scans, with inputs at random, before it is given.
    ///
    /// # Errors
    /// What of the program is not followed, or not bit by bit; a scan in which the circuit does something else.
    pub fn new(program: &Program, shown: Shown<'_>) -> Result<Self, Inexact> {
        let numbers = shown.compared.iter().map(|compared| compared.number.clone());
        let mut system = System::comparing(program, numbers.collect(), shown.restarts)?;
        for Compared { name, number, comparison, stored } in shown.compared {
            if let Some(number) = system.number(number) {
                system.compare_with_value(name, number, *comparison, *stored);
            }
        }
        let mut values: HashMap<&str, Term> = HashMap::new();
        for (name, term) in system.observed.iter().chain(&system.shown) {
            values.entry(name).or_insert(*term);
        }
        let value = |name: &str| values.get(name).copied();
        let wide = program.outputs.iter().filter(|point| point.of != Elementary::Bool);
        let wide: Vec<(String, Term)> =
            wide.filter_map(|point| Some((point.name.clone(), value(&point.name)?))).collect();
        let kept: Vec<u32> = match shown.keeps_all {
            true => system.read.iter().copied().collect(),
            false => Vec::new(),
        };
        let derivation = Derivation::of(&system, &wide, &kept)?;
        let circuit = &derivation.circuit;
        let never = |value: Term| system.terms.is(value, false) || derivation.is_never(value);
        let stops = !value(Program::FAULT).is_some_and(never);
        let mut known: HashMap<&str, Expression> = HashMap::new();
        for output in circuit.outputs() {
            known.entry(&output.name).or_insert(output.value);
        }
        let points = program.outputs.iter().filter(|point| stops || point.slot != 0);
        let points = points.flat_map(|point| match point.of {
            Elementary::Bool => vec![point.name.clone()],
            of => (0..of.bits()).map(|bit| format!("{}.{bit}", point.name)).collect(),
        });
        let known_points = points.filter(|name| known.contains_key(name.as_str()));
        let points: Vec<String> = known_points.collect();
        let count = points.len();
        let compared = shown.compared.iter().map(|compared| compared.name.clone());
        let further = shown.variables.iter().cloned().chain(compared);
        let mut names = HashSet::new();
        let outputs = points.into_iter().chain(further).filter(|name| names.insert(name.clone()));
        let outputs: Vec<(String, Expression)> = outputs
            .filter_map(|name| known.get(name.as_str()).map(|&value| (name, value)))
            .collect();
        let roots = outputs.iter().map(|(_, value)| *value).collect();
        let live = live(circuit, roots, derivation.registers_of(&kept));
        let mut gaps = derivation.gaps_among(&system, &live);
        let points = program.inputs.iter().chain(&program.outputs);
        for point in points.filter(|point| point.of.is_real()) {
            gaps.insert(Gap { what: point.name.clone(), of: point.of, at: None });
        }
        if !gaps.is_empty() {
            return Err(Inexact::Gaps(gaps.into_iter().collect()).told_by(program));
        }
        let layout = Layout::new(program, &system, &derivation, &live);
        let circuit = pruned(&system, &derivation, &outputs, &live, stops);
        beside::exact(&system, program, &circuit, &shown)?;
        Ok(Self { circuit, layout, points: count })
    }

    /// The circuit without what it shows.
    pub fn of_points(&self) -> Circuit {
        let mut builder = CircuitBuilder::like(&self.circuit);
        self.copied(&mut builder);
        builder.finish().expect("it is a part of a circuit")
    }

    /// The same as it is executed: behind the registers that its scans read, its state has all BOOLs that are shown and have none of them, as they are
    /// after the scan. So a program that takes its place finds the value of each, whether this one reads it or not.
    pub fn keeping_shown(&self, program: &Program) -> Self {
        let Self { circuit, layout, points } = self;
        let mut builder = CircuitBuilder::like(circuit);
        let values = self.copied(&mut builder);
        let initial = program.initial_state();
        let mut names: HashSet<String> =
            circuit.registers().iter().map(|register| register.name.clone()).collect();
        let mut kept = Vec::new();
        for (output, value) in circuit.outputs().iter().zip(values) {
            let part = program.part(&output.name);
            let part = part.filter(|part| part.of.elementary() == Some(Elementary::Bool));
            let Some(address) = part.map(|part| part.address) else {
                continue;
            };
            if layout.has_value(address) {
                continue;
            }
            let begins = initial[(address / 64) as usize] >> (address % 64) & 1 == 1;
            let extent = match builder.graph().operation(value) {
                Operation::Constant(always) if always == begins => {
                    Extent::new(begins.into(), begins.into())
                }
                _ => {
                    let name = unique(&mut names, &output.name);
                    let (register, _) = builder.register(name, begins);
                    builder.set_next(register, value);
                    Extent::of(Elementary::Bool)
                }
            };
            kept.push((address, extent));
        }
        let circuit = builder.finish().expect("names of registers are unique");
        Self { circuit, layout: layout.keeping(&kept), points: *points }
    }

    /// Copies the functions and the outputs of points; the values of all outputs.
    fn copied(&self, builder: &mut CircuitBuilder) -> Vec<Expression> {
        let values =
            builder.copy_functions(&self.circuit, |graph, variable| graph.variable(variable));
        for (output, &value) in self.circuit.outputs()[..self.points].iter().zip(&values) {
            builder.output(&output.name, value);
        }
        values
    }
}

impl Derivation {
    /// The values of the system that the circuit does not follow bit by bit; none where it is exact.
    pub fn gaps(&self, system: &System) -> Vec<Gap> {
        let outputs = self.circuit.outputs().iter();
        let roots = outputs.map(|output| output.value).collect();
        let live = live(&self.circuit, roots, BTreeSet::new());
        self.gaps_among(system, &live).into_iter().collect()
    }

    /// The registers of some cells.
    fn registers_of(&self, cells: &[u32]) -> BTreeSet<Bit> {
        let cells: HashSet<&u32> = cells.iter().collect();
        let held = (0..).zip(&self.held);
        let of = held.filter(|(_, held)| held.is_some_and(|held| cells.contains(&held.cell)));
        of.map(|(register, _)| Bit::Register(register)).collect()
    }

    fn gaps_among(&self, system: &System, live: &BTreeSet<Bit>) -> BTreeSet<Gap> {
        let inputs = live.iter().filter_map(|variable| match variable {
            Bit::Input(input) => Some(*input as usize),
            Bit::Register(_) => None,
        });
        let terms = inputs.filter_map(|input| gap(&self.meanings[input]));
        let gap = |term| Gap {
            what: system.describe(term),
            of: system.terms.of(term),
            at: system.made_at(term),
        };
        terms.map(gap).collect()
    }
}

/// The number that a free input stands for.
fn gap(meaning: &Meaning) -> Option<Term> {
    match *meaning {
        Meaning::Bit(..) => None,
        Meaning::Boundary(term, _)
        | Meaning::NotANumber(term)
        | Meaning::Less(term, _)
        | Meaning::Equal(term, _)
        | Meaning::Free(term, _) => Some(term),
    }
}

/// Inputs and registers that the roots and some registers depend on, those among them.
fn live(circuit: &Circuit, mut roots: Vec<Expression>, kept: BTreeSet<Bit>) -> BTreeSet<Bit> {
    let next = |register: usize| circuit.registers()[register].next;
    roots.extend(registers(&kept).map(next));
    let mut live = kept;
    loop {
        let reached = circuit.graph().reached(&roots);
        let operations = circuit.graph().operations().iter().zip(reached);
        let mut more = Vec::new();
        for (operation, is_reached) in operations {
            if let (Operation::Variable(variable), true) = (operation, is_reached)
                && live.insert(*variable)
                && let Bit::Register(register) = variable
            {
                more.push(next(*register as usize));
            }
        }
        if more.is_empty() {
            return live;
        }
        roots.extend(more);
    }
}

/// The registers among inputs and registers, in their order.
pub(crate) fn registers(live: &BTreeSet<Bit>) -> impl Iterator<Item = usize> {
    live.iter().filter_map(|variable| match variable {
        Bit::Register(register) => Some(*register as usize),
        Bit::Input(_) => None,
    })
}

/// The circuit with the bits of points as its inputs and outputs, and the registers that they depend on.
fn pruned(
    system: &System,
    derivation: &Derivation,
    outputs: &[(String, Expression)],
    live: &BTreeSet<Bit>,
    stops: bool,
) -> Circuit {
    let circuit = &derivation.circuit;
    let mut builder = CircuitBuilder::new(circuit.name());
    let mut places: Vec<Option<Expression>> = vec![None; circuit.inputs().len()];
    let mut known: HashMap<(u32, u32), usize> = HashMap::new();
    for (place, meaning) in derivation.meanings.iter().enumerate() {
        if let Meaning::Bit(input, bit) = *meaning {
            known.insert((input, bit), place);
        }
    }
    let inputs = (0..).zip(&system.inputs);
    for (number, input) in inputs.filter(|(_, input)| stops || input.name != Program::RESET) {
        debug_assert!(matches!(system.terms.node(input.term), Node::Variable(Variable::Input(_))));
        for bit in 0..input.of.bits() {
            let name = match input.of {
                Elementary::Bool => input.name.clone(),
                _ => format!("{}.{bit}", input.name),
            };
            let value = builder.input(name);
            if let Some(&place) = known.get(&(number, bit)) {
                places[place] = Some(value);
            }
        }
    }
    let kept: Vec<usize> = registers(live).collect();
    let mut copied = vec![None; circuit.registers().len()];
    for &place in &kept {
        let register = &circuit.registers()[place];
        copied[place] = Some(builder.register(&register.name, register.initial));
    }
    let mut roots: Vec<Expression> =
        kept.iter().map(|&place| circuit.registers()[place].next).collect();
    roots.extend(outputs.iter().map(|(_, value)| *value));
    let copies = builder.graph().import(circuit.graph(), &roots, |graph, variable| {
        let value = match variable {
            Bit::Input(input) => places[input as usize],
            Bit::Register(register) => copied[register as usize].map(|(_, value)| value),
        };
        value.unwrap_or_else(|| graph.constant(false))
    });
    for (&place, &next) in kept.iter().zip(&copies) {
        if let Some((register, _)) = copied[place] {
            builder.set_next(register, next);
        }
    }
    for ((name, _), &value) in outputs.iter().zip(&copies[kept.len()..]) {
        builder.output(name, value);
    }
    builder.finish().expect("names of points are unique, and every register has its next value")
}

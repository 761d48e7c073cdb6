//! Ladder to circuit: the scan as x(t+1) = f(x(t), u(t)), y(t) = h(x(t), u(t)), equations (1)-(2).
//!
//! The rungs are walked in the order of the scan with the present value of every bit as an expression over x(t) and u(t); a
//! coil replaces the value of its target, so that a later rung sees what an earlier one wrote. What is read before it is
//! written in a scan is x(t) and becomes a register; what is always written first does not.
//!
//! Registers stand in this order: memory bits and then outputs as declared, the bits of the blocks in the order of the scan,
//! and the last values of edge contacts and edge coils. Timers count scans, up to their preset; counters are as wide as
//! their preset. Linear in the program.

mod blocks;
mod number;
mod observer;
mod writes;

use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::RangeInclusive;
use std::time::Duration;

use understudy_logic::{Circuit, CircuitBuilder, Expression, Graph, RegisterId, Variable};
use understudy_text::{Diagnostic, has_errors};

use self::number::Number;
pub use self::observer::Observer;
use self::observer::{Tapped, Wires};
pub use self::writes::Write;
use crate::check::check;
use crate::program::{CoilKind, Comparison, Contact, ContactKind, Element, Program, Rung, Series};

/// Periods from one scan to the next that make sense.
pub const PERIODS: RangeInclusive<Duration> = Duration::from_nanos(1)..=Duration::from_secs(3600);

/// Why a program cannot be lowered or run.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LowerError {
    /// The period is outside of [`PERIODS`].
    #[error("a period of {period:?} is not possible; it is more than 0 and at most one hour")]
    Period {
        /// What was asked for.
        period: Duration,
    },
    /// The program has errors; a parsed one has reported them already.
    #[error("the program `{program}` has errors: {}", list(diagnostics))]
    Invalid {
        /// The program.
        program: String,
        /// All errors.
        diagnostics: Vec<Diagnostic>,
    },
}

fn list(diagnostics: &[Diagnostic]) -> String {
    let messages: Vec<&str> =
        diagnostics.iter().map(|diagnostic| diagnostic.message.as_str()).collect();
    messages.join("; ")
}

pub(crate) fn validate(program: &Program, period: Duration) -> Result<(), LowerError> {
    if !PERIODS.contains(&period) {
        return Err(LowerError::Period { period });
    }
    let mut diagnostics = check(program);
    if has_errors(&diagnostics) {
        diagnostics.retain(|found| found.severity == understudy_text::Severity::Error);
        return Err(LowerError::Invalid { program: program.name.to_string(), diagnostics });
    }
    Ok(())
}

/// Scans from the start of a timer to its end: the preset in periods, rounded up, and at least one.
fn preset_scans(preset: Duration, period: Duration) -> u64 {
    let scans = preset.as_nanos().div_ceil(period.as_nanos()).max(1);
    u64::try_from(scans).unwrap_or(u64::MAX)
}

impl Program {
    /// The circuit that does what the scan of this program does, one scan a step, with `period` from one to the next.
    ///
    /// Inputs and outputs are in the order of their declaration; y(t) is what the outputs are after the scan.
    ///
    /// # Errors
    /// A period out of [`PERIODS`], or a program with errors. A preset that is not a multiple of the period is rounded up; see
    /// [`Program::preset_warnings`].
    pub fn lower(&self, period: Duration) -> Result<Circuit, LowerError> {
        let outputs = self.outputs.iter().map(|signal| signal.name.to_string());
        self.lower_showing(period, outputs.collect(), &BTreeMap::new())
    }

    /// [`Self::lower`], with every memory bit and every output pin of a block (`pause.Q`) as an output behind those of the program, each
    /// as it is after the scan.
    ///
    /// # Errors
    /// As [`Self::lower`].
    pub fn lower_observed(&self, period: Duration) -> Result<Circuit, LowerError> {
        self.lower_comparing(period, &BTreeMap::new())
    }

    /// [`Self::lower_observed`], with comparisons of counters of the program as further outputs, each under its name and as it is after the scan.
    ///
    /// # Errors
    /// As [`Self::lower`].
    pub fn lower_comparing(
        &self,
        period: Duration,
        compared: &BTreeMap<String, Comparison>,
    ) -> Result<Circuit, LowerError> {
        let blocks = self.blocks();
        let pins = blocks.iter().flat_map(|block| {
            let pins = block.kind.outputs().iter();
            pins.map(|pin| format!("{}.{pin}", block.name))
        });
        let signals = self.writable().map(|signal| signal.name.to_string());
        let outputs = self.outputs.iter().map(|signal| signal.name.to_string());
        let mut shown: Vec<String> = outputs.collect();
        let outputs: HashSet<String> = shown.iter().cloned().collect();
        shown.extend(signals.filter(|name| !outputs.contains(name)).chain(pins));
        self.lower_showing(period, shown, compared)
    }

    /// `shown` are signals that the program writes, or pins of its blocks.
    fn lower_showing(
        &self,
        period: Duration,
        shown: Vec<String>,
        compared: &BTreeMap<String, Comparison>,
    ) -> Result<Circuit, LowerError> {
        validate(self, period)?;
        let mut lowering = Lowering::new(self, period);
        for rung in &self.rungs {
            lowering.rung(rung);
        }
        let shown = shown.into_iter().map(|name| {
            let value = lowering.read(lowering.places[name.as_str()]);
            (name, value)
        });
        let mut shown: Vec<(String, Expression)> = shown.collect();
        for (name, comparison) in compared {
            shown.push((name.clone(), lowering.compared(comparison)));
        }
        Ok(lowering.finish(self, shown))
    }

    /// A warning for each timer whose preset is not a multiple of `period`.
    pub fn preset_warnings(&self, period: Duration) -> Vec<Diagnostic> {
        if !PERIODS.contains(&period) {
            return Vec::new();
        }
        let blocks = self.blocks();
        let warnings = blocks.iter().filter_map(|block| {
            let preset = block.kind.preset_time()?;
            if preset.as_nanos() % period.as_nanos() == 0 {
                return None;
            }
            let scans = preset_scans(preset, period);
            let rounded = period.saturating_mul(u32::try_from(scans).unwrap_or(u32::MAX));
            let message = format!(
                "the preset {preset:?} of `{}` is not a multiple of the period {period:?}; it lasts {scans} scans, {rounded:?}",
                block.name
            );
            let warning = Diagnostic::warning("U0155", message, block.name.span());
            Some(warning.with_help("choose a multiple of the period"))
        });
        warnings.collect()
    }
}

/// A bit that may have to outlive the scan.
struct Slot {
    name: String,
    initial: bool,
    /// What it is at this place of the scan; `None` while nothing has written it.
    present: Option<Expression>,
    /// A coil or a block writes it somewhere.
    written: bool,
    /// Its old value was read, so it is a register.
    is_register: bool,
}

struct Lowering<'a> {
    graph: Graph,
    period: Duration,
    inputs: HashMap<&'a str, Expression>,
    /// In the order of the registers to be.
    slots: Vec<Slot>,
    /// Signals and output pins of blocks.
    places: HashMap<String, usize>,
    /// The bits of each timer and counter: the place of the first and their number.
    numbers: HashMap<&'a str, (usize, usize)>,
    /// The last clock of each counter input and trigger block, by block and pin.
    clocks: HashMap<(&'a str, &'static str), usize>,
    register_names: HashSet<String>,
    /// Where every element is to be looked at: its wires.
    tapped: Option<Tapped>,
}

impl<'a> Lowering<'a> {
    fn new(program: &'a Program, period: Duration) -> Self {
        let mut lowering = Self {
            graph: Graph::new(),
            period,
            inputs: HashMap::new(),
            slots: Vec::new(),
            places: HashMap::new(),
            numbers: HashMap::new(),
            clocks: HashMap::new(),
            register_names: HashSet::new(),
            tapped: None,
        };
        for (index, signal) in program.inputs.iter().enumerate() {
            let index = u32::try_from(index).expect("fewer than 2^32 inputs");
            let value = lowering.graph.variable(Variable::Input(index));
            lowering.inputs.insert(&signal.name, value);
        }
        for signal in program.writable() {
            let place = lowering.slot(signal.name.to_string(), signal.initial.unwrap_or(false));
            lowering.slots[place].written = false;
            lowering.places.insert(signal.name.to_string(), place);
        }
        for coil in program.rungs.iter().flat_map(|rung| &rung.coils) {
            let place = lowering.places[coil.target.as_str()];
            lowering.slots[place].written = true;
        }
        for block in program.blocks() {
            lowering.declare(block);
        }
        lowering
    }

    /// Makes a bit that something writes; a name that is in use gets a number.
    fn slot(&mut self, name: String, initial: bool) -> usize {
        let mut unique = name.clone();
        let mut count = 2;
        while !self.register_names.insert(unique.clone()) {
            unique = format!("{name}_{count}");
            count += 1;
        }
        self.slots.push(Slot {
            name: unique,
            initial,
            present: None,
            written: true,
            is_register: false,
        });
        self.slots.len() - 1
    }

    fn read(&mut self, place: usize) -> Expression {
        let slot = &mut self.slots[place];
        if let Some(present) = slot.present {
            return present;
        }
        if !slot.written {
            return self.graph.constant(slot.initial);
        }
        slot.is_register = true;
        let variable = u32::try_from(place).expect("fewer than 2^32 bits");
        self.graph.variable(Variable::Register(variable))
    }

    fn write(&mut self, place: usize, value: Expression) {
        self.slots[place].present = Some(value);
    }

    fn signal(&mut self, name: &str) -> Expression {
        match self.inputs.get(name) {
            Some(&value) => value,
            None => self.read(self.places[name]),
        }
    }

    fn rung(&mut self, rung: &'a Rung) {
        let rail = self.graph.constant(true);
        let power = self.series(&rung.network, rail);
        self.tap(&[power]);
        for coil in &rung.coils {
            self.coil(coil.kind, &coil.target, power);
            let written = self.read(self.places[coil.target.as_str()]);
            self.tap(&[written]);
        }
    }

    fn series(&mut self, series: &'a Series, power: Expression) -> Expression {
        let mut power = power;
        for element in series {
            let enters = power;
            power = match element {
                Element::Contact(contact) => {
                    let value = self.signal(&contact.operand);
                    let passes = self.contact(contact);
                    let leaves = self.graph.and(enters, passes);
                    self.tap_element([enters, passes, leaves], Wires::Bit, &[value]);
                    leaves
                }
                Element::Comparison(comparison) => {
                    let number = self.number(&comparison.counter);
                    let holds = self.compared(comparison);
                    let leaves = self.graph.and(enters, holds);
                    let wires = Wires::Number(number.0.len());
                    self.tap_element([enters, holds, leaves], wires, &number.0);
                    leaves
                }
                Element::Branches(branches) => {
                    // The power before the branches is common to them: (power and a) or (power and b) would hide it.
                    let rail = self.graph.constant(true);
                    let has_block = branches.iter().any(|branch| {
                        crate::program::visit_any(branch, |element| {
                            matches!(element, Element::Block(_))
                        })
                    });
                    let inside = has_block || self.tapped.is_some();
                    let start = if inside { power } else { rail };
                    let mut any = self.graph.constant(false);
                    for branch in branches {
                        let passes = self.series(branch, start);
                        any = self.graph.or(any, passes);
                    }
                    let leaves = if inside { any } else { self.graph.and(power, any) };
                    self.tap_element([enters, leaves, leaves], Wires::None, &[]);
                    leaves
                }
                Element::Block(block) => {
                    let before = self.before_block(block);
                    let leaves = self.block(block, power);
                    self.tap_block(block, before, enters, leaves);
                    leaves
                }
            };
        }
        power
    }

    fn contact(&mut self, contact: &Contact) -> Expression {
        let value = self.signal(&contact.operand);
        match contact.kind {
            ContactKind::NormallyOpen => value,
            ContactKind::NormallyClosed => self.graph.not(value),
            ContactKind::Rising => {
                let last = self.slot(format!("{}.rising", contact.operand), false);
                self.rising(last, value)
            }
            ContactKind::Falling => {
                let last = self.slot(format!("{}.falling", contact.operand), false);
                self.falling(last, value)
            }
        }
    }

    fn coil(&mut self, kind: CoilKind, target: &str, power: Expression) {
        let place = self.places[target];
        let value = match kind {
            CoilKind::Plain => power,
            CoilKind::Negated => self.graph.not(power),
            CoilKind::Set => {
                let present = self.read(place);
                self.graph.or(power, present)
            }
            CoilKind::Reset => {
                let present = self.read(place);
                let idle = self.graph.not(power);
                self.graph.and(idle, present)
            }
            CoilKind::Rising => {
                let last = self.slot(format!("{target}.rising"), false);
                self.rising(last, power)
            }
            CoilKind::Falling => {
                let last = self.slot(format!("{target}.falling"), false);
                self.falling(last, power)
            }
        };
        self.write(place, value);
    }

    /// R_TRIG; `last` holds the clock of the last scan.
    fn rising(&mut self, last: usize, clock: Expression) -> Expression {
        let old = self.read(last);
        self.write(last, clock);
        let was_low = self.graph.not(old);
        self.graph.and(clock, was_low)
    }

    /// F_TRIG; `last` holds the negated clock of the last scan.
    fn falling(&mut self, last: usize, clock: Expression) -> Expression {
        let low = self.graph.not(clock);
        self.rising(last, low)
    }

    fn compared(&mut self, comparison: &Comparison) -> Expression {
        let number = self.number(&comparison.counter);
        number.compare(&mut self.graph, comparison.relation, u64::from(comparison.value))
    }

    fn number(&mut self, block: &str) -> Number {
        let (first, width) = self.numbers[block];
        Number((first..first + width).map(|place| self.read(place)).collect())
    }

    /// Numbers the registers and moves everything into one circuit.
    fn finish(self, program: &Program, shown: Vec<(String, Expression)>) -> Circuit {
        let mut builder = CircuitBuilder::new(program.name.to_string());
        for signal in &program.inputs {
            builder.input(signal.name.to_string());
        }
        let mut values = vec![None; self.slots.len()];
        let mut registers: Vec<RegisterId> = Vec::new();
        let mut roots = Vec::new();
        for (place, slot) in self.slots.iter().enumerate() {
            if slot.is_register {
                let (register, value) = builder.register(slot.name.clone(), slot.initial);
                registers.push(register);
                values[place] = Some(value);
                roots.push(slot.present.expect("what is written somewhere has a value"));
            }
        }
        roots.extend(shown.iter().map(|(_, value)| *value));
        let roots = builder.graph().import(&self.graph, &roots, |graph, variable| match variable {
            Variable::Input(_) => graph.variable(variable),
            Variable::Register(place) => {
                values[place as usize].expect("only registers are variables")
            }
        });
        let (next, outputs) = roots.split_at(registers.len());
        for (register, &next) in registers.into_iter().zip(next) {
            builder.set_next(register, next);
        }
        for ((name, _), &value) in shown.into_iter().zip(outputs) {
            builder.output(name, value);
        }
        builder.finish().expect("names were checked to be unique")
    }
}

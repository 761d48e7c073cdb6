//! One scan of a program, with what the power did in it.
//!
//! The program is executed with a variable for every element that keeps what the element read where it read it; where the power came and what it
//! passed follows from that.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use understudy_bits::Layout;
use understudy_logic::unpack;
use understudy_typed::{Machine, Point, Program as Typed, Scratch};

use crate::flow::{ElementFlow, Evaluation, Reading, RungFlow};
use crate::lower::{LowerError, of_text, validate};
use crate::names::StandardNames;
use crate::program::{Block, Coil, CoilKind, ContactKind, Element, Program, Rung, Series, Signal};
use crate::structured_text::Written;

/// A program that keeps what its elements read.
#[derive(Debug)]
struct Watched {
    program: Program,
    names: StandardNames,
    typed: Typed,
    machine: Machine,
    /// Points of what is kept, in the order of the scan.
    taps: Vec<Point>,
    outputs: Vec<Point>,
}

impl Watched {
    fn new(program: &Program, period: Duration) -> Result<Self, LowerError> {
        let written = Written::new(program, period, true);
        let mut typed = of_text(program, &written, period)?;
        let names = StandardNames::of(program);
        typed.inputs.put_first(program.inputs.iter().map(|signal| names.signal(&signal.name)));
        let known: HashMap<&str, &Point> =
            typed.outputs.iter().map(|point| (point.name.as_str(), point)).collect();
        let point = |name: &str| known.get(name).map(|&point| point.clone());
        let outputs = program.outputs.iter().filter_map(|signal| point(names.signal(&signal.name)));
        let outputs = outputs.collect();
        let taps = written.taps.iter().filter_map(|name| point(name)).collect();
        let machine = Machine::new(&typed);
        Ok(Self { program: program.clone(), names, machine, taps, outputs, typed })
    }

    /// The scan from `state`, which becomes the state after it.
    fn scan(&self, state: &mut Vec<u64>, inputs: &[u64]) -> Evaluation {
        state.resize(self.typed.state as usize, 0);
        let mut image = vec![0; self.typed.outputs.width().div_ceil(64)];
        self.machine.step(&mut Scratch::default(), state, inputs, &mut image);
        let mut flow = Flow { image: &image, taps: self.taps.iter(), elements: Vec::new() };
        let rungs = self.program.rungs.iter().map(|rung| flow.rung(rung)).collect();
        let memory = self.program.memory.iter().map(|_| flow.bit()).collect();
        Evaluation {
            inputs: unpack(inputs, self.program.inputs.len()),
            outputs: self.outputs.iter().map(|point| point.get(&image) == 1).collect(),
            memory,
            rungs,
        }
    }
}

/// Follows the power through a scan.
struct Flow<'a> {
    image: &'a [u64],
    taps: std::slice::Iter<'a, Point>,
    elements: Vec<ElementFlow>,
}

impl Flow<'_> {
    /// The next value that was kept.
    fn next(&mut self) -> u64 {
        self.taps.next().map_or(0, |point| point.get(self.image))
    }

    fn bit(&mut self) -> bool {
        self.next() == 1
    }

    fn rung(&mut self, rung: &Rung) -> RungFlow {
        let power = self.series(&rung.network, true);
        let mut targets: HashMap<&str, bool> = HashMap::new();
        for coil in &rung.coils {
            let before = self.bit();
            targets.insert(&coil.target, before);
        }
        let mut coils = Vec::with_capacity(rung.coils.len());
        for Coil { kind, target } in &rung.coils {
            let before = targets.get(target.as_str()).copied().unwrap_or_default();
            let after = match kind {
                CoilKind::Plain => power,
                CoilKind::Negated => !power,
                CoilKind::Set => before || power,
                CoilKind::Reset => before && !power,
                CoilKind::Rising | CoilKind::Falling => self.bit(),
            };
            targets.insert(target, after);
            coils.push(after);
        }
        RungFlow { elements: std::mem::take(&mut self.elements), power, coils }
    }

    fn series(&mut self, series: &Series, power: bool) -> bool {
        let mut power = power;
        for element in series {
            let enters = power;
            let (passes, reading);
            match element {
                Element::Contact(contact) => {
                    let value = self.bit();
                    passes = match contact.kind {
                        ContactKind::NormallyOpen => value,
                        ContactKind::NormallyClosed => !value,
                        ContactKind::Rising | ContactKind::Falling => self.bit(),
                    };
                    reading = Reading::Bit(value);
                    power = enters && passes;
                }
                Element::Comparison(comparison) => {
                    let value = u16::try_from(self.next()).unwrap_or(u16::MAX);
                    passes = comparison.relation.holds(value, comparison.value);
                    reading = Reading::Number(value);
                    power = enters && passes;
                }
                Element::Branches(branches) => {
                    power = false;
                    for branch in branches {
                        power |= self.series(branch, enters);
                    }
                    (passes, reading) = (power, Reading::Nothing);
                }
                Element::Block(block) => {
                    (power, reading) = self.block(block);
                    passes = power;
                }
            }
            self.elements.push(ElementFlow { enters, passes, leaves: power, reading });
        }
        power
    }

    fn block(&mut self, block: &Block) -> (bool, Reading) {
        for feed in &block.pins {
            self.series(&feed.network, true);
        }
        let output = self.bit();
        let reading = match block.kind {
            kind if kind.preset_time().is_some() => {
                Reading::Time(kind.shown_time(Duration::from_nanos(self.next()), output))
            }
            kind if kind.preset_value().is_some() => {
                Reading::Number(u16::try_from(self.next()).unwrap_or(u16::MAX))
            }
            _ => Reading::Nothing,
        };
        (output, reading)
    }
}

/// Looks into the scans of one program, whose states are those of its circuit.
#[derive(Debug, Clone)]
pub struct Observer {
    watched: Arc<Watched>,
    layout: Layout,
}

impl Observer {
    /// For a program that is scanned once a `period`, with the layout of the states of its circuit for the same period.
    ///
    /// # Errors
    /// As [`Program::lower`].
    pub fn new(program: &Program, layout: Layout, period: Duration) -> Result<Self, LowerError> {
        Ok(Self { watched: Arc::new(Watched::new(program, period)?), layout })
    }

    /// The scan of u(t) in the state x(t), both packed.
    ///
    /// # Panics
    /// If a slice is shorter than its image; widths are the caller's promise.
    pub fn evaluate(&self, state: &[u64], inputs: &[u64]) -> Evaluation {
        self.watched.scan(&mut self.layout.state(state), inputs)
    }
}

/// A running program.
#[derive(Debug, Clone)]
pub struct Interpreter {
    watched: Arc<Watched>,
    state: Vec<u64>,
}

impl Interpreter {
    /// Before the first scan; `period` is the time from one scan to the next.
    ///
    /// # Errors
    /// As [`Program::typed`].
    pub fn new(program: &Program, period: Duration) -> Result<Self, LowerError> {
        validate(program, period)?;
        let watched = Watched::new(program, period)?;
        let state = watched.typed.initial_state();
        Ok(Self { watched: Arc::new(watched), state })
    }

    /// One scan: u(t) in, y(t) out, both in the order of their declaration.
    ///
    /// # Panics
    /// If `inputs` is not as wide as the program's inputs.
    pub fn scan(&mut self, inputs: &[bool]) -> Vec<bool> {
        self.scan_observed(inputs).outputs
    }

    /// [`Self::scan`], and what the power did in every rung.
    ///
    /// # Panics
    /// If `inputs` is not as wide as the program's inputs.
    pub fn scan_observed(&mut self, inputs: &[bool]) -> Evaluation {
        assert_eq!(inputs.len(), self.watched.program.inputs.len(), "one value per input");
        self.watched.scan(&mut self.state, &understudy_logic::pack(inputs.iter().copied()))
    }

    /// The present value of a signal or of a block's output such as `pause.Q`; `None` for a name that is neither.
    pub fn value(&self, name: &str) -> Option<bool> {
        let Watched { program, names, typed, .. } = &*self.watched;
        let mut signals = program.inputs.iter().chain(program.writable());
        let is_signal = signals.any(|signal: &Signal| signal.name.as_str() == name);
        if !is_signal {
            let (block, pin) = name.rsplit_once('.')?;
            let mut blocks = program.blocks().into_iter();
            let block = blocks.find(|known| known.name.as_str() == block)?;
            block.kind.outputs().contains(&pin).then_some(())?;
        }
        let (_, stored) = typed.part(&names.operand(name))?.stored(&self.state)?;
        Some(stored == 1)
    }
}

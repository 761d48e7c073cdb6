//! One scan of a program from any of its states, with what the power did in it.
//!
//! The very circuit that a station evaluates, with a wire led out at every element: so a scan is looked at from x(t) and u(t) alone,
//! without the scans before it. [`Interpreter::scan_observed`](crate::Interpreter::scan_observed) is the reference.

use std::time::Duration;

use understudy_logic::{Expression, Scan, Scratch, unpack};

use super::number::Number;
use super::{LowerError, Lowering, preset_scans, validate};
use crate::flow::{ElementFlow, Evaluation, Reading, RungFlow};
use crate::program::{Block, BlockKind, Program};

/// What the wires of one element's reading are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wires {
    None,
    Bit,
    /// The bits of a number.
    Number(usize),
    /// Whether the timer runs or is full, then the bits of its count of scans; its preset.
    Time(usize, Duration),
}

/// The wires that are led out, in the order of the scan.
#[derive(Debug, Default)]
pub(super) struct Tapped {
    values: Vec<Expression>,
    elements: Vec<Wires>,
}

impl Tapped {
    fn element(&mut self, power: [Expression; 3], wires: Wires, reading: &[Expression]) {
        self.values.extend(power);
        self.values.extend(reading);
        self.elements.push(wires);
    }
}

/// The values of a block in addition to its power, before and after its evaluation.
pub(super) struct BlockTap(Option<Number>);

impl<'a> Lowering<'a> {
    /// Leads a wire out of an element: power that comes to it, whether it passes power, power that leaves it, what it reads.
    pub(super) fn tap_element(
        &mut self,
        power: [Expression; 3],
        wires: Wires,
        reading: &[Expression],
    ) {
        if let Some(tapped) = &mut self.tapped {
            tapped.element(power, wires, reading);
        }
    }

    /// Leads wires out that belong to the rung.
    pub(super) fn tap(&mut self, values: &[Expression]) {
        if let Some(tapped) = &mut self.tapped {
            tapped.values.extend(values);
        }
    }

    fn tapped_elements(&self) -> usize {
        self.tapped.as_ref().map_or(0, |tapped| tapped.elements.len())
    }

    pub(super) fn before_block(&mut self, block: &'a Block) -> BlockTap {
        let timer = self.tapped.is_some() && block.kind.preset_time().is_some();
        BlockTap(timer.then(|| self.number(&block.name)))
    }

    pub(super) fn tap_block(
        &mut self,
        block: &'a Block,
        BlockTap(before): BlockTap,
        enters: Expression,
        leaves: Expression,
    ) {
        if self.tapped.is_none() {
            return;
        }
        let mut reading = Vec::new();
        let wires = match (block.kind.preset_time(), before) {
            (Some(preset), Some(scans)) => {
                let full = preset_scans(preset, self.period);
                let full = scans.equals(&mut self.graph, full);
                let shows = match block.kind {
                    BlockKind::Tof(_) => self.graph.not(enters),
                    BlockKind::Tp(_) => {
                        let over = self.graph.and(full, enters);
                        self.graph.or(leaves, over)
                    }
                    _ => enters,
                };
                reading.push(shows);
                reading.extend(&scans.0);
                Wires::Time(scans.0.len(), preset)
            }
            _ if block.kind.preset_value().is_some() => {
                reading = self.number(&block.name).0;
                Wires::Number(reading.len())
            }
            _ => Wires::None,
        };
        self.tap_element([enters, leaves, leaves], wires, &reading);
    }
}

/// How many elements and coils a rung has.
#[derive(Debug, Clone, Copy)]
struct Shape {
    elements: usize,
    coils: usize,
}

/// Looks into the scans of one program.
#[derive(Debug, Clone)]
pub struct Observer {
    scan: Scan,
    elements: Vec<Wires>,
    rungs: Vec<Shape>,
    inputs: usize,
    outputs: usize,
    memory: usize,
    period: Duration,
}

impl Observer {
    /// For a program that is scanned once a `period`. Its states are those of [`Program::lower`] with the same period.
    ///
    /// # Errors
    /// As [`Program::lower`].
    pub fn new(program: &Program, period: Duration) -> Result<Self, LowerError> {
        validate(program, period)?;
        let mut lowering = Lowering::new(program, period);
        lowering.tapped = Some(Tapped::default());
        let mut rungs = Vec::new();
        for rung in &program.rungs {
            let before = lowering.tapped_elements();
            lowering.rung(rung);
            rungs.push(Shape {
                elements: lowering.tapped_elements() - before,
                coils: rung.coils.len(),
            });
        }
        let tapped = lowering.tapped.take().unwrap_or_default();
        let signals = program.outputs.iter().chain(&program.memory);
        let signals: Vec<String> = signals.map(|signal| signal.name.to_string()).collect();
        let mut shown: Vec<(String, Expression)> = Vec::new();
        for name in signals {
            let value = lowering.signal(&name);
            shown.push((format!("signal {name}"), value));
        }
        let wires = tapped.values.into_iter().enumerate();
        shown.extend(wires.map(|(number, value)| (format!("wire {number}"), value)));
        let circuit = lowering.finish(program, shown);
        Ok(Self {
            scan: Scan::new(&circuit),
            elements: tapped.elements,
            rungs,
            inputs: program.inputs.len(),
            outputs: program.outputs.len(),
            memory: program.memory.len(),
            period,
        })
    }

    /// The scan of u(t) in the state x(t), both packed.
    ///
    /// # Panics
    /// If a slice is shorter than its image; widths are the caller's promise.
    pub fn evaluate(&self, scratch: &mut Scratch, state: &[u64], inputs: &[u64]) -> Evaluation {
        let mut state = state.to_vec();
        let mut packed = vec![0; self.scan.output_count().div_ceil(64)];
        self.scan.step(scratch, &mut state, inputs, &mut packed);
        let mut bits = unpack(&packed, self.scan.output_count()).into_iter();
        let mut take = |count: usize| -> Vec<bool> { bits.by_ref().take(count).collect() };
        let outputs = take(self.outputs);
        let memory = take(self.memory);
        let mut elements = self.elements.iter();
        let mut rungs = Vec::with_capacity(self.rungs.len());
        for shape in &self.rungs {
            let of_rung = elements.by_ref().take(shape.elements);
            let flows = of_rung.map(|wires| {
                let flow = take(3);
                let reading = self.reading(*wires, &mut take);
                ElementFlow { enters: flow[0], passes: flow[1], leaves: flow[2], reading }
            });
            let flows = flows.collect();
            let power = take(1)[0];
            rungs.push(RungFlow { elements: flows, power, coils: take(shape.coils) });
        }
        Evaluation { inputs: unpack(inputs, self.inputs), outputs, memory, rungs }
    }

    fn reading(&self, wires: Wires, take: &mut impl FnMut(usize) -> Vec<bool>) -> Reading {
        match wires {
            Wires::None => Reading::Nothing,
            Wires::Bit => Reading::Bit(take(1)[0]),
            Wires::Number(width) => {
                Reading::Number(u16::try_from(number(&take(width))).unwrap_or(u16::MAX))
            }
            Wires::Time(width, preset) => {
                let shows = take(1)[0];
                let scans = u32::try_from(number(&take(width))).unwrap_or(u32::MAX);
                let elapsed = self.period.saturating_mul(scans).min(preset);
                Reading::Time(if shows { elapsed } else { Duration::ZERO })
            }
        }
    }
}

fn number(bits: &[bool]) -> u64 {
    let bits = bits.iter().enumerate();
    bits.fold(0, |number, (place, &bit)| number | u64::from(bit) << place)
}

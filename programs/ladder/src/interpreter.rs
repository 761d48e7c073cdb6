//! The reference: a naive interpreter of the scan.
//!
//! One scan takes the inputs, evaluates the rungs in order, each from the left rail to its coils and each seeing what the
//! rungs above it have written, and gives the outputs as they stand at the end. Every element is evaluated in every scan,
//! also behind an open contact: an edge contact without power still sees its operand, a timer without power is stopped.
//! Names are looked up by text and time is a time; everything faster is proved equal to this.

mod blocks;

use std::collections::HashMap;
use std::time::Duration;

use self::blocks::{BlockState, FallingTrigger, RisingTrigger};
use crate::flow::{ElementFlow, Evaluation, Reading, RungFlow};
use crate::lower::{LowerError, validate};
use crate::program::{Block, CoilKind, ContactKind, Element, Program, Series, Signal, visit};

/// A running program.
#[derive(Debug, Clone)]
pub struct Interpreter<'a> {
    program: &'a Program,
    period: Duration,
    now: Duration,
    /// Signals and output pins of blocks.
    values: HashMap<String, bool>,
    blocks: HashMap<&'a str, BlockState>,
    /// One per edge contact and edge coil, in the order of the scan.
    rising: Vec<RisingTrigger>,
    falling: Vec<FallingTrigger>,
    next_rising: usize,
    next_falling: usize,
}

impl<'a> Interpreter<'a> {
    /// Before the first scan; `period` is the time from one scan to the next.
    ///
    /// # Errors
    /// Those of [`Program::lower`], of which a program without errors has only the ones about periods and presets.
    pub fn new(program: &'a Program, period: Duration) -> Result<Self, LowerError> {
        validate(program, period)?;
        let mut values = HashMap::new();
        for signal in program.inputs.iter().chain(program.writable()) {
            values.insert(signal.name.to_string(), signal.initial.unwrap_or(false));
        }
        let mut blocks = HashMap::new();
        for block in program.blocks() {
            for pin in block.kind.outputs() {
                values.insert(format!("{}.{pin}", block.name), false);
            }
            blocks.insert(block.name.as_str(), BlockState::new(block.kind));
        }
        Ok(Self {
            program,
            period,
            now: Duration::ZERO,
            values,
            blocks,
            rising: Vec::new(),
            falling: Vec::new(),
            next_rising: 0,
            next_falling: 0,
        })
    }

    /// One scan: u(t) in, y(t) out, both in the order of their declaration.
    ///
    /// # Panics
    /// If `inputs` is not as wide as the program's inputs.
    pub fn scan(&mut self, inputs: &[bool]) -> Vec<bool> {
        self.scan_rungs(inputs, &mut |_| {}, &mut |_, _| {});
        self.values_of(&self.program.outputs)
    }

    /// [`Self::scan`], and what the power did in every rung.
    ///
    /// # Panics
    /// If `inputs` is not as wide as the program's inputs.
    pub fn scan_observed(&mut self, inputs: &[bool]) -> Evaluation {
        let mut elements = Vec::new();
        let mut rungs = Vec::new();
        self.scan_rungs(inputs, &mut |flow| elements.push(flow), &mut |power, coils| {
            rungs.push((power, coils.to_vec()));
        });
        let mut elements = elements.into_iter();
        let rungs = rungs.into_iter().zip(&self.program.rungs);
        let rungs = rungs.map(|((power, coils), rung)| {
            let mut count = 0;
            visit(&rung.network, &mut |_| count += 1);
            RungFlow { elements: elements.by_ref().take(count).collect(), power, coils }
        });
        Evaluation {
            rungs: rungs.collect(),
            inputs: inputs.to_vec(),
            outputs: self.values_of(&self.program.outputs),
            memory: self.values_of(&self.program.memory),
        }
    }

    /// One scan; tells each element, and the power and coils of each rung behind its elements.
    fn scan_rungs(
        &mut self,
        inputs: &[bool],
        element: &mut dyn FnMut(ElementFlow),
        rung_done: &mut dyn FnMut(bool, &[bool]),
    ) {
        let program = self.program;
        assert_eq!(inputs.len(), program.inputs.len(), "one value per input");
        for (signal, &value) in program.inputs.iter().zip(inputs) {
            self.set(&signal.name, value);
        }
        (self.next_rising, self.next_falling) = (0, 0);
        let mut written = Vec::new();
        for rung in &program.rungs {
            let power = self.series(&rung.network, true, element);
            written.clear();
            for coil in &rung.coils {
                match coil.kind {
                    CoilKind::Plain => self.set(&coil.target, power),
                    CoilKind::Negated => self.set(&coil.target, !power),
                    CoilKind::Set if power => self.set(&coil.target, true),
                    CoilKind::Reset if power => self.set(&coil.target, false),
                    CoilKind::Set | CoilKind::Reset => {}
                    CoilKind::Rising => {
                        let pulse = self.rising_trigger(power);
                        self.set(&coil.target, pulse);
                    }
                    CoilKind::Falling => {
                        let pulse = self.falling_trigger(power);
                        self.set(&coil.target, pulse);
                    }
                }
                written.push(self.get(&coil.target));
            }
            rung_done(power, &written);
        }
        self.now += self.period;
    }

    fn values_of(&self, signals: &[Signal]) -> Vec<bool> {
        signals.iter().map(|signal| self.get(&signal.name)).collect()
    }

    /// The present value of a signal or of a block's output such as `pause.Q`; `None` for a name that is neither.
    pub fn value(&self, name: &str) -> Option<bool> {
        self.values.get(name).copied()
    }

    fn get(&self, name: &str) -> bool {
        self.values[name]
    }

    fn set(&mut self, name: &str, value: bool) {
        *self.values.get_mut(name).expect("names were checked") = value;
    }

    fn series(
        &mut self,
        series: &'a Series,
        power: bool,
        seen: &mut dyn FnMut(ElementFlow),
    ) -> bool {
        let mut power = power;
        for element in series {
            let enters = power;
            let (passes, reading);
            match element {
                Element::Contact(contact) => {
                    let value = self.get(&contact.operand);
                    passes = match contact.kind {
                        ContactKind::NormallyOpen => value,
                        ContactKind::NormallyClosed => !value,
                        ContactKind::Rising => self.rising_trigger(value),
                        ContactKind::Falling => self.falling_trigger(value),
                    };
                    reading = Reading::Bit(value);
                    power = enters && passes;
                }
                Element::Comparison(comparison) => {
                    let value = self.blocks[comparison.counter.as_str()].counter_value();
                    passes = comparison.relation.holds(value, comparison.value);
                    reading = Reading::Number(value);
                    power = enters && passes;
                }
                Element::Branches(branches) => {
                    power = false;
                    for branch in branches {
                        power |= self.series(branch, enters, seen);
                    }
                    (passes, reading) = (power, Reading::Nothing);
                }
                Element::Block(block) => {
                    power = self.block(block, enters, seen);
                    let state = &self.blocks[block.name.as_str()];
                    (passes, reading) = (power, state.reading(block.kind, self.now));
                }
            }
            seen(ElementFlow { enters, passes, leaves: power, reading });
        }
        power
    }

    fn block(&mut self, block: &'a Block, power: bool, seen: &mut dyn FnMut(ElementFlow)) -> bool {
        let mut fed = HashMap::new();
        for feed in &block.pins {
            let value = self.series(&feed.network, true, seen);
            fed.insert(feed.pin.as_str(), value);
        }
        let input = |pin: &str| fed.get(pin).copied().unwrap_or(false);
        let state = self.blocks.get_mut(block.name.as_str());
        let state = state.expect("blocks were collected");
        let outputs = state.call(block.kind, self.now, power, input);
        for (pin, value) in block.kind.outputs().iter().zip(outputs) {
            self.set(&format!("{}.{pin}", block.name), value);
        }
        outputs[0]
    }

    fn rising_trigger(&mut self, clock: bool) -> bool {
        if self.next_rising == self.rising.len() {
            self.rising.push(RisingTrigger::default());
        }
        self.next_rising += 1;
        self.rising[self.next_rising - 1].call(clock)
    }

    fn falling_trigger(&mut self, clock: bool) -> bool {
        if self.next_falling == self.falling.len() {
            self.falling.push(FallingTrigger::default());
        }
        self.next_falling += 1;
        self.falling[self.next_falling - 1].call(clock)
    }
}

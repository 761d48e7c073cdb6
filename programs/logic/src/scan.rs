//! A circuit compiled to straight-line instructions over 64-bit words: one state, or 64 states at once, or several times 64.
//!
//! Images are packed words, bit k of word k / 64 being element k (so the low bit of the first word is the first
//! element). For lanes, the word k is element k of 64 independent runs, bit l being the run l.
//! Both read the whole old state before any of the new one is written, as (1)-(2) demand.

mod sparse;

use std::array;

use crate::circuit::Circuit;
use crate::expression::{Expression, Operation, Variable};

pub use sparse::{SPARSE, Sparse, SparseRun};

/// A place in the scratch memory and whether its value is wanted negated: 2 · place + negated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Operand(u32);

impl Operand {
    /// 0 has the place after the inputs and registers.
    fn new(place: usize) -> Self {
        let place = u32::try_from(place).ok().filter(|place| *place < 1 << 30);
        Self(place.expect("fewer than 2^30 places") * 2)
    }

    fn negated(self) -> Self {
        Self(self.0 ^ 1)
    }

    #[inline]
    fn value<const W: usize>(self, values: &[[u64; W]]) -> [u64; W] {
        let negated = u64::from(self.0 & 1).wrapping_neg();
        values[(self.0 >> 1) as usize].map(|word| word ^ negated)
    }
}

/// One operation; its target is the place after that of the one before it.
///
/// Negation is free in its operands, so ∧ and ⊕ are all there is: a ∨ b = ¬(¬a ∧ ¬b). Which of the two it is, is the high bit of
/// `left`. It is computed without a branch, which for a mix of operations would often be guessed wrong.
#[derive(Debug, Clone, Copy)]
struct Instruction {
    left: u32,
    right: Operand,
}

/// Marks an instruction as a sum.
const SUM: u32 = 1 << 31;

impl Instruction {
    fn product(left: Operand, right: Operand) -> Self {
        Self { left: left.0, right }
    }

    fn sum(left: Operand, right: Operand) -> Self {
        Self { left: left.0 | SUM, right }
    }

    #[inline]
    fn value<const W: usize>(self, values: &[[u64; W]]) -> [u64; W] {
        let left = Operand(self.left & !SUM).value(values);
        let right = self.right.value(values);
        // a ⊕ b = (a ∧ b) ⊕ (a ∨ b).
        let sum = u64::from(self.left >> 31).wrapping_neg();
        array::from_fn(|word| left[word] & right[word] ^ (left[word] | right[word]) & sum)
    }
}

/// A compiled circuit; cheap to share, it holds no state.
///
/// Scratch layout: inputs, registers, constant 0, then one place per instruction.
#[derive(Debug, Clone)]
pub struct Scan {
    inputs: usize,
    registers: usize,
    outputs: usize,
    initial: Vec<u64>,
    instructions: Vec<Instruction>,
    next: Vec<Operand>,
    values: Vec<Operand>,
}

/// Working memory of a [`Scan`], whichever; one per thread, reused.
#[derive(Debug, Clone, Default)]
pub struct Scratch(Vec<u64>);

impl Scan {
    /// Compiles what the roots of `circuit` reach. Linear in its operations.
    pub fn new(circuit: &Circuit) -> Self {
        let graph = circuit.graph();
        let inputs = circuit.inputs().len();
        let registers = circuit.registers().len();
        let zero = Operand::new(inputs + registers);
        let reached = graph.reached(&circuit.roots());
        let mut compiled = vec![zero; graph.operations().len()];
        let mut instructions = Vec::new();
        for (index, &operation) in graph.operations().iter().enumerate() {
            if !reached[index] {
                continue;
            }
            let of = |operand: Expression| -> Operand { compiled[operand.index()] };
            let mut push = |instruction| {
                instructions.push(instruction);
                Operand::new(inputs + registers + instructions.len())
            };
            compiled[index] = match operation {
                Operation::Constant(false) => zero,
                Operation::Constant(true) => zero.negated(),
                Operation::Variable(Variable::Input(input)) => Operand::new(input as usize),
                Operation::Variable(Variable::Register(register)) => {
                    Operand::new(inputs + register as usize)
                }
                Operation::Not(operand) => of(operand).negated(),
                Operation::And(left, right) => push(Instruction::product(of(left), of(right))),
                Operation::Or(left, right) => {
                    push(Instruction::product(of(left).negated(), of(right).negated())).negated()
                }
                Operation::Xor(left, right) => push(Instruction::sum(of(left), of(right))),
            };
        }
        let mut initial = vec![0; registers.div_ceil(64)];
        for (index, register) in circuit.registers().iter().enumerate() {
            initial[index / 64] |= u64::from(register.initial) << (index % 64);
        }
        let next = circuit.registers().iter().map(|register| register.next);
        let values = circuit.outputs().iter().map(|output| output.value);
        Self {
            inputs,
            registers,
            outputs: circuit.outputs().len(),
            initial,
            next: next.map(|root| compiled[root.index()]).collect(),
            values: values.map(|root| compiled[root.index()]).collect(),
            instructions,
        }
    }

    /// Width of u in bits.
    pub fn input_count(&self) -> usize {
        self.inputs
    }

    /// Width of x in bits.
    pub fn register_count(&self) -> usize {
        self.registers
    }

    /// Width of y in bits.
    pub fn output_count(&self) -> usize {
        self.outputs
    }

    /// x(0), packed.
    pub fn initial(&self) -> &[u64] {
        &self.initial
    }

    /// Instructions of one step, for judging its cost.
    pub fn instruction_count(&self) -> usize {
        self.instructions.len()
    }

    /// One step of one run: reads u, replaces x(t) by x(t+1), writes y(t); all packed, unused high bits 0.
    ///
    /// # Panics
    /// If a slice is shorter than its image; widths are the caller's promise.
    pub fn step(
        &self,
        scratch: &mut Scratch,
        state: &mut [u64],
        inputs: &[u64],
        outputs: &mut [u64],
    ) {
        let values = self.prepare::<1>(scratch);
        unpack(inputs, &mut values[..self.inputs]);
        unpack(state, &mut values[self.inputs..][..self.registers]);
        self.execute(values);
        pack(values, &self.next, state);
        pack(values, &self.values, outputs);
    }

    /// One step of 64 runs: word k of each slice is element k of all of them.
    ///
    /// # Panics
    /// If a slice is shorter than the width; widths are the caller's promise.
    pub fn step_lanes(
        &self,
        scratch: &mut Scratch,
        state: &mut [u64],
        inputs: &[u64],
        outputs: &mut [u64],
    ) {
        let (state, _) = state.as_chunks_mut();
        let (inputs, _) = inputs.as_chunks();
        let (outputs, _) = outputs.as_chunks_mut();
        self.step_wide::<1>(scratch, state, inputs, outputs);
    }

    /// One step of 64 · `W` runs: the words k of each slice are element k of all of them.
    ///
    /// # Panics
    /// If a slice is shorter than the width; widths are the caller's promise.
    pub fn step_wide<const W: usize>(
        &self,
        scratch: &mut Scratch,
        state: &mut [[u64; W]],
        inputs: &[[u64; W]],
        outputs: &mut [[u64; W]],
    ) {
        let values = self.prepare::<W>(scratch);
        values[..self.inputs].copy_from_slice(&inputs[..self.inputs]);
        values[self.inputs..][..self.registers].copy_from_slice(&state[..self.registers]);
        self.execute(values);
        for (words, operand) in state.iter_mut().zip(&self.next) {
            *words = operand.value(values);
        }
        for (words, operand) in outputs.iter_mut().zip(&self.values) {
            *words = operand.value(values);
        }
    }

    fn prepare<'a, const W: usize>(&self, scratch: &'a mut Scratch) -> &'a mut [[u64; W]] {
        let zero = self.inputs + self.registers;
        let places = zero + 1 + self.instructions.len();
        scratch.0.resize((W * places).max(scratch.0.len()), 0);
        let (values, _) = scratch.0[..W * places].as_chunks_mut();
        values[zero] = [0; W];
        values
    }

    fn execute<const W: usize>(&self, values: &mut [[u64; W]]) {
        let first = self.inputs + self.registers + 1;
        for (place, instruction) in (first..).zip(&self.instructions) {
            values[place] = instruction.value(values);
        }
    }
}

/// One bit of `image` for each of `values`; what is above the low bit is of no account.
fn unpack(image: &[u64], values: &mut [[u64; 1]]) {
    for (&word, values) in image.iter().zip(values.chunks_mut(64)) {
        for (bit, value) in values.iter_mut().enumerate() {
            *value = [word >> bit];
        }
    }
}

/// Packs the low bit of each operand into words; bits past the last are 0.
fn pack(values: &[[u64; 1]], operands: &[Operand], image: &mut [u64]) {
    for (word, operands) in image.iter_mut().zip(operands.chunks(64)) {
        *word = operands
            .iter()
            .enumerate()
            .fold(0, |word, (bit, operand)| word | (operand.value(values)[0] & 1) << bit);
    }
}

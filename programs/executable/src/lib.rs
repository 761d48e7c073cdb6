//! A program as a station executes it: by its circuit, or by the register machine. What uses it does not know which.

mod digest;
mod value;

use std::sync::Arc;

use understudy_logic::{Circuit, Scan};

use understudy_typed::{Elementary, Machine, Point, Points, Program};

pub use self::digest::{Digest, digest};
pub use self::value::{stored_value, typed_value, value_text};

/// A compiled program; cheap to share, it holds no state.
#[derive(Debug, Clone)]
pub struct Executable {
    engine: Engine,
    /// The bits of the state that a warm start keeps, of a program with retentive variables.
    retentive: Option<Arc<[u64]>>,
}

/// What executes it.
#[derive(Debug, Clone)]
enum Engine {
    Circuit(Scan),
    Machine(Machine),
}

/// Working memory of an [`Executable`], whichever; one per thread, reused.
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    circuit: understudy_logic::Scratch,
    machine: understudy_typed::Scratch,
}

impl From<&Circuit> for Executable {
    fn from(circuit: &Circuit) -> Self {
        Self { engine: Engine::Circuit(Scan::new(circuit)), retentive: None }
    }
}

impl From<&Program> for Executable {
    fn from(program: &Program) -> Self {
        Self { engine: Engine::Machine(Machine::new(program)), retentive: None }
            .keeping(program.retentive_mask())
    }
}

impl Executable {
    /// The same program, of whose state a warm start keeps the bits of a mask.
    #[must_use]
    pub fn keeping(mut self, mask: Vec<u64>) -> Self {
        self.retentive = mask.iter().any(|word| *word != 0).then(|| mask.into());
        self
    }

    /// Whether any part of the state is kept over a restart.
    pub fn is_retentive(&self) -> bool {
        self.retentive.is_some()
    }

    /// The bits of the state that are kept over a restart, packed; nothing where none is.
    pub fn retained(&self) -> Option<&[u64]> {
        self.retentive.as_deref()
    }

    /// The state of a warm start: the initial state with the retentive parts of `state`, packed as `state`. A program fault is not among them.
    pub fn restarted(&self, state: &[u64]) -> Vec<u64> {
        let mut restarted = self.initial().to_vec();
        if let Some(mask) = &self.retentive {
            for ((word, &kept), &mask) in restarted.iter_mut().zip(state).zip(&**mask) {
                *word = *word & !mask | kept & mask;
            }
        }
        restarted
    }

    /// Width of u in bits.
    pub fn input_count(&self) -> usize {
        match &self.engine {
            Engine::Circuit(scan) => scan.input_count(),
            Engine::Machine(machine) => machine.input_count(),
        }
    }

    /// Width of x in bits.
    pub fn state_count(&self) -> usize {
        match &self.engine {
            Engine::Circuit(scan) => scan.register_count(),
            Engine::Machine(machine) => machine.state_words() * 64,
        }
    }

    /// Width of y in bits.
    pub fn output_count(&self) -> usize {
        match &self.engine {
            Engine::Circuit(scan) => scan.output_count(),
            Engine::Machine(machine) => machine.output_count(),
        }
    }

    /// x(0), packed.
    pub fn initial(&self) -> &[u64] {
        match &self.engine {
            Engine::Circuit(scan) => scan.initial(),
            Engine::Machine(machine) => machine.initial(),
        }
    }

    /// One step: reads u, replaces x(t) by x(t+1), writes y(t); all packed, unused high bits 0.
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
        match &self.engine {
            Engine::Circuit(scan) => scan.step(&mut scratch.circuit, state, inputs, outputs),
            Engine::Machine(machine) => machine.step(&mut scratch.machine, state, inputs, outputs),
        }
    }
}

/// What a program reads and writes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Interface {
    /// u, point by point.
    pub inputs: Points,
    /// y, point by point.
    pub outputs: Points,
}

/// Each input and output is a BOOL of its own name.
impl From<&Circuit> for Interface {
    fn from(circuit: &Circuit) -> Self {
        let mut interface = Self::default();
        for name in circuit.inputs() {
            interface.inputs.push(name, Elementary::Bool, 0);
        }
        for output in circuit.outputs() {
            interface.outputs.push(&output.name, Elementary::Bool, 0);
        }
        interface
    }
}

impl From<&Program> for Interface {
    fn from(program: &Program) -> Self {
        Self { inputs: program.inputs.clone(), outputs: program.outputs.clone() }
    }
}

/// The points that a program declares: the reset and the fault of a program with numbers are not among them.
pub fn declared(points: &Points) -> impl Iterator<Item = &Point> {
    let implied = [Program::RESET, Program::FAULT];
    points.iter().filter(move |point| !implied.contains(&point.name.as_str()))
}

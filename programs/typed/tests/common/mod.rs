//! Random programs: every kind of statement, place, call and operation.

#![allow(dead_code)]

mod code;
mod guarded;
mod operations;
mod places;

use std::sync::Arc;

use understudy_typed::{
    Array, Declared, Elementary, Enumeration, EnumerationId, Field, Initial, Place, Program, Root,
    Routine, RoutineId, RoutineKind, Structure, StructureId, Task, Type, Variable,
};

/// Random numbers from a seed (splitmix64).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Below `end`.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// In so many of a hundred cases.
    pub(crate) fn percent(&mut self, share: usize) -> bool {
        self.below(100) < share
    }

    pub(crate) fn pick<'a, T>(&mut self, among: &'a [T]) -> &'a T {
        &among[self.below(among.len())]
    }

    pub(crate) fn elementary(&mut self) -> Elementary {
        *self.pick(&Elementary::ALL)
    }

    /// A stored value: small, at a bound, special or any.
    pub(crate) fn value(&mut self, of: Elementary) -> u64 {
        let special = [
            f64::NAN.to_bits(),
            f64::INFINITY.to_bits(),
            (-0.0_f64).to_bits(),
            1.5_f64.to_bits(),
            1e-310_f64.to_bits(),
            u64::from(f32::NAN.to_bits() | 1),
            u64::from(1.5_f32.to_bits()),
            u64::from(f32::NEG_INFINITY.to_bits()),
            0xfff8_0000_0000_0001,
        ];
        let stored = match self.below(6) {
            0 => self.next() % 4,
            1 => u64::MAX - self.next() % 4,
            2 => 1 << (of.bits() - 1),
            3 => *self.pick(&special),
            4 if of == Elementary::Lreal => (self.below(2_000) as f64 / 8.0 - 100.0).to_bits(),
            4 if of == Elementary::Real => {
                u64::from((self.below(2_000) as f32 / 8.0 - 100.0).to_bits())
            }
            _ => self.next(),
        };
        stored & of.mask()
    }
}

/// A variable that code may use.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    pub(crate) root: Root,
    pub(crate) of: Type,
    /// Written by nobody but a loop that counts with it.
    pub(crate) is_constant: bool,
}

/// What can be called.
#[derive(Debug, Clone)]
pub(crate) struct Callable {
    pub(crate) id: RoutineId,
    /// The block's instance, for a method or a block.
    pub(crate) structure: Option<Type>,
    pub(crate) is_method: bool,
    /// Value parameters, with their places in the routine.
    pub(crate) values: Vec<Place>,
    /// Parameters that refer to variables: the slot, with the type of the variable.
    pub(crate) references: Vec<Place>,
    pub(crate) result: Option<Place>,
    pub(crate) output: Option<Place>,
    /// Fields of the block that refer to variables.
    pub(crate) bound: Vec<(u32, Type)>,
}

/// A program that grows.
pub(crate) struct Generator {
    pub(crate) random: Random,
    pub(crate) program: Program,
    pub(crate) callables: Vec<Callable>,
    pub(crate) globals: Vec<Known>,
    pub(crate) types: Vec<Type>,
}

/// A random program of about so many statements a routine.
pub(crate) fn program(seed: u64, statements: usize) -> Program {
    let mut generator = Generator {
        random: Random(seed),
        program: Program {
            name: "random".to_owned(),
            period: 10_000_000,
            budget: 10_000,
            state: Program::HEADER,
            ..Program::default()
        },
        callables: Vec::new(),
        globals: Vec::new(),
        types: Vec::new(),
    };
    generator.declare_types();
    generator.declare_globals();
    for index in 0..3 + generator.random.below(3) {
        generator.routine(index, statements);
    }
    generator.main(statements);
    generator.program.seal_points();
    generator.program
}

impl Generator {
    fn declare_types(&mut self) {
        self.program.enumerations.push(Arc::new(Enumeration {
            name: "Mode".to_owned(),
            values: vec![("off".to_owned(), 0), ("on".to_owned(), 1)],
        }));
        self.types = Elementary::ALL.map(Type::Elementary).to_vec();
        self.types.push(Type::Enumeration(EnumerationId(0), Elementary::Int));
        self.types.push(Type::Text(5));
        self.types.push(Type::Text(24));
        for _ in 0..5 {
            let element = self.random.pick(&self.types).clone();
            let mut ranges = vec![(-1, 1 + self.random.below(6) as i64)];
            if self.random.percent(40) {
                ranges.push((0, self.random.below(3) as i64));
            }
            let array = Array { ranges, element };
            self.types.push(Type::Array(Arc::new(array)));
            let structure = self.structure("Part");
            self.types.push(structure);
        }
    }

    /// A structure of a few fields.
    fn structure(&mut self, name: &str) -> Type {
        let mut fields = Vec::new();
        let mut slot = 0;
        for index in 0..1 + self.random.below(4) {
            let of = self.random.pick(&self.types).clone();
            let slots = of.slots() as u32;
            fields.push(Field { name: format!("f{index}"), of, slot, is_reference: false });
            slot += slots;
        }
        let id = self.program.structures.len();
        self.program.structures.push(Structure { name: format!("{name}{id}"), fields });
        Type::Structure(StructureId(id as u32), slot)
    }

    fn global(&mut self, name: String, of: Type) -> u32 {
        let slot = self.program.state;
        self.program.state += of.slots() as u32;
        self.globals.push(Known { root: Root::Global(slot), of: of.clone(), is_constant: false });
        self.program.variables.push(Variable { name, of, slot, address: None, description: None });
        slot
    }

    /// A subrange for about every other point that is a whole number.
    fn subrange(&mut self, of: Elementary) -> Option<(i128, i128)> {
        let is_whole = of.is_integer() || of.is_bit_string() && of != Elementary::Bool;
        if !is_whole || self.random.below(2) == 0 {
            return None;
        }
        let ends = [0; 2].map(|_| of.signed(self.random.value(of)));
        Some((ends[0].min(ends[1]), ends[0].max(ends[1])))
    }

    fn declare_globals(&mut self) {
        for index in 0..6 {
            let of = self.random.elementary();
            let slot = self.global(format!("u{index}"), Type::Elementary(of));
            let range = self.subrange(of);
            self.program.inputs.push_declared(
                format!("u{index}"),
                Declared { range, ..of.into() },
                slot,
            );
        }
        for index in 0..6 {
            let of = self.random.elementary();
            let slot = self.global(format!("y{index}"), Type::Elementary(of));
            let range = self.subrange(of);
            self.program.outputs.push_declared(
                format!("y{index}"),
                Declared { range, ..of.into() },
                slot,
            );
        }
        for index in 0..8 {
            let of = self.random.pick(&self.types).clone();
            let slot = self.global(format!("v{index}"), of.clone());
            if let Some(of) = of.elementary() {
                let value = self.random.value(of);
                self.program.initial.push(Initial { slot, value });
            }
        }
    }

    /// A function, a block or a method.
    fn routine(&mut self, index: usize, statements: usize) {
        let id = RoutineId(self.program.routines.len() as u32);
        let first = self.program.frames;
        let mut scope = Vec::new();
        let mut callable = Callable {
            id,
            structure: None,
            is_method: false,
            values: Vec::new(),
            references: Vec::new(),
            result: None,
            output: None,
            bound: Vec::new(),
        };
        let kind = self.random.below(3);
        if kind > 0 {
            let (structure, bound) = self.block(&mut scope);
            callable.structure = Some(structure);
            callable.bound = bound;
            callable.is_method = kind == 2;
        }
        let mut initial = Vec::new();
        let slots = 2 + self.random.below(5);
        for number in 0..slots {
            let of = match self.random.percent(60) {
                true => Type::Elementary(self.random.elementary()),
                false => self.random.pick(&self.types).clone(),
            };
            let slot = self.program.frames;
            let place = Place::new(Root::Frame(slot), of.clone());
            if number == 0 {
                callable.result = Some(place.clone());
            } else if kind != 1 && self.random.percent(25) {
                self.program.frames += 1;
                scope.push(Known { root: Root::FrameReference(slot), of, is_constant: false });
                callable.references.push(place);
                continue;
            } else if self.random.percent(50) {
                callable.values.push(place.clone());
            } else if self.random.percent(50) {
                callable.output = Some(place.clone());
            }
            if let Some(of) = of.elementary() {
                let value = self.random.value(of);
                initial.push(Initial { slot, value });
            }
            self.program.frames += of.slots() as u32;
            scope.push(Known { root: Root::Frame(slot), of, is_constant: false });
        }
        if kind == 1 {
            callable.values.clear();
            callable.output = None;
            callable.result = None;
        }
        let body = code::body(self, &scope, statements);
        self.program.routines.push(Routine {
            name: format!("routine{index}"),
            kind: match kind {
                0 => RoutineKind::Function,
                _ => RoutineKind::Block,
            },
            frame: (first, self.program.frames - first),
            initial,
            body,
            timer: None,
        });
        self.callables.push(callable);
    }

    /// The memory of a block, with an instance or two of it among the global variables.
    fn block(&mut self, scope: &mut Vec<Known>) -> (Type, Vec<(u32, Type)>) {
        let Type::Structure(id, mut slots) = self.structure("Block") else {
            unreachable!("a structure");
        };
        let mut bound = Vec::new();
        for field in &self.program.structures[id.0 as usize].fields {
            scope.push(Known {
                root: Root::Own(field.slot),
                of: field.of.clone(),
                is_constant: false,
            });
        }
        if self.random.percent(50) {
            let of = self.random.pick(&self.types).clone();
            self.program.structures[id.0 as usize].fields.push(Field {
                name: "reference".to_owned(),
                of: of.clone(),
                slot: slots,
                is_reference: true,
            });
            scope.push(Known {
                root: Root::OwnReference(slots),
                of: of.clone(),
                is_constant: false,
            });
            bound.push((slots, of));
            slots += 1;
        }
        let of = Type::Structure(id, slots);
        self.global(format!("instance{}", id.0), of.clone());
        if self.random.percent(50) {
            let array = Array { ranges: vec![(1, 3)], element: of.clone() };
            self.global(format!("instances{}", id.0), Type::Array(Arc::new(array)));
        }
        (of, bound)
    }

    fn main(&mut self, statements: usize) {
        for task in 0..1 + self.random.below(2) {
            let own = self.program.state;
            let mut scope = Vec::new();
            for index in 0..4 {
                let of = self.random.pick(&self.types).clone();
                let slot = self.global(format!("m{task}{index}"), of.clone());
                scope.push(Known { root: Root::Own(slot - own), of, is_constant: false });
            }
            // Variables of its own are found as such only.
            self.globals.truncate(self.globals.len() - 4);
            let first = self.program.frames;
            let mut body = code::body(self, &scope, 2 * statements);
            body.extend(code::outputs(self, &scope));
            let routine = RoutineId(self.program.routines.len() as u32);
            self.program.routines.push(Routine {
                name: format!("MAIN{task}"),
                kind: RoutineKind::Block,
                frame: (first, self.program.frames - first),
                initial: Vec::new(),
                body,
                timer: None,
            });
            self.program.tasks.push(Task { routine, own, every: 1 + self.random.below(3) as u32 });
        }
    }
}

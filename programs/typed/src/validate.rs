//! Whether a program keeps the invariants of its form.
//!
//! A front end asks after lowering, and tests ask; the engines rely on the answer. What cannot be seen here is whether slots mean what the
//! lowering thinks: a place of the right type at the wrong slot is valid.

mod code;

use std::fmt;

use crate::fault::Fault;
use crate::form::{Program, Root, RoutineId, RoutineKind};
use crate::types::Elementary;

/// Violations that are collected; what follows is not looked for.
const BOUND: usize = 20;

/// A break of an invariant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Violation {
    /// The routine, where it belongs to one.
    pub routine: Option<RoutineId>,
    /// Line of the statement; 0 where it has none.
    pub line: u32,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(routine) = self.routine {
            write!(formatter, "routine {}, line {}: ", routine.0, self.line)?;
        }
        formatter.write_str(&self.what)
    }
}

impl Program {
    /// Slots that state and frames may have each.
    pub const SLOTS: u32 = 1 << 24;

    /// How deep calls, and statements and expressions within a routine, may be nested.
    pub const NESTING: usize = 200;

    /// Checks the invariants. Linear in the size of the program.
    ///
    /// # Errors
    /// The first violations, 20 at most.
    pub fn validate(&self) -> Result<(), Vec<Violation>> {
        let mut check = Check::new(self);
        check.memory();
        check.routines();
        check.nesting();
        if check.found.is_empty() { Ok(()) } else { Err(check.found) }
    }
}

struct Check<'a> {
    program: &'a Program,
    found: Vec<Violation>,
    /// Slots of its instance that each routine uses.
    own: Vec<u64>,
    routine: Option<RoutineId>,
    line: u32,
}

impl<'a> Check<'a> {
    fn new(program: &'a Program) -> Self {
        let own = program
            .routines
            .iter()
            .map(|routine| {
                let mut end = 0;
                code::places(&routine.body, &mut |place| {
                    end = end.max(match place.root {
                        Root::Own(slot) => u64::from(slot) + place.reach().div_ceil(64),
                        Root::OwnReference(slot) => u64::from(slot) + 1,
                        _ => 0,
                    });
                });
                end
            })
            .collect();
        Self { program, found: Vec::new(), own, routine: None, line: 0 }
    }

    /// Notes a violation where something does not hold.
    fn expect(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds && self.found.len() < BOUND {
            self.found.push(Violation { routine: self.routine, line: self.line, what: what() });
        }
    }

    fn is_state(&self, slot: u64, slots: u64) -> bool {
        slot >= u64::from(Program::HEADER) && slot + slots <= u64::from(self.program.state)
    }

    fn memory(&mut self) {
        let program = self.program;
        let slots = [program.state, program.frames];
        let fit = slots.iter().all(|slots| *slots <= Program::SLOTS);
        self.expect(fit && program.state >= Program::HEADER, || {
            format!("state and frames have {slots:?} slots")
        });
        for kept in &program.retained {
            let fits = !kept.is_empty() && self.is_state(kept.start.into(), kept.len() as u64);
            self.expect(fits, || format!("the slots {kept:?} are retentive"));
        }
        let is_apart = program.retained.windows(2).all(|pair| pair[0].end < pair[1].start);
        self.expect(is_apart, || "the retentive slots are not in order".to_owned());
        for points in [&program.inputs, &program.outputs] {
            for point in points {
                let is_own = point.slot == 0 && point.of == Elementary::Bool;
                let fits = is_own || self.is_state(point.slot.into(), 1);
                self.expect(fits, || format!("point {} has no slot", point.name));
            }
        }
        for variable in &program.variables {
            let fits = self.is_state(variable.slot.into(), variable.of.slots());
            self.expect(fits, || format!("variable {} is outside the state", variable.name));
        }
        for initial in &program.initial {
            let fits = self.is_state(initial.slot.into(), 1);
            self.expect(fits, || format!("initial slot {} is outside the state", initial.slot));
        }
        for task in &program.tasks {
            let index = task.routine.0 as usize;
            let routine = program.routines.get(index);
            let is_block = routine.is_some_and(|routine| routine.kind == RoutineKind::Block);
            self.expect(is_block && task.every > 0, || {
                format!("task of routine {index}, every {}", task.every)
            });
            let slots = self.own.get(index).copied().unwrap_or(0);
            let fits = slots == 0 || self.is_state(task.own.into(), slots);
            self.expect(fits, || format!("variables of routine {index} are outside the state"));
        }
    }

    fn routines(&mut self) {
        let program = self.program;
        let count = program.routines.len();
        self.expect(count <= Fault::ROUTINES, || format!("{count} routines"));
        let mut frames: Vec<(u32, u32)> = Vec::new();
        for (index, routine) in program.routines.iter().enumerate() {
            self.routine = Some(RoutineId(index as u32));
            self.line = 0;
            let (first, slots) = routine.frame;
            let end = u64::from(first) + u64::from(slots);
            self.expect(end <= program.frames.into(), || {
                "its frame is outside the frames".to_owned()
            });
            for initial in &routine.initial {
                let is_in_frame = (u64::from(first)..end).contains(&initial.slot.into());
                self.expect(is_in_frame, || {
                    format!("initial slot {} is outside its frame", initial.slot)
                });
            }
            if slots > 0 {
                frames.push(routine.frame);
            }
            self.statements(routine, &routine.body, 0, false);
        }
        (self.routine, self.line) = (None, 0);
        frames.sort_unstable();
        let overlap = frames
            .windows(2)
            .any(|pair| u64::from(pair[0].0) + u64::from(pair[0].1) > u64::from(pair[1].0));
        self.expect(!overlap, || "two routines share a frame".to_owned());
    }

    /// No routine calls itself, and calls are not nested too deep.
    fn nesting(&mut self) {
        let called: Vec<Vec<usize>> = self
            .program
            .routines
            .iter()
            .map(|routine| {
                let mut called = Vec::new();
                crate::visit::calls(&routine.body, &mut |routine| {
                    called.push(routine.0 as usize);
                });
                called.retain(|&index| index < self.program.routines.len());
                called
            })
            .collect();
        // Routines are taken away once all that they call are; what remains calls itself.
        let mut callers = vec![Vec::new(); called.len()];
        let mut open: Vec<usize> = called.iter().map(Vec::len).collect();
        for (index, called) in called.iter().enumerate() {
            for &inner in called {
                callers[inner].push(index);
            }
        }
        let mut depth = vec![0; called.len()];
        let mut ready: Vec<usize> = (0..open.len()).filter(|&index| open[index] == 0).collect();
        let mut taken = 0;
        while let Some(index) = ready.pop() {
            taken += 1;
            for &caller in &callers[index] {
                depth[caller] = depth[caller].max(depth[index] + 1);
                open[caller] -= 1;
                if open[caller] == 0 {
                    ready.push(caller);
                }
            }
        }
        self.expect(taken == called.len(), || {
            let index = open.iter().position(|&open| open > 0).unwrap_or(0);
            format!("routine {} calls itself", self.program.routines[index].name)
        });
        let deepest = depth.into_iter().max().unwrap_or(0);
        self.expect(deepest <= Program::NESTING, || format!("calls are nested {deepest} deep"));
    }
}

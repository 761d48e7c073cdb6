//! A typed program as cells and steps: instances and calls in place, loops written out.
//!
//! Memory is followed by address. What is known of it at a place of the program decides conditions, indices and presets; what a program
//! never writes keeps its initial value. [`Facts`] are gathered by unrolling again until nothing new is found, so the last unrolling relies
//! only on what it has confirmed itself.

mod calls;
mod operations;
mod places;
mod statements;
mod values;

use std::collections::{BTreeMap, HashMap, HashSet};

use understudy_ladder::{KEYWORDS, MAXIMUM_NAME_LENGTH, parse_address};
use understudy_structured_text::lower::Names;
use understudy_typed::{Elementary, Program, RoutineId, Type};

use super::facts::Facts;
use super::program::{Action, Cell, Kind, Resolved, Role, Step};

/// The most steps of a program, those of all calls and turns together.
const MAXIMUM_STEPS: usize = 100_000;
/// The most cells of a program, bits of numbers not counted.
const MAXIMUM_CELLS: usize = 50_000;
/// Unrollings after which a program is given up.
const MAXIMUM_PASSES: usize = 50;

/// Why a program is no ladder.
#[derive(Debug, Clone)]
pub(super) struct Refusal {
    /// What it does that a ladder does not.
    pub(super) what: String,
    /// In this line, from 1; 0 where it has none.
    pub(super) line: u32,
    /// Of the finding.
    pub(super) code: &'static str,
}

type Found<T> = Result<T, Refusal>;

/// What is known of a program beside its form.
pub(super) struct Surroundings<'a> {
    pub(super) names: &'a Names,
    /// The lines of their declarations, by their names in capitals.
    pub(super) places: &'a HashMap<String, u32>,
    /// Comments above statements, by line.
    pub(super) comments: &'a BTreeMap<u32, Vec<String>>,
}

/// Where a body runs.
#[derive(Debug, Clone, Copy)]
struct Context {
    routine: RoutineId,
    /// The first slot of its instance.
    own: u64,
}

struct Unrolling<'a> {
    program: &'a Program,
    around: &'a Surroundings<'a>,
    /// Initial contents that are not 0, of state and frames.
    initial: &'a HashMap<u64, u64>,
    facts: &'a Facts,
    next: Facts,
    /// Which part of which block lies at an address.
    parts: HashMap<u64, (u64, &'static str)>,
    resolved: Resolved,
    cells: HashMap<u64, usize>,
    /// Cells of variables that people see.
    shown: HashSet<usize>,
    /// Names of the points that no variable is, such as `%QX1.1` and the elements of an array at an address.
    unnamed: HashMap<u64, String>,
    inputs: HashMap<u64, Elementary>,
    blocks: HashMap<u64, String>,
    timers: HashMap<u64, usize>,
    /// What is known of addresses, in the choices around; nothing where it is known to be unknown.
    known: Vec<HashMap<u64, Option<u64>>>,
    steps: Vec<Step>,
    count: usize,
    comments: BTreeMap<u32, Vec<String>>,
    /// Choices around.
    depth: usize,
    /// Choices around the innermost loop, and around the innermost routine.
    floor: usize,
    entry: usize,
    line: u32,
    namesakes: HashMap<String, usize>,
}

/// The cells and steps of a program, and the line of each step in place of its span.
pub(super) fn unroll(program: &Program, around: &Surroundings<'_>) -> Found<Resolved> {
    let mut initial = HashMap::new();
    for found in &program.initial {
        initial.insert(u64::from(found.slot), found.value);
    }
    for found in program.routines.iter().flat_map(|routine| &routine.initial) {
        initial.insert(u64::from(program.state + found.slot), found.value);
    }
    let mut facts = Facts::default();
    for _ in 0..MAXIMUM_PASSES {
        let mut unrolling = Unrolling::new(program, around, &initial, &facts);
        unrolling.run()?;
        let (resolved, next) = (unrolling.resolved, unrolling.next);
        let grown = facts.joined(next);
        if grown == facts {
            return Ok(resolved);
        }
        facts = grown;
    }
    Err(Refusal {
        what: "its calls and conditions depend on each other in too many ways".into(),
        line: 0,
        code: "U1048",
    })
}

impl<'a> Unrolling<'a> {
    fn new(
        program: &'a Program,
        around: &'a Surroundings<'a>,
        initial: &'a HashMap<u64, u64>,
        facts: &'a Facts,
    ) -> Self {
        let mut parts = HashMap::new();
        for (block, found) in &facts.blocks {
            for (part, address) in &found.parts {
                parts.insert(*address, (*block, *part));
            }
        }
        let points = program.inputs.iter().filter(|point| point.slot != 0);
        Self {
            program,
            around,
            initial,
            facts,
            next: Facts::default(),
            parts,
            resolved: Resolved::default(),
            cells: HashMap::new(),
            shown: HashSet::new(),
            unnamed: HashMap::new(),
            inputs: points.map(|point| (64 * u64::from(point.slot), point.of)).collect(),
            blocks: HashMap::new(),
            timers: HashMap::new(),
            known: vec![HashMap::new()],
            steps: Vec::new(),
            count: 0,
            comments: around.comments.clone(),
            depth: 0,
            floor: 0,
            entry: 0,
            line: 0,
            namesakes: HashMap::new(),
        }
    }

    fn run(&mut self) -> Found<()> {
        self.declared()?;
        let program = self.program;
        for task in &program.tasks {
            if task.every != 1 {
                return Err(self.refuse("it runs in some scans only"));
            }
            self.begin(task.routine, &[])?;
            let context = Context { routine: task.routine, own: u64::from(task.own) };
            self.body(context)?;
        }
        self.resolved.steps = std::mem::take(&mut self.steps);
        self.prune();
        Ok(())
    }

    /// Leaves out what is written to memory that people do not see and nothing reads.
    fn prune(&mut self) {
        let read = values::read(&self.resolved.steps);
        let mut kept: HashSet<usize> = self.shown.clone();
        kept.extend(read);
        for timer in &self.resolved.timers {
            kept.extend([timer.started, timer.output]);
        }
        drop_unread(&mut self.resolved.steps, &kept);
        for (at, cell) in self.resolved.cells.iter_mut().enumerate() {
            // A pin is not declared.
            if !kept.contains(&at) && matches!(cell.role, Role::Memory | Role::Passing) {
                cell.role = Role::Pin;
            }
        }
    }

    fn refuse(&self, what: impl Into<String>) -> Refusal {
        Refusal { what: what.into(), line: self.line, code: "U1056" }
    }

    /// Cells of the variables that people see, in their order.
    fn declared(&mut self) -> Found<()> {
        let program = self.program;
        let points = program.inputs.iter().chain(program.outputs.iter());
        for point in points.filter(|point| point.slot != 0) {
            if kind_of(point.of).is_none() {
                let line = self.around.places.get(&point.name.to_ascii_uppercase());
                self.line = line.copied().unwrap_or(0);
                return Err(self.refuse(format!(
                    "`{}` is {} {}",
                    point.name,
                    point.of.article(),
                    point.of
                )));
            }
            let address = 64 * u64::from(point.slot);
            if program.part_at(address).is_none() {
                let name = self.unique(&shaped(point.name.trim_start_matches('%')));
                self.unnamed.insert(address, name);
            }
        }
        for variable in &program.variables {
            let address = 64 * u64::from(variable.slot);
            if let Some(of) = variable.of.elementary()
                && kind_of(of).is_some()
            {
                self.cell(address, of)?;
            }
        }
        // Parts of structures are no variables, and points all the same.
        let points = program.inputs.iter().chain(program.outputs.iter());
        for point in points.filter(|point| point.slot != 0) {
            self.cell(64 * u64::from(point.slot), point.of)?;
        }
        Ok(())
    }

    /// Appends a step.
    fn push(&mut self, action: Action) -> Found<()> {
        self.counted()?;
        let comments = match self.line {
            0 => Vec::new(),
            line => self.comments.remove(&line).unwrap_or_default(),
        };
        let line = self.line as usize;
        self.steps.push(Step { action, span: line..line, comments });
        Ok(())
    }

    /// Counts something that is bounded.
    fn counted(&mut self) -> Found<()> {
        self.count += 1;
        if self.count <= MAXIMUM_STEPS {
            return Ok(());
        }
        Err(Refusal {
            code: "U1048",
            ..self.refuse(format!(
                "it has more than {MAXIMUM_STEPS} steps with its loops written out and its blocks in place"
            ))
        })
    }

    /// The cell at an address.
    fn cell(&mut self, address: u64, of: Elementary) -> Found<usize> {
        if let Some(cell) = self.cells.get(&address) {
            return Ok(*cell);
        }
        let Some(kind) = kind_of(of) else {
            return Err(self.refuse(format!("uses {of}")));
        };
        let (wanted, of) = self.name(address, of);
        let slot = address / 64;
        let variables = self.program.variables.iter();
        let mut variables = variables.filter(|variable| u64::from(variable.slot) == slot);
        let variable = variables.next();
        let output = self.program.outputs.iter();
        let is_output = output
            .filter(|point| point.slot != 0)
            .any(|point| 64 * u64::from(point.slot) == address);
        let role = if self.inputs.contains_key(&address) {
            Role::Input
        } else if is_output {
            Role::Output
        } else {
            Role::Memory
        };
        let kind = self.ranged(kind, &of, &wanted);
        let stored = self.initial_value(address, of.elementary());
        let initial = match (of.elementary(), kind) {
            (Some(of), Kind::Number { .. }) => of.signed(stored) as i64,
            _ => (stored & 1) as i64,
        };
        let whole = variable.filter(|variable| variable.of.elementary().is_some());
        let address_of = whole.and_then(|variable| variable.address.as_deref());
        let unnamed = self.unnamed.get(&address).cloned();
        let name = unnamed.clone().unwrap_or_else(|| self.unique(&wanted));
        let address_of = address_of.or(unnamed.as_deref());
        let cell = self.add(Cell {
            name,
            kind,
            role,
            initial,
            is_seen: role == Role::Output || address_of.is_some(),
            is_given: false,
            address: address_of.and_then(|address| parse_address(address.trim_start_matches('%'))),
            description: whole.and_then(|variable| variable.description.clone()),
        })?;
        self.cells.insert(address, cell);
        if role == Role::Output || self.program.part_at(address).is_some() {
            self.shown.insert(cell);
        }
        Ok(cell)
    }

    /// What of a number's type its declaration allows.
    fn ranged(&self, kind: Kind, of: &Type, name: &str) -> Kind {
        let Kind::Number { wide, .. } = kind else {
            return kind;
        };
        let declared = self.around.names.ranges.get(&name.to_ascii_uppercase());
        let whole = |end: i128| i64::try_from(end).ok();
        let declared = declared.and_then(|(low, high)| whole(*low).zip(whole(*high)));
        let values = match of {
            Type::Enumeration(id, _) => {
                let values = &self.program.enumerations[id.0 as usize].values;
                let least = values.iter().map(|(_, value)| *value).min();
                least.zip(values.iter().map(|(_, value)| *value).max())
            }
            _ => None,
        };
        let declared = declared.or(values).unwrap_or(wide);
        Kind::Number { declared, wide }
    }

    fn initial_value(&self, address: u64, of: Option<Elementary>) -> u64 {
        let stored = self.initial.get(&(address / 64)).copied().unwrap_or(0) >> (address % 64);
        of.map_or(stored, |of| stored & of.mask())
    }

    /// A name for an address, and its type.
    fn name(&self, address: u64, of: Elementary) -> (String, Type) {
        let slot = address / 64;
        let state = u64::from(self.program.state);
        if let Some(part) = self.program.part_at(address) {
            return (shaped(&part.name), part.of);
        }
        let names = self.around.names;
        let (list, slot) =
            if slot < state { (&names.hidden, slot) } else { (&names.frames, slot - state) };
        let part = Program {
            variables: list.clone(),
            structures: self.program.structures.clone(),
            ..Program::default()
        }
        .part_at(64 * slot + address % 64);
        match part {
            Some(part) => (shaped(&part.name), part.of),
            None => (format!("memory.{slot}"), Type::Elementary(of)),
        }
    }

    fn add(&mut self, cell: Cell) -> Found<usize> {
        if self.resolved.cells.len() >= MAXIMUM_CELLS {
            return Err(Refusal {
                code: "U1048",
                ..self.refuse(format!("it has more than {MAXIMUM_CELLS} variables"))
            });
        }
        self.resolved.cells.push(cell);
        Ok(self.resolved.cells.len() - 1)
    }

    /// A cell that no variable has.
    fn fresh(&mut self, wanted: &str, kind: Kind, role: Role) -> Found<usize> {
        let name = match role {
            Role::Pin => wanted.to_owned(),
            _ => self.unique(wanted),
        };
        self.add(Cell {
            name,
            kind,
            role,
            initial: 0,
            is_seen: false,
            is_given: false,
            address: None,
            description: None,
        })
    }

    /// A name for a cell or a block that the ladder can have, and that no other has.
    fn unique(&mut self, wanted: &str) -> String {
        let mut base = wanted.to_owned();
        if KEYWORDS.contains(&wanted) {
            base.push('_');
        }
        // Room for the number of a bit and of a namesake.
        if base.len() > MAXIMUM_NAME_LENGTH - 16 {
            base.truncate(MAXIMUM_NAME_LENGTH - 16);
            base = base.trim_end_matches('.').to_owned();
        }
        if self.resolved.names.insert(base.clone()) {
            return base;
        }
        loop {
            let count = self.namesakes.entry(base.clone()).or_insert(1);
            *count += 1;
            let name = format!("{base}_{count}");
            if self.resolved.names.insert(name.clone()) {
                return name;
            }
        }
    }
}

/// `lamps[0][1]` as a ladder names it: `lamps.0.1`.
fn shaped(name: &str) -> String {
    let name = name.replace("][", ".").replace(['[', ','], ".");
    name.replace([']', ' '], "")
}

fn drop_unread(steps: &mut Vec<Step>, kept: &HashSet<usize>) {
    let mut comments = Vec::new();
    steps.retain_mut(|step| {
        comments.append(&mut step.comments);
        let stays = match &mut step.action {
            Action::SetTruth(cell, _) | Action::SetNumber(cell, _) => kept.contains(cell),
            Action::If(branches, otherwise) => {
                for (_, body) in branches.iter_mut() {
                    drop_unread(body, kept);
                }
                drop_unread(otherwise, kept);
                !otherwise.is_empty() || branches.iter().any(|(_, body)| !body.is_empty())
            }
            Action::Block { .. } | Action::Timer { .. } => true,
        };
        if stays {
            step.comments = std::mem::take(&mut comments);
        }
        stays
    });
}

/// What a cell of a type holds, where a ladder can.
fn kind_of(of: Elementary) -> Option<Kind> {
    match of {
        Elementary::Bool => Some(Kind::Truth),
        _ => range_of(of).map(|wide| Kind::Number { declared: wide, wide }),
    }
}

/// What an integer type holds.
fn range_of(of: Elementary) -> Option<(i64, i64)> {
    let whole = of.is_integer() && of != Elementary::Ulint;
    whole.then(|| match of.is_signed() {
        true => (i64::MIN >> (64 - of.bits()), i64::MAX >> (64 - of.bits())),
        false => (0, of.mask() as i64),
    })
}

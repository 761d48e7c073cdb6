//! Syntax to typed programs: layout of memory, types of expressions, statements.
//!
//! Units are lowered on demand, beginning with the programs: the memory of a block when a variable of it is declared, a body when
//! it is called. A name is looked up in the unit, then among the global variables, the values of enumerations and the units. A body is
//! lowered once for each block that has it, so a method of a base calls the methods of the block it runs on.

mod addresses;
mod arguments;
mod blocks;
mod body;
mod called;
mod callees;
mod calls;
mod chains;
mod connections;
mod constants;
mod convert;
mod details;
mod elements;
mod expand;
mod expressions;
mod facts;
mod fold;
mod idle;
mod images;
mod initial;
mod names;
mod numbers;
mod places;
mod programs;
mod promotion;
mod ranges;
mod retention;
mod routines;
mod standard;
mod standard_blocks;
mod statements;
mod tasks;
mod times;
mod types;

pub use addresses::share_bits;
pub use called::roots;
pub use standard::input_names;
pub use tasks::{another_interval, event, has_event, intervals, period};

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

use understudy_text::{Diagnostic, Lines, MAXIMUM_FINDINGS};
use understudy_typed::{Elementary, EnumerationId, Program, Type};

use crate::library;
use crate::syntax::{File, Name, Unit};

use self::blocks::{Block, Key, Routine};
use self::constants::ConstantState;
use self::facts::Facts;
use self::names::{Owner, Scope, Symbol};
use self::types::{StructureInfo, TypeState};

/// The state of a program takes at most so many slots: 256 KiB.
pub const MAXIMUM_SLOTS: u32 = 256 * 1024 / 8;

/// Slots that the memory of a program that becomes a circuit takes at most: 128 MiB.
const MAXIMUM_CIRCUIT: u64 = 128 * 1024 * 1024 / 8;

/// The frames of all routines of a program together take at most so many slots: 1 MiB.
const MAXIMUM_FRAMES: u32 = 1024 * 1024 / 8;

/// Bodies that a program may have.
const MAXIMUM_ROUTINES: usize = 20_000;

/// Declarations in each other, such as types of types, that are followed.
const MAXIMUM_NESTING: u32 = 64;

/// Operations that the loops of one scan may take together.
pub const BUDGET: u64 = 1_000_000;

/// The period where neither the file nor the options name one: 10 ms.
pub const DEFAULT_PERIOD: i64 = 10_000_000;

/// How a text is lowered.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options<'a> {
    /// The text of the file, for the lines of its statements.
    pub text: &'a str,
    /// The PROGRAM to be taken from a file with several ones and no CONFIGURATION.
    pub program: Option<&'a str>,
    /// Nanoseconds from one scan to the next, in place of those in the file.
    pub period: Option<i64>,
    /// It becomes a circuit, whose state is not this memory: so it may have more of it.
    pub is_circuit: bool,
}

/// What was lowered.
#[derive(Debug, Clone, Default)]
pub struct Lowered {
    /// The program; `None` where there are errors, and for a library.
    pub program: Option<Program>,
    /// The units of a library, a file without a PROGRAM, which were checked one by one.
    pub checked: Vec<String>,
    /// What was found, in the order of the text.
    pub diagnostics: Vec<Diagnostic>,
}

/// Lowers the programs of a file, or checks the units of a library.
pub fn lower(file: &File, options: &Options<'_>) -> Lowered {
    let library = library::file();
    let mut found = Vec::new();
    let file = &*expand::expand(file, &mut found);
    let mut lowering = Lowering::new(file, library, options.text);
    lowering.diagnostics = found;
    if options.is_circuit {
        lowering.most = MAXIMUM_CIRCUIT;
    }
    lowering.declare(file, library);
    let checked = lowering.programs(file, options);
    lowering.mark_details(file);
    lowering.finish(checked)
}

/// A unit with what is known of it.
struct UnitEntry<'a> {
    unit: &'a Unit,
    /// It is one of the library that comes with this crate.
    is_library: bool,
    block: BlockState,
}

enum BlockState {
    New,
    Busy,
    Faulty,
    Done(Rc<Block>),
}

struct Lowering<'a> {
    lines: Lines<'a>,
    library_lines: Lines<'static>,
    diagnostics: Vec<Diagnostic>,
    program: Program,
    units: Vec<UnitEntry<'a>>,
    unit_names: HashMap<String, usize>,
    types: HashMap<String, TypeState<'a>>,
    /// Names of what an INTERFACE declares, in capitals.
    interfaces: HashSet<String>,
    /// By the ids of the program's structures.
    structures: Vec<Rc<StructureInfo>>,
    /// Subranges of variables that people see, by name.
    ranges: HashMap<String, (i128, i128)>,
    /// Values of enumerations by their names.
    enumerators: HashMap<String, Vec<(EnumerationId, Elementary, i64)>>,
    globals: HashMap<String, Symbol>,
    global_declarations: HashMap<String, &'a crate::syntax::Declaration>,
    /// Variables at addresses.
    addresses: HashMap<String, Symbol>,
    /// What of the memory they take.
    extents: Vec<addresses::Extent>,
    /// Elements of arrays at addresses, and the points that they are copied from and to.
    elements: elements::Elements,
    /// Programs that run by themselves; the others can be called.
    running: HashSet<usize>,
    /// The memory of programs that are named in others.
    named_programs: HashMap<usize, Symbol>,
    constants: HashMap<(Option<Owner>, String), ConstantState>,
    routines: HashMap<Key, Rc<Routine>>,
    /// Bodies that are still to be lowered.
    queue: Vec<(Key, Rc<Routine>)>,
    /// Which routines each routine calls, and where it first does.
    calls: Vec<Vec<(u32, Range<usize>)>>,
    scope: Scope,
    /// What is known of variables at this place.
    facts: Facts,
    /// Warnings of numbers that can leave their subranges.
    subranges: Vec<Diagnostic>,
    /// How often something was reported, or found that was reported before.
    blamed: usize,
    /// Calls of blocks of the standard that are not given the time between two calls.
    without_cycle: Vec<(usize, Range<usize>)>,
    /// A statement or an initial value gives one to some block.
    sets_cycle: bool,
    /// The file has no PROGRAM.
    is_library: bool,
    /// Slots that the state may take.
    most: u64,
    nesting: u32,
    /// The length of the expressions around this one.
    length: usize,
    /// Where there is one: diagnostics are dropped, since something is only tried.
    silent: u32,
}

impl<'a> Lowering<'a> {
    fn new(file: &'a File, library: &'static File, text: &'a str) -> Self {
        let program = Program {
            period: DEFAULT_PERIOD,
            budget: BUDGET,
            state: Program::HEADER,
            ..Program::default()
        };
        let mut units = Vec::new();
        let mut unit_names = HashMap::new();
        let own = file.units.iter().map(|unit| (unit, false));
        let standard = library.units.iter().map(|unit| (unit, true));
        for (unit, is_library) in own.chain(standard) {
            let key = unit.name.key();
            if is_library && unit_names.contains_key(&key) {
                continue;
            }
            unit_names.entry(key).or_insert(units.len());
            units.push(UnitEntry { unit, is_library, block: BlockState::New });
        }
        Self {
            lines: Lines::new(text),
            library_lines: Lines::new(library::TEXT),
            diagnostics: Vec::new(),
            program,
            units,
            unit_names,
            types: HashMap::new(),
            interfaces: file.interfaces.iter().map(Name::key).collect(),
            structures: Vec::new(),
            ranges: HashMap::new(),
            enumerators: HashMap::new(),
            globals: HashMap::new(),
            global_declarations: HashMap::new(),
            addresses: HashMap::new(),
            extents: Vec::new(),
            elements: elements::Elements::default(),
            running: HashSet::new(),
            named_programs: HashMap::new(),
            constants: HashMap::new(),
            routines: HashMap::new(),
            queue: Vec::new(),
            calls: Vec::new(),
            scope: Scope::default(),
            facts: Facts::default(),
            subranges: Vec::new(),
            blamed: 0,
            without_cycle: Vec::new(),
            sets_cycle: false,
            is_library: false,
            most: MAXIMUM_SLOTS.into(),
            nesting: 0,
            length: 0,
            silent: 0,
        }
    }

    fn finish(mut self, checked: Vec<String>) -> Lowered {
        self.calls_without_cycle();
        // A warning takes the place of no error.
        self.subranges.sort_by_key(|found| (found.span.start, found.span.end));
        self.subranges.dedup();
        self.subranges.truncate(MAXIMUM_FINDINGS - self.diagnostics.len().min(MAXIMUM_FINDINGS));
        self.diagnostics.append(&mut self.subranges);
        self.diagnostics.sort_by_key(|found| (found.span.start, found.span.end));
        self.diagnostics.dedup();
        if self.diagnostics.len() > MAXIMUM_FINDINGS {
            self.diagnostics.truncate(MAXIMUM_FINDINGS);
            self.diagnostics.push(Diagnostic::too_many(0));
        }
        let is_whole = checked.is_empty() && !understudy_text::has_errors(&self.diagnostics);
        let is_whole = is_whole && !self.program.tasks.is_empty();
        self.program.seal_points();
        Lowered {
            program: is_whole.then_some(self.program),
            checked,
            diagnostics: self.diagnostics,
        }
    }

    /// Whether what is being lowered comes from the library, where nothing is warned of.
    fn in_library(&self) -> bool {
        let unit = self.scope.unit.and_then(|unit| self.units.get(unit));
        unit.is_some_and(|entry| entry.is_library)
    }

    fn report(&mut self, found: Diagnostic) {
        self.blamed += 1;
        if self.silent == 0 && self.diagnostics.len() <= MAXIMUM_FINDINGS {
            self.diagnostics.push(found);
        }
    }

    /// Whether an error was reported that what is found now can follow from; then it needs no message of its own.
    fn follows_an_error(&mut self) -> bool {
        let follows = understudy_text::has_errors(&self.diagnostics);
        self.blamed += usize::from(follows);
        follows
    }

    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Range<usize>) {
        self.report(Diagnostic::error(code, message, span));
    }

    fn error_with(
        &mut self,
        code: &'static str,
        message: impl Into<String>,
        span: Range<usize>,
        help: impl Into<String>,
    ) {
        self.report(Diagnostic::error(code, message, span).with_help(help));
    }

    fn warn(
        &mut self,
        code: &'static str,
        message: impl Into<String>,
        span: Range<usize>,
        help: impl Into<String>,
    ) {
        if !self.in_library() {
            self.report(Diagnostic::warning(code, message, span).with_help(help));
        }
    }

    /// What fails is reported: where nothing says why, that it is not supported.
    fn accounted<T>(&mut self, before: usize, found: Option<T>, span: &Range<usize>) -> Option<T> {
        if found.is_none() && self.blamed == before {
            let help = "write it with other operators or functions";
            self.error_with("U1040", "this is not supported here", span.clone(), help);
        }
        found
    }

    /// The line of a place, from 1.
    fn line(&self, span: &Range<usize>) -> u32 {
        let lines = if self.in_library() { &self.library_lines } else { &self.lines };
        u32::try_from(lines.index(span.start) + 1).unwrap_or(u32::MAX)
    }

    /// Runs something one level deeper; `None` where that is too deep.
    fn deeper<T>(
        &mut self,
        span: &Range<usize>,
        run: impl FnOnce(&mut Self) -> Option<T>,
    ) -> Option<T> {
        if self.nesting >= MAXIMUM_NESTING {
            let message = format!("declarations are nested more than {MAXIMUM_NESTING} deep");
            self.error("U1033", message, span.clone());
            return None;
        }
        self.nesting += 1;
        let result = run(self);
        self.nesting -= 1;
        result
    }

    /// Takes slots of the state.
    fn state(&mut self, slots: u64, span: &Range<usize>) -> Option<u32> {
        let start = self.program.state;
        let end = u64::from(start) + slots;
        if end > self.most {
            self.too_large(end, span);
            return None;
        }
        self.program.state = end as u32;
        Some(start)
    }

    fn too_large(&mut self, slots: u64, span: &Range<usize>) {
        let needed = slots.saturating_mul(8).div_ceil(1024);
        let message = format!(
            "the variables take {needed} KiB; a program has at most {} KiB of state",
            self.most / 128
        );
        self.error_with("U1048", message, span.clone(), "use smaller arrays");
    }

    /// A type as it is written.
    fn describe(&self, of: &Type) -> String {
        self.program.type_name(of)
    }
}

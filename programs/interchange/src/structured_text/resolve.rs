//! Syntax to cells and steps: names are looked up, types are checked, instances are put in place of their calls.
//!
//! Every error is said once, and resolving goes on with what it knows. The number of cells and steps is bounded, and a block
//! cannot contain itself, so this ends.

mod call;
mod declare;
mod expression;
mod function;
mod leave;
mod statement;
mod types;
mod uses;

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;

use understudy_ladder::{KEYWORDS, MAXIMUM_NAME_LENGTH, Name};
use understudy_text::{Diagnostic, MAXIMUM_FINDINGS};

use self::leave::Left;
use self::types::Types;
use self::uses::UsesByName;
use super::parser::parse;
use super::program::{Cell, Resolved, Step};
use super::syntax::{Declaration, Unit};

/// The most cells of a program, bits of numbers not counted.
const MAXIMUM_CELLS: usize = 50_000;
/// The most steps of a text, those of all programs and instances together.
pub(super) const MAXIMUM_STEPS: usize = 100_000;
/// The most instances of blocks and calls of functions.
const MAXIMUM_INSTANCES: usize = 20_000;

/// The meaning of a name in an instance.
#[derive(Debug, Clone)]
enum Entity {
    Cell(usize),
    /// A constant or a value of an enumeration.
    Truth(bool),
    Number(i64),
    /// Known where it is known.
    Time(Option<Duration>),
    Instance(usize),
    /// The count of a counter in a rung.
    Counter(String),
    /// Already diagnosed.
    Broken,
}

/// A program, a block or a function at work.
#[derive(Debug, Default)]
struct Instance {
    /// Which of the units.
    unit: usize,
    /// The standard block in a rung, in its place.
    native: Option<&'static str>,
    /// The timer that it is, where not every execution calls it once.
    timer: Option<usize>,
    /// Its name among all, with those around it.
    path: String,
    /// By name in capitals.
    entities: HashMap<String, Entity>,
    uses: UsesByName,
    /// Called once in each execution, whatever happens.
    exclusive: bool,
    called: bool,
}

/// The result, with everything that was wrong.
pub(super) struct Resolving {
    pub(super) program: Resolved,
    pub(super) diagnostics: Vec<Diagnostic>,
}

/// The program `unit`, with `others` to be called and `globals` behind its VAR_EXTERNAL; it takes its steps from `budget`.
pub(super) fn resolve(
    unit: &Rc<Unit>,
    prefix: &str,
    others: &[Rc<Unit>],
    types: &[super::syntax::TypeDefinition],
    globals: &[Declaration],
    budget: &mut usize,
) -> Resolving {
    let (library, _) = parse(include_str!("library.st"));
    let mut units = vec![Rc::clone(unit)];
    units.extend(others.iter().cloned());
    let library = library.units.into_iter();
    units.extend(library.map(|unit| {
        Rc::new(Unit {
            foreign: true,
            ..unit
        })
    }));
    let mut by_name = HashMap::new();
    for (place, unit) in units.iter().enumerate().skip(1) {
        by_name
            .entry(unit.name.to_ascii_uppercase())
            .or_insert(place);
    }
    let mut resolver = Resolver {
        first_of_library: 1 + others.len(),
        units,
        by_name,
        types: Types::default(),
        globals: globals.to_vec(),
        global_cells: HashMap::new(),
        instances: Vec::new(),
        stack: Vec::new(),
        left: Left::default(),
        program: Resolved::default(),
        steps: Vec::new(),
        steps_left: *budget,
        names: HashSet::new(),
        namesakes: HashMap::new(),
        blame: None,
        is_full: false,
        findings: HashSet::new(),
        diagnostics: Vec::new(),
    };
    resolver.define_types(types);
    let main = resolver.instantiate(0, prefix.to_owned(), true);
    resolver.execute(main);
    resolver.program.steps = std::mem::take(&mut resolver.steps);
    resolver.program.names = std::mem::take(&mut resolver.names);
    *budget = resolver.steps_left;
    Resolving {
        program: resolver.program,
        diagnostics: resolver.diagnostics,
    }
}

struct Resolver {
    /// The program itself, the other units, the library.
    units: Vec<Rc<Unit>>,
    first_of_library: usize,
    by_name: HashMap<String, usize>,
    types: Types,
    globals: Vec<Declaration>,
    global_cells: HashMap<String, Entity>,
    instances: Vec<Instance>,
    /// Units around, against a block in itself.
    stack: Vec<usize>,
    /// Of the execution at hand.
    left: Left,
    program: Resolved,
    /// Of the list that is being made.
    steps: Vec<Step>,
    /// Of those that the whole text may have.
    steps_left: usize,
    /// Names of cells and blocks.
    names: HashSet<String>,
    /// The last number behind each name that is wanted more than once.
    namesakes: HashMap<String, usize>,
    /// Where a text that is not the user's was called from.
    blame: Option<Range<usize>>,
    is_full: bool,
    findings: HashSet<(&'static str, usize, String)>,
    diagnostics: Vec<Diagnostic>,
}

impl Resolver {
    /// Says what is wrong, once for each place, however many instances have it.
    fn say(&mut self, mut finding: Diagnostic) {
        if let Some(place) = &self.blame {
            finding.span = place.clone();
        }
        let known = (finding.code, finding.span.start, finding.message.clone());
        if self.diagnostics.len() < MAXIMUM_FINDINGS {
            if self.findings.insert(known) {
                self.diagnostics.push(finding);
            }
        } else if self.diagnostics.len() == MAXIMUM_FINDINGS {
            // An error, so that nothing is made of what nobody was told about.
            let place = finding.span.start;
            self.diagnostics.push(Diagnostic::too_many(place));
            self.is_full = true;
        }
    }

    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Range<usize>) {
        self.say(Diagnostic::error(code, message, span));
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
        if self.names.insert(base.clone()) {
            return base;
        }
        loop {
            let count = self.namesakes.entry(base.clone()).or_insert(1);
            *count += 1;
            let name = format!("{base}_{count}");
            if self.names.insert(name.clone()) {
                return name;
            }
        }
    }

    /// Adds a cell; past the bound the last one again, and the program is given up.
    fn add_cell(&mut self, cell: Cell, span: Range<usize>) -> usize {
        if self.program.cells.len() >= MAXIMUM_CELLS {
            self.give_up(
                format!("the program has more than {MAXIMUM_CELLS} variables"),
                span,
            );
            return self.program.cells.len() - 1;
        }
        self.program.cells.push(cell);
        self.program.cells.len() - 1
    }

    fn give_up(&mut self, message: String, span: Range<usize>) {
        if !self.is_full {
            self.is_full = true;
            self.error("U1048", message, span);
        }
    }

    fn push(&mut self, action: super::program::Action, span: Range<usize>, comments: Vec<String>) {
        let span = self.blame.clone().unwrap_or(span);
        if self.count_step(&span) {
            self.steps.push(Step {
                action,
                span,
                comments,
            });
        }
    }

    /// False past the bound, where the program is given up. A call counts too, so that empty blocks end as well.
    fn count_step(&mut self, span: &Range<usize>) -> bool {
        match self.steps_left.checked_sub(1) {
            Some(left) => self.steps_left = left,
            None => {
                let message = format!(
                    "the programs have more than {MAXIMUM_STEPS} steps, their blocks in place"
                );
                self.give_up(message, span.clone());
            }
        }
        !self.is_full
    }

    fn entity(&self, instance: usize, name: &str) -> Option<&Entity> {
        self.instances[instance]
            .entities
            .get(&name.to_ascii_uppercase())
    }

    /// The known name that is nearest to a misspelt one.
    fn nearest(&self, instance: usize, name: &Name) -> Option<&str> {
        let unit = &self.units[self.instances[instance].unit];
        let known = unit
            .declarations
            .iter()
            .map(|declaration| declaration.name.as_str());
        understudy_text::spelling::nearest(name, known)
    }
}

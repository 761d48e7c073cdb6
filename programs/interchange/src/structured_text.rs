//! Structured Text of IEC 61131-3 to ladders.
//!
//! ```text
//! PROGRAM press
//!   VAR_INPUT part : BOOL; reset : BOOL; END_VAR
//!   VAR_OUTPUT ram : BOOL; full : BOOL; END_VAR
//!   VAR pause : TON; parts : INT (0..10); END_VAR
//!   pause(IN := ram, PT := T#300ms);
//!   ram := (part OR ram) AND NOT pause.Q;
//!   IF reset THEN parts := 0;
//!   ELSIF pause.Q AND parts < 10 THEN parts := parts + 1;
//!   END_IF;
//!   full := parts = 10;
//! END_PROGRAM
//! ```
//!
//! A scan of the ladder does what one execution of the text does. Standard blocks become blocks of the ladder where they can
//! stand in a rung; other blocks and functions are put in place of their calls; numbers become as many bits as their
//! values need. `docs/reference/structured-text.md` describes what is supported.

mod bounds;
mod lexer;
mod lower;
mod number;
mod parser;
mod program;
mod resolve;
mod syntax;
mod timers;

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;
use std::time::Duration;

use understudy_ladder::{Name, Program};
use understudy_text::{Diagnostic, Severity, has_errors};

pub(crate) use self::parser::is_keyword;
pub use self::syntax::Class;
use self::syntax::{Declaration, File, TypeMeaning, Unit, UnitKind};

/// The most programs of a text.
const MAXIMUM_PROGRAMS: usize = 16;
/// The most function blocks and functions of a text.
const MAXIMUM_CALLABLE: usize = 1_000;
/// Names that one finding lists.
const MAXIMUM_LISTED: usize = 20;

/// What was read.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The programs, in the order of the text; those without errors.
    pub programs: Vec<Program>,
    /// The interval of the first task of the configuration, where there is one.
    pub period: Option<Duration>,
    /// Everything that was found, in the order of its place.
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads a whole text. Nothing is lost in silence: whatever is unsupported is an error or a warning, with its place.
pub fn read(text: &str) -> Reading {
    let (file, mut diagnostics) = parser::parse(text);
    let mut programs = Vec::new();
    let is_sound = !has_errors(&diagnostics);
    let units: Vec<Rc<Unit>> = file.units.iter().cloned().map(Rc::new).collect();
    let (units, others): (Vec<_>, Vec<_>) = units
        .into_iter()
        .partition(|unit| unit.kind == UnitKind::Program);
    if units.len() > MAXIMUM_PROGRAMS || others.len() > MAXIMUM_CALLABLE {
        let message = format!(
            "there are more than {MAXIMUM_PROGRAMS} programs, or {MAXIMUM_CALLABLE} blocks and functions"
        );
        diagnostics.push(Diagnostic::error("U1048", message, 0..0));
        return Reading {
            diagnostics,
            ..Reading::default()
        };
    }
    let mut budget = resolve::MAXIMUM_STEPS;
    for unit in &units {
        let (program, found) = lowered(unit, "", &others, &file, is_sound, &mut budget);
        diagnostics.extend(found);
        programs.extend(program);
    }
    // What no program calls is looked at as well.
    for unit in &others {
        if budget == 0 {
            break;
        }
        let found = resolve::resolve(unit, "", &others, &file.types, &file.globals, &mut budget);
        // That all of it is too much is not said of a program that is not.
        let found = found.diagnostics.into_iter();
        diagnostics.extend(found.filter(|found| budget > 0 || found.code != "U1048"));
    }
    if has_errors(&diagnostics) {
        programs.clear();
    } else {
        diagnostics.extend(unused(text, &file));
    }
    if programs.is_empty() && !has_errors(&diagnostics) {
        let help = "a text needs a PROGRAM … END_PROGRAM";
        diagnostics
            .push(Diagnostic::error("U1051", "the text has no program", 0..0).with_help(help));
    }
    let mut seen = HashSet::new();
    diagnostics.retain(|found| seen.insert((found.code, found.span.clone())));
    diagnostics.sort_by_key(|found| found.span.start);
    Reading {
        programs,
        period: file.period,
        diagnostics,
    }
}

/// What is declared outside of the programs and not used elsewhere in the text.
fn unused(text: &str, file: &File) -> Option<Diagnostic> {
    let belongs = |letter: char| letter.is_ascii_alphanumeric() || letter == '_';
    let mut places: HashMap<String, Vec<usize>> = HashMap::new();
    for word in text
        .split(|letter| !belongs(letter))
        .filter(|word| !word.is_empty())
    {
        let place = word.as_ptr() as usize - text.as_ptr() as usize;
        places
            .entry(word.to_ascii_uppercase())
            .or_default()
            .push(place);
    }
    let is_named = |name: &Name, own: Range<usize>| {
        let found = places.get(&name.to_ascii_uppercase());
        found.is_some_and(|found| found.iter().any(|place| !own.contains(place)))
    };
    let mut starts: Vec<usize> = file
        .units
        .iter()
        .map(|unit| unit.name.span().start)
        .collect();
    starts.sort_unstable();
    let mut unused: Vec<&Name> = Vec::new();
    for unit in &file.units {
        let start = unit.name.span().start;
        let next = starts.iter().copied().find(|next| *next > start);
        let own = start..next.unwrap_or(text.len());
        if unit.kind != UnitKind::Program && !is_named(&unit.name, own) {
            unused.push(&unit.name);
        }
    }
    for definition in &file.types {
        let names = match &definition.meaning {
            TypeMeaning::Enumeration(values) => values.as_slice(),
            TypeMeaning::Alias(_) => &[],
        };
        let mut names = names.iter().chain([&definition.name]);
        if !names.any(|name| is_named(name, name.span())) {
            unused.push(&definition.name);
        }
    }
    let globals = file.globals.iter().map(|global| &global.name);
    unused.extend(globals.filter(|name| !is_named(name, name.span())));
    let first = unused.first()?;
    let listed: Vec<String> = unused
        .iter()
        .take(MAXIMUM_LISTED)
        .map(|name| format!("`{name}`"))
        .collect();
    let more = match unused.len() - listed.len() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    let message = format!("nothing uses {}{more}: not kept", listed.join(", "));
    Some(Diagnostic::warning("U1055", message, first.span()))
}

/// A variable whose declaration comes from elsewhere, such as the interface of a block in XML.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Of which kind it is.
    pub class: Class,
    /// Its type, as in a text: `BOOL`, `INT (0..9)`, `TON`.
    pub type_name: String,
    /// Its initial value, as in a text.
    pub initial: Option<String>,
    /// Its address, such as `%IX0.3`.
    pub address: Option<String>,
    /// Declared CONSTANT.
    pub constant: bool,
    /// Its description.
    pub description: Option<String>,
}

/// A function block or a function whose body is a text, as one that others call.
#[derive(Debug, Clone)]
pub struct Callable {
    /// Its name.
    pub name: String,
    /// What it answers, where it is a function.
    pub result: Option<String>,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// Its statements.
    pub body: String,
}

/// The body of `unit` as rungs, for the instance `instance` (all its names stand behind that name and a dot) or, where that is
/// empty, for itself.
///
/// The unit's inputs and outputs are the inputs and outputs of the answer; numbers among them are bits, `count.0` being the lowest. A
/// caller that puts the rungs into another program writes the inputs there first, and declares all of it as memory.
/// Places in the diagnostics are places in `unit.body`; what is wrong with a declaration or in one of `others` is at 0.
pub fn lower_body(
    unit: &Callable,
    instance: &str,
    others: &[Callable],
) -> (Option<Program>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let own = Rc::new(unit_of(unit, false, &mut diagnostics));
    let mut callable = Vec::new();
    for other in others {
        let mut found = Vec::new();
        callable.push(Rc::new(unit_of(other, true, &mut found)));
        let errors = found
            .into_iter()
            .filter(|found| found.severity == Severity::Error);
        diagnostics.extend(errors.take(1).map(|found| {
            Diagnostic::error(
                found.code,
                format!("in `{}`: {}", other.name, found.message),
                0..0,
            )
        }));
    }
    let is_sound = !has_errors(&diagnostics);
    let mut budget = resolve::MAXIMUM_STEPS;
    let (program, found) = lowered(
        &own,
        instance,
        &callable,
        &File::default(),
        is_sound,
        &mut budget,
    );
    diagnostics.extend(found);
    diagnostics.sort_by_key(|found| found.span.start);
    (program, diagnostics)
}

/// Resolves, bounds and lowers a unit; no program where there are errors.
fn lowered(
    unit: &Rc<Unit>,
    instance: &str,
    others: &[Rc<Unit>],
    file: &File,
    is_sound: bool,
    budget: &mut usize,
) -> (Option<Program>, Vec<Diagnostic>) {
    let mut resolving =
        resolve::resolve(unit, instance, others, &file.types, &file.globals, budget);
    let mut diagnostics = resolving.diagnostics;
    if !is_sound || has_errors(&diagnostics) {
        return (None, diagnostics);
    }
    let (mut intervals, suspicious) = bounds::bounds(&resolving.program);
    // What is suspicious in the library is a matter of the block's own text.
    diagnostics.extend(suspicious.into_iter().filter(|_| !unit.foreign));
    let found = timers::place(&mut resolving.program, &mut intervals);
    if has_errors(&found) {
        diagnostics.extend(found);
        return (None, diagnostics);
    }
    let (mut program, found) = lower::lower(&unit.name, &resolving.program, &intervals);
    diagnostics.extend(found);
    program.comments.clone_from(&unit.comments);
    program.footer.extend(unit.footer.iter().cloned());
    let program = (!has_errors(&diagnostics)).then_some(program);
    (program, diagnostics)
}

/// A unit from its parts. Places in declarations are places of nothing, and become 0.
fn unit_of(callable: &Callable, foreign: bool, diagnostics: &mut Vec<Diagnostic>) -> Unit {
    let mut elsewhere = |name: &str, found: Vec<Diagnostic>| {
        diagnostics.extend(found.into_iter().map(|found| Diagnostic {
            message: format!("`{name}`: {}", found.message),
            span: 0..0,
            ..found
        }));
    };
    let mut declarations = Vec::new();
    for variable in &callable.variables {
        let (type_name, found) = parser::parse_type(&variable.type_name);
        elsewhere(&variable.name, found);
        let initial = variable.initial.as_ref().map(|initial| {
            let (initial, found) = parser::parse_expression(initial);
            elsewhere(&variable.name, found);
            initial
        });
        let Some(type_name) = type_name else { continue };
        let address = variable.address.as_ref();
        declarations.push(Declaration {
            name: Name::from(variable.name.as_str()),
            class: variable.class,
            constant: variable.constant,
            temporary: false,
            address: address
                .map(|address| Name::from(address.trim_start_matches('%').to_ascii_uppercase())),
            type_name: syntax::TypeName {
                name: Name::from(type_name.name.as_str()),
                range: type_name.range,
            },
            initial,
            description: variable.description.clone(),
        });
    }
    let result = callable.result.as_ref().and_then(|result| {
        let (result, found) = parser::parse_type(result);
        elsewhere(&callable.name, found);
        result
    });
    let (body, found) = parser::parse_body(&callable.body);
    diagnostics.extend(found);
    Unit {
        kind: if result.is_some() {
            UnitKind::Function
        } else {
            UnitKind::FunctionBlock
        },
        name: Name::from(callable.name.as_str()),
        comments: Vec::new(),
        footer: Vec::new(),
        result,
        declarations,
        body,
        foreign,
    }
}

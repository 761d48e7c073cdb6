//! Statements as rungs: a rung for each assignment of a BOOL and for each call of a standard block.
//!
//! ```text
//! y := a AND NOT b;                   a /b ( y )
//! pause(IN := a, PT := T#3s);         a {TON pause 3s}
//! IF a THEN y := TRUE; END_IF;        a (S y )
//! IF a THEN y := b; END_IF;           a ( then_1 )      [ then_1 b | /then_1 y ] ( y )
//! ```
//!
//! Invariant: a rung reads what its statement reads, since both are executed in their order. What no rung holds is refused with its place: numbers
//! but counters compared with a constant, loops, CASE, and calls of blocks under a condition.

mod blocks;
mod drawn;
mod lost;
mod network;
mod signals;

use std::collections::{HashMap, HashSet};

use understudy_ladder::{
    Coil, CoilKind, Contact, ContactKind, Element, MAXIMUM_RUNGS, Name, Namer, Program, Series,
    check,
};
use understudy_structured_text::lower::event;
use understudy_structured_text::syntax::{
    Body, Expression, File, Name as SourceName, Path, Span, Statement, StatementKind, Unit,
    UnitKind,
};
use understudy_text::{Diagnostic, Severity};
use understudy_typed::Program as Typed;

use self::drawn::Uses;
use self::lost::Lost;
use self::network::Power;
use self::signals::{Known, Points};

/// Conditions of the branches before that a branch tests each for itself.
const MAXIMUM_BEFORE: usize = 4;

/// What is said of one program that no rungs hold, at most.
const MAXIMUM_REFUSED: usize = 20;

/// A program of one task as rungs.
#[derive(Debug, Default)]
pub(crate) struct Rungs {
    /// Nothing where no rungs hold it.
    pub(crate) program: Option<Program>,
    /// What rungs do not keep of its text, or why they do not hold it.
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// What a person should know of the rungs, if they are drawn.
    pub(crate) remarks: Vec<Diagnostic>,
}

/// Brings a program of one task to rungs.
pub(crate) fn rungs(text: &str, file: &File, typed: &Typed) -> Rungs {
    let mut programs = file.units.iter().filter(|unit| unit.kind == UnitKind::Program);
    let Some(unit) = programs.find(|unit| unit.name.is(&typed.name)) else {
        return Rungs::default();
    };
    let refused = |what: &str| {
        let refused = Refused { what: what.to_owned(), span: unit.name.span() };
        Rungs { diagnostics: vec![refusal(unit, refused)], ..Rungs::default() }
    };
    let statements = match &unit.body {
        Body::Statements(statements) => statements,
        Body::Chart(_) => return refused("its body is a sequential function chart"),
        Body::Instructions(_) => return refused("its body is an instruction list"),
    };
    if unit.extends.is_some() {
        return refused("it extends another unit");
    }
    let mut runs = file.instances.iter().filter(|run| run.of == unit.name);
    if runs.clone().any(|run| event(file, run).is_some()) {
        return refused("its task has an event");
    }
    if runs.any(|run| !run.connections.is_empty()) {
        return refused("its instance has connections");
    }
    let mut writer = Writer::new(file, unit, typed);
    writer.statements(statements, None);
    match writer.finish() {
        Ok((program, lost, remarks)) => {
            let diagnostics = lost::lost(text, file, unit, &lost);
            Rungs { program: Some(program), diagnostics, remarks }
        }
        Err(diagnostics) => Rungs { diagnostics, ..Rungs::default() },
    }
}

/// What no rung holds.
struct Refused {
    what: String,
    span: Span,
}

type Found<T> = Result<T, Refused>;

fn refused<T>(what: impl Into<String>, span: &Span) -> Found<T> {
    Err(Refused { what: what.into(), span: span.clone() })
}

fn refusal(unit: &Unit, refused: Refused) -> Diagnostic {
    let message = format!("`{}` is no ladder: {}", unit.name, refused.what);
    let help = "rungs hold BOOLs, timers, counters, latches and edges; `--to st` and `--to plcopen` write the program as it is";
    Diagnostic::error("U1056", message, refused.span).with_help(help)
}

struct Writer<'f> {
    file: &'f File,
    unit: &'f Unit,
    ladder: Program,
    namer: Namer,
    /// By name and by address, in capitals.
    known: HashMap<String, Known>,
    /// Blocks that were called.
    called: HashSet<String>,
    /// Blocks whose outputs are read, and where.
    read: Vec<(String, Span)>,
    /// Inputs and outputs of the program, in capitals.
    points: Points,
    /// Retentive variables, in capitals.
    retained: HashSet<String>,
    lost: Lost<'f>,
    /// For the next rung.
    comments: Vec<String>,
    /// Of the statement that is written.
    place: Span,
    /// How the statements use the variables.
    uses: Uses,
    /// Bits of powers that several coils of a rung share.
    shared: HashSet<String>,
    refused: Vec<Refused>,
}

impl<'f> Writer<'f> {
    /// Writes the rungs of statements, each under a bit where they are executed only then.
    fn statements(&mut self, statements: &'f [Statement], guard: Option<&str>) {
        for statement in statements {
            self.comments.extend(statement.comments.iter().cloned());
            self.place = statement.span.clone();
            if let Err(found) = self.statement(statement, guard) {
                self.refused.push(found);
            }
        }
    }

    fn statement(&mut self, statement: &'f Statement, guard: Option<&str>) -> Found<()> {
        let span = &statement.span;
        let word = match &statement.kind {
            StatementKind::Assign(target, value) => return self.assign(target, value, guard),
            StatementKind::Call(path, arguments) => {
                if self.edge_called(path, arguments)? {
                    return Ok(());
                }
                if guard.is_some() {
                    return refused("it calls a block under a condition", span);
                }
                return self.call(path, arguments);
            }
            StatementKind::If(branches, otherwise) => {
                return self.choice(branches, otherwise, guard);
            }
            StatementKind::Nothing => return Ok(()),
            StatementKind::Case(..) => "CASE",
            StatementKind::For(_) => "FOR",
            StatementKind::While(..) => "WHILE",
            StatementKind::Repeat(..) => "REPEAT",
            StatementKind::Exit => "EXIT",
            StatementKind::Continue => "CONTINUE",
            StatementKind::Return => "RETURN",
            StatementKind::Code(_) => "C code",
        };
        refused(format!("{word} is no rung"), span)
    }

    fn assign(&mut self, target: &Path, value: &Expression, guard: Option<&str>) -> Found<()> {
        let target = self.target(target)?;
        if guard.is_none()
            && let Some((is_rising, network)) = self.taken_edge(value)
        {
            let kind = if is_rising { CoilKind::Rising } else { CoilKind::Falling };
            self.push(network, vec![coil(kind, &target)]);
            return Ok(());
        }
        let power = self.power(value, false, 0)?;
        let Some(guard) = guard else {
            let (network, kind) = match power {
                Power::On => (Vec::new(), CoilKind::Plain),
                Power::Off => (Vec::new(), CoilKind::Negated),
                Power::Through(series) => (series, CoilKind::Plain),
            };
            self.push(network, vec![coil(kind, &target)]);
            return Ok(());
        };
        let (network, kind) = match power {
            Power::On => (vec![contact(guard, false)], CoilKind::Set),
            Power::Off => (vec![contact(guard, false)], CoilKind::Reset),
            Power::Through(series) => {
                let mut taken = vec![contact(guard, false)];
                taken.extend(series);
                let kept = vec![contact(guard, true), contact(&target, false)];
                (vec![Element::Branches(vec![taken, kept])], CoilKind::Plain)
            }
        };
        self.push(network, vec![coil(kind, &target)]);
        Ok(())
    }

    /// `IF … THEN … ELSIF … ELSE … END_IF`: a bit says which branch is executed, since a branch may change what the conditions read.
    fn choice(
        &mut self,
        branches: &'f [(Expression, Vec<Statement>)],
        otherwise: &'f [Statement],
        guard: Option<&str>,
    ) -> Found<()> {
        if let ([(condition, body)], []) = (branches, otherwise)
            && let Some(latches) = self.latches(body)?
        {
            let mut network: Series = guard.map(|bit| contact(bit, false)).into_iter().collect();
            match self.power(condition, false, 0)? {
                Power::On => {}
                Power::Off => return Ok(()),
                Power::Through(series) => network.extend(series),
            }
            self.push(network, latches);
            return Ok(());
        }
        let mut before: Series = guard.map(|bit| contact(bit, false)).into_iter().collect();
        let mut bits = Vec::new();
        for (condition, _) in branches {
            let power = self.power(condition, false, 0)?;
            let bit = self.memory("then");
            let (network, kind) = match power {
                Power::On => (before.clone(), CoilKind::Plain),
                Power::Off => (Vec::new(), CoilKind::Negated),
                Power::Through(series) => {
                    (before.iter().cloned().chain(series).collect(), CoilKind::Plain)
                }
            };
            self.push(network, vec![coil(kind, &bit)]);
            before.push(contact(&bit, true));
            if before.len() > MAXIMUM_BEFORE {
                let rest = self.memory("rest");
                self.push(before, vec![coil(CoilKind::Plain, &rest)]);
                before = vec![contact(&rest, false)];
            }
            bits.push(bit);
        }
        if !otherwise.is_empty() {
            let bit = self.memory("else");
            self.push(before, vec![coil(CoilKind::Plain, &bit)]);
            bits.push(bit);
        }
        let bodies = branches.iter().map(|(_, body)| body.as_slice()).chain([otherwise]);
        for (bit, body) in bits.iter().zip(bodies) {
            self.statements(body, Some(bit));
        }
        Ok(())
    }

    /// The set and reset coils of a body that is nothing else.
    fn latches(&mut self, body: &[Statement]) -> Found<Option<Vec<Coil>>> {
        let mut coils = Vec::new();
        for statement in body {
            let StatementKind::Assign(target, value) = &statement.kind else {
                return Ok(None);
            };
            let kind = match network::constant(value) {
                Some(true) => CoilKind::Set,
                Some(false) => CoilKind::Reset,
                None => return Ok(None),
            };
            coils.push(coil(kind, &self.target(target)?));
        }
        if coils.is_empty() {
            return Ok(None);
        }
        self.comments.extend(body.iter().flat_map(|statement| &statement.comments).cloned());
        Ok(Some(coils))
    }

    /// The program, what of its text it does not keep, and what a person should know of it.
    fn finish(mut self) -> Result<(Program, Lost<'f>, Vec<Diagnostic>), Vec<Diagnostic>> {
        for (block, span) in std::mem::take(&mut self.read) {
            if !self.called.contains(&block) {
                let what = format!("`{block}` is read and never called");
                self.refused.push(Refused { what, span });
            }
        }
        let declared = self.unit.declarations.iter().filter(|it| !it.constant);
        let is_other = |known: &Known| match known {
            Known::Other(_) => true,
            Known::Block { name, .. } => !self.called.contains(name),
            Known::Bit { .. } | Known::Edge { .. } => false,
        };
        let is_left_out = |name: &SourceName| {
            let key = name.key();
            self.known.get(&key).is_some_and(is_other) && !self.uses.reads(&key)
        };
        self.lost.unused = declared.map(|it| &it.name).filter(|name| is_left_out(name)).collect();
        self.points_are_signals();
        self.drop_unused_globals();
        self.drop_shared_powers();
        self.declare_retained();
        if self.ladder.rungs.len() > MAXIMUM_RUNGS {
            let what = format!("it has more than {MAXIMUM_RUNGS} rungs");
            let error = Refused { what, span: self.unit.name.span() };
            return Err(vec![Diagnostic { code: "U1048", ..refusal(self.unit, error) }]);
        }
        if !self.refused.is_empty() {
            let unit = self.unit;
            // Findings have the order of the file.
            self.refused.sort_by_key(|refused| refused.span.start);
            let more = self.refused.len().saturating_sub(MAXIMUM_REFUSED);
            self.refused.truncate(MAXIMUM_REFUSED);
            if more > 0
                && let Some(last) = self.refused.last_mut()
            {
                last.what = format!("{}, and {more} more", last.what);
            }
            return Err(self.refused.into_iter().map(|found| refusal(unit, found)).collect());
        }
        let is_error = |found: &Diagnostic| found.severity == Severity::Error;
        let (errors, remarks): (Vec<_>, Vec<_>) =
            check(&self.ladder).into_iter().partition(is_error);
        if !errors.is_empty() {
            return Err(errors);
        }
        self.states();
        self.ladder.footer.append(&mut self.comments);
        Ok((self.ladder, self.lost, remarks))
    }
}

fn contact(operand: &str, negated: bool) -> Element {
    let kind = if negated { ContactKind::NormallyClosed } else { ContactKind::NormallyOpen };
    Element::Contact(Contact { kind, operand: Name::from(operand) })
}

fn coil(kind: CoilKind, target: &str) -> Coil {
    Coil { kind, target: Name::from(target) }
}

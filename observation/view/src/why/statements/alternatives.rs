//! The choices that could have assigned a variable otherwise, and did not: programs often assign a default first, so the cause of a value is a condition
//! that was false.
//!
//! ```text
//!   velocity := 0.0;              assigned last
//!   IF running AND … THEN         executed, and no branch with an assignment was chosen: the answer
//!     velocity := speed;
//! ```

use understudy_typed::{Done, Effect, Place, RoutineId, Statement, StatementKind, Trace};

/// A statement that chooses, with the assignments of the variable within it.
#[derive(Debug)]
struct Choice {
    line: u32,
    /// Lines of the assignments.
    assigns: Vec<u32>,
    within: Vec<Choice>,
}

/// A choice of a scan that led to no assignment.
#[derive(Debug)]
pub(super) struct Untaken<'t> {
    pub(super) done: &'t Done,
    /// Lines of the assignments to which it did not lead.
    pub(super) lines: Vec<u32>,
}

/// The choices of a scan after `after` that assign what the statement of a routine in a line assigns, and did not.
///
/// A choice that was executed several times in the scan, by several instances or turns of a loop, is left out: it is not known which of them counts.
pub(super) fn untaken<'t>(
    trace: &'t Trace,
    after: Option<usize>,
    routine: RoutineId,
    body: &[Statement],
    line: u32,
) -> Vec<Untaken<'t>> {
    let mut targets = Vec::new();
    each_assignment(body, &mut |at, place| {
        if at == line && place.indices.is_empty() {
            targets.push(place);
        }
    });
    let choices = choices(body, &targets);
    choices.iter().flat_map(|choice| choice.untaken(trace, after, routine)).collect()
}

impl Choice {
    fn untaken<'t>(
        &self,
        trace: &'t Trace,
        after: Option<usize>,
        routine: RoutineId,
    ) -> Vec<Untaken<'t>> {
        let is_own = |done: &&Done| {
            (done.routine, done.line, done.effect) == (routine, self.line, Effect::Chose)
        };
        let is_later =
            after.is_none_or(|after| trace.done.iter().skip(after + 1).any(|done| is_own(&done)));
        let mut own = trace.done.iter().filter(is_own);
        let (Some(done), None, true) = (own.next(), own.next(), is_later) else {
            return Vec::new();
        };
        let within = self.within.iter();
        let inner: Vec<Untaken<'t>> =
            within.flat_map(|choice| choice.untaken(trace, after, routine)).collect();
        if inner.is_empty() { vec![Untaken { done, lines: self.assigns.clone() }] } else { inner }
    }
}

fn choices(body: &[Statement], targets: &[&Place]) -> Vec<Choice> {
    let is_choice = |statement: &&Statement| {
        matches!(statement.kind, StatementKind::If(..) | StatementKind::Case(..))
    };
    let choices = body.iter().filter(is_choice).map(|statement| {
        let bodies = bodies(&statement.kind);
        let mut assigns = Vec::new();
        for body in &bodies {
            each_assignment(body, &mut |line, place| {
                if targets.iter().any(|target| is_same(target, place)) {
                    assigns.push(line);
                }
            });
        }
        assigns.dedup();
        let within = bodies.into_iter().flat_map(|body| choices(body, targets)).collect();
        Choice { line: statement.line, assigns, within }
    });
    choices.filter(|choice| !choice.assigns.is_empty()).collect()
}

/// The bodies of a statement.
fn bodies(kind: &StatementKind) -> Vec<&[Statement]> {
    match kind {
        StatementKind::If(branches, otherwise) => {
            let branches = branches.iter().map(|branch| branch.body.as_slice());
            branches.chain([otherwise.as_slice()]).collect()
        }
        StatementKind::Case(_, cases, otherwise) => {
            let cases = cases.iter().map(|case| case.body.as_slice());
            cases.chain([otherwise.as_slice()]).collect()
        }
        StatementKind::For(turns) => vec![&turns.body],
        StatementKind::While(_, body) | StatementKind::Repeat(body, _) => vec![body],
        _ => Vec::new(),
    }
}

fn each_assignment<'s>(body: &'s [Statement], take: &mut dyn FnMut(u32, &'s Place)) {
    for statement in body {
        if let StatementKind::Assign(place, _) = &statement.kind {
            take(statement.line, place);
        }
        for body in bodies(&statement.kind) {
            each_assignment(body, take);
        }
    }
}

fn is_same(one: &Place, other: &Place) -> bool {
    one.indices.is_empty()
        && other.indices.is_empty()
        && (one.root, one.offset, one.bit) == (other.root, other.offset, other.bit)
}

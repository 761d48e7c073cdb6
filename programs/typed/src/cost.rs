//! What a scan takes: operations, known when a program is read, and memory.
//!
//! One *operation* is about an addition. Straight-line code is counted once, with the dearest branch of each selection and the code of what it
//! calls. A turn of a loop is charged to the program's budget when it begins, with the count of its body but not of loops within, which charge their
//! own turns. So a scan takes at most
//!
//! ```text
//! straight-line operations + min(operations of loops, budget)
//! ```
//!
//! where the operations of loops are known if each of them is a FOR with constant bounds whose body leaves the counter alone. It is assumed that
//! a counter is not reached both as a variable of the routine's own and as a global one.

use crate::form::{
    Argument, Call, Expression, ExpressionKind, For, Place, Program, Root, RoutineId, Statement,
    StatementKind,
};
use crate::operation::{Operation, TextOperation};
use crate::types::{Elementary, Type};

/// What a scan of a program takes at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Operations of straight-line code in a scan in which every task runs.
    pub straight: u64,
    /// Operations of all turns of loops; `None` where that depends on values.
    pub loops: Option<u64>,
    /// What the loops of a scan may take; one that wants more is a fault.
    pub budget: u64,
    /// What the dearest turn of a loop is charged.
    pub dearest_turn: u64,
    /// Bytes of the state: what is transferred to a station that joins.
    pub state_bytes: u64,
    /// Bytes of all frames: memory that lives in one scan only.
    pub frame_bytes: u64,
}

impl Cost {
    /// The cost of a program. Linear in its size.
    pub fn new(program: &Program) -> Self {
        let costs = Costs::new(program);
        let tasks = program.tasks.iter();
        let of_tasks: Vec<Each> = tasks.map(|task| costs.of(task.routine)).collect();
        Self {
            straight: of_tasks.iter().fold(0, |sum, each| sum.saturating_add(each.straight)),
            loops: sum(of_tasks.iter().map(|each| each.loops)),
            budget: program.budget,
            dearest_turn: costs.dearest_turn(program),
            state_bytes: 8 * u64::from(program.state),
            frame_bytes: 8 * u64::from(program.frames),
        }
    }

    /// Operations of a scan at most.
    pub fn worst_case(&self) -> u64 {
        let loops = self.loops.unwrap_or(u64::MAX).min(self.budget);
        self.straight.saturating_add(loops)
    }

    /// Whether only the budget bounds the loops: a scan may end in the fault [`crate::Cause::BudgetExceeded`].
    pub fn is_bounded_by_budget(&self) -> bool {
        self.loops.is_none_or(|loops| loops > self.budget)
    }
}

/// The cost of a piece of code.
#[derive(Debug, Clone, Copy)]
struct Each {
    /// Operations without the turns of loops.
    straight: u64,
    /// Operations of the turns of loops.
    loops: Option<u64>,
}

const NOTHING: Each = Each { straight: 0, loops: Some(0) };

fn straight(operations: u64) -> Each {
    Each { straight: operations, loops: Some(0) }
}

fn sum(costs: impl IntoIterator<Item = Option<u64>>) -> Option<u64> {
    costs.into_iter().try_fold(0_u64, |sum, cost| Some(sum.saturating_add(cost?)))
}

impl Each {
    fn and(self, other: Self) -> Self {
        Self {
            straight: self.straight.saturating_add(other.straight),
            loops: sum([self.loops, other.loops]),
        }
    }

    /// At most one of the two.
    fn or(self, other: Self) -> Self {
        let loops = self.loops.zip(other.loops);
        Self {
            straight: self.straight.max(other.straight),
            loops: loops.map(|(one, other)| one.max(other)),
        }
    }
}

/// The cost of each routine of a program; of what is charged, both engines ask here.
#[derive(Debug, Clone)]
pub(crate) struct Costs {
    routines: Vec<Option<Each>>,
}

impl Costs {
    pub(crate) fn new(program: &Program) -> Self {
        let mut costs = Self { routines: vec![None; program.routines.len()] };
        for index in 0..program.routines.len() {
            costs.add(program, index);
        }
        costs
    }

    /// The cost of a routine, after those that it calls.
    fn add(&mut self, program: &Program, index: usize) {
        if self.routines[index].is_some() {
            return;
        }
        // A routine that calls itself, which no valid program has, ends here.
        self.routines[index] = Some(NOTHING);
        let mut called = Vec::new();
        crate::visit::calls(&program.routines[index].body, &mut |routine| {
            called.push(routine);
        });
        for routine in called {
            self.add(program, routine.0 as usize);
        }
        let routine = &program.routines[index];
        let frame = straight(u64::from(routine.frame.1));
        self.routines[index] = Some(frame.and(self.statements(&routine.body)));
    }

    fn of(&self, routine: RoutineId) -> Each {
        self.routines[routine.0 as usize].unwrap_or(NOTHING)
    }

    fn dearest_turn(&self, program: &Program) -> u64 {
        let mut dearest = 0;
        let mut pending: Vec<&[Statement]> = program.routines.iter().map(|it| &*it.body).collect();
        while let Some(statements) = pending.pop() {
            for statement in statements {
                dearest = dearest.max(self.turn(&statement.kind).unwrap_or(0));
                pending.extend(crate::visit::bodies(statement));
            }
        }
        dearest
    }

    /// What a turn of a loop is charged: `None` for a statement that is no loop.
    pub(crate) fn turn(&self, statement: &StatementKind) -> Option<u64> {
        let turn = match statement {
            StatementKind::For(each) => straight(2).and(self.statements(&each.body)),
            StatementKind::While(condition, body) | StatementKind::Repeat(body, condition) => {
                straight(1).and(self.expression(condition)).and(self.statements(body))
            }
            _ => return None,
        };
        Some(turn.straight)
    }

    fn statements(&self, statements: &[Statement]) -> Each {
        let costs = statements.iter().map(|each| self.statement(&each.kind));
        costs.fold(NOTHING, Each::and)
    }

    fn statement(&self, statement: &StatementKind) -> Each {
        match statement {
            StatementKind::Assign(place, value) => {
                straight(copied(&place.of)).and(self.place(place)).and(self.expression(value))
            }
            StatementKind::Bind(slot, place) => {
                straight(1).and(self.place(slot)).and(self.place(place))
            }
            StatementKind::Invoke(routine, place) => {
                straight(1).and(self.place(place)).and(self.of(*routine))
            }
            StatementKind::Evaluate(expression) => self.expression(expression),
            StatementKind::If(branches, otherwise) => {
                let mut conditions = NOTHING;
                let mut bodies = self.statements(otherwise);
                for branch in branches {
                    let condition = self.expression(&branch.condition);
                    conditions = conditions.and(straight(1)).and(condition);
                    bodies = bodies.or(self.statements(&branch.body));
                }
                conditions.and(bodies)
            }
            StatementKind::Case(selector, cases, otherwise) => {
                let mut ranges = 0;
                let mut bodies = self.statements(otherwise);
                for case in cases {
                    ranges += case.ranges.len() as u64;
                    bodies = bodies.or(self.statements(&case.body));
                }
                self.expression(selector).and(straight(ranges)).and(bodies)
            }
            StatementKind::For(each) => self.repeated(each),
            StatementKind::While(condition, _) => {
                let unknown = Each { straight: 1, loops: None };
                unknown.and(self.expression(condition))
            }
            StatementKind::Repeat(..) => Each { straight: 1, loops: None },
            StatementKind::Exit | StatementKind::Continue | StatementKind::Return => straight(1),
        }
    }

    fn repeated(&self, each: &For) -> Each {
        let body = self.statements(&each.body);
        let turn = body.loops.map(|loops| {
            let straight = body.straight.saturating_add(2);
            straight.saturating_add(loops)
        });
        let turns = turns(each);
        let loops = turns.zip(turn);
        let once = [&each.from, &each.to, &each.by];
        once.into_iter()
            .map(|expression| self.expression(expression))
            .fold(self.place(&each.counter), Each::and)
            .and(Each { straight: 2, loops: loops.map(|(turns, turn)| turns.saturating_mul(turn)) })
    }

    fn place(&self, place: &Place) -> Each {
        let indices = place.indices.iter();
        indices.fold(NOTHING, |sum, index| sum.and(straight(1)).and(self.expression(&index.value)))
    }

    fn expression(&self, expression: &Expression) -> Each {
        match &expression.kind {
            ExpressionKind::Constant(_) | ExpressionKind::Text(_) => NOTHING,
            ExpressionKind::Load(place) => self.place(place),
            ExpressionKind::Apply(operation, operands) => {
                let values = operands.iter().map(|operand| self.expression(operand));
                values.fold(straight(applied(*operation, operands)), Each::and)
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                let either = self.expression(first).or(self.expression(second));
                straight(1).and(self.expression(condition)).and(either)
            }
            ExpressionKind::Call(call) => self.call(call),
        }
    }

    fn call(&self, call: &Call) -> Each {
        let mut sum = straight(1).and(self.of(call.routine));
        if let Some(own) = &call.own {
            sum = sum.and(self.place(own));
        }
        for argument in &call.arguments {
            sum = sum.and(match argument {
                Argument::Value(place, value) => {
                    straight(copied(&place.of)).and(self.expression(value))
                }
                Argument::Reference(_, place) => straight(1).and(self.place(place)),
            });
        }
        for (from, to) in &call.outputs {
            sum = sum.and(straight(copied(&from.of))).and(self.place(to));
        }
        let result = call.result.as_ref().map_or(0, |place| copied(&place.of));
        sum.and(straight(result))
    }
}

/// Operations that a copy takes.
fn copied(of: &Type) -> u64 {
    of.slots()
}

fn applied(operation: Operation, operands: &[Expression]) -> u64 {
    let lengths = operands.iter().map(|operand| match operand.of {
        Type::Text(capacity) => u64::from(capacity),
        _ => 0,
    });
    match operation {
        // One byte after the other, at each position.
        Operation::Text(TextOperation::Find) => {
            1 + lengths.fold(1, |product, length| product * length.max(1)) / 8
        }
        Operation::Text(TextOperation::From(_) | TextOperation::To(_)) => {
            16 + lengths.sum::<u64>() / 8
        }
        Operation::Text(_) => 1 + lengths.sum::<u64>() / 8,
        Operation::Real(..) | Operation::Power(_) => 8,
        _ => 1,
    }
}

/// The turns of a loop at most, where its bounds are constants and its body leaves the counter alone.
pub(crate) fn turns(each: &For) -> Option<u64> {
    let of = each.counter.of.elementary()?;
    let constant = |expression: &Expression| match expression.kind {
        ExpressionKind::Constant(stored) => Some(of.signed(stored)),
        _ => None,
    };
    let (from, to, by) = (constant(&each.from)?, constant(&each.to)?, constant(&each.by)?);
    if !each.counter.indices.is_empty()
        || each.counter.is_by_reference()
        || by == 0
        || changes(&each.body, &each.counter, of)
    {
        return None;
    }
    let distance = if by > 0 { to - from } else { from - to };
    let turns = if distance < 0 { 0 } else { distance / by.abs() + 1 };
    Some(u64::try_from(turns).unwrap_or(u64::MAX))
}

/// Whether statements may change a counter.
fn changes(statements: &[Statement], counter: &Place, of: Elementary) -> bool {
    let mut may = false;
    crate::visit::writes(statements, &mut |written| {
        let (start, end) = (extent(counter), extent(written));
        may |= match (counter.root, written.root) {
            (_, Root::OwnReference(_) | Root::FrameReference(_)) => {
                !matches!(counter.root, Root::Frame(_)) && written.of.elementary() == Some(of)
            }
            (Root::Global(_), Root::Global(_))
            | (Root::Own(_), Root::Own(_))
            | (Root::Frame(_), Root::Frame(_)) => start.0 < end.1 && end.0 < start.1,
            _ => false,
        };
    });
    // A method on the routine's own instance has the routine's own variables, and whatever is called may have global ones.
    crate::visit::expressions(statements, &mut |expression| {
        if let ExpressionKind::Call(call) = &expression.kind {
            let own = call.own.as_ref().map(|own| own.root);
            may |= matches!((own, counter.root), (Some(Root::Own(_)), Root::Own(_)));
        }
    });
    crate::visit::calls(statements, &mut |_| {
        may |= matches!(counter.root, Root::Global(_));
    });
    may
}

/// First slot and end of what a place may mean, counted from its root; with a computed index, all that follows.
fn extent(place: &Place) -> (u64, u64) {
    let (Root::Global(slot)
    | Root::Own(slot)
    | Root::Frame(slot)
    | Root::OwnReference(slot)
    | Root::FrameReference(slot)) = place.root;
    let start = u64::from(slot) + u64::from(place.offset);
    match place.indices.is_empty() {
        true => (start, start + place.of.slots()),
        false => (start, u64::MAX),
    }
}

//! Programs as a front end would write them: 100 PID loops, integer loops over an array, Boolean logic.

use std::sync::Arc;

use understudy_typed::{
    Array, Branch, Comparison, Elementary, Expression, ExpressionKind, For, Index, Operation,
    Place, Program, Root, Routine, RoutineId, RoutineKind, Statement, StatementKind, StructureId,
    Task, Type,
};

pub(crate) fn constant(of: Elementary, value: u64) -> Expression {
    Expression { of: Type::Elementary(of), kind: ExpressionKind::Constant(value) }
}

fn real(value: f64) -> Expression {
    constant(Elementary::Lreal, value.to_bits())
}

fn load(root: Root, of: Elementary) -> Expression {
    Expression {
        of: Type::Elementary(of),
        kind: ExpressionKind::Load(Box::new(Place::new(root, Type::Elementary(of)))),
    }
}

fn apply<const N: usize>(operation: Operation, operands: [Expression; N]) -> Expression {
    let signature = operation.signature(N).expect("a defined operation");
    let understudy_typed::Operand::Number(of) = signature.result else {
        panic!("no number");
    };
    Expression { of: Type::Elementary(of), kind: ExpressionKind::Apply(operation, operands.into()) }
}

fn assign(root: Root, value: Expression) -> Statement {
    let place = Place::new(root, value.of.clone());
    statement(StatementKind::Assign(place, value))
}

fn statement(kind: StatementKind) -> Statement {
    Statement { line: 1, kind }
}

fn routine(name: &str, body: Vec<Statement>) -> Routine {
    Routine {
        name: name.to_owned(),
        kind: RoutineKind::Block,
        frame: (0, 0),
        initial: Vec::new(),
        body,
        timer: None,
    }
}

fn program(state: u32, routines: Vec<Routine>) -> Program {
    Program {
        period: 10_000_000,
        budget: 10_000_000,
        state,
        tasks: vec![Task {
            routine: RoutineId(routines.len() as u32 - 1),
            own: Program::HEADER,
            every: 1,
        }],
        routines,
        ..Program::default()
    }
}

/// Operations of one PID loop as it is written below.
pub(crate) const PID_OPERATIONS: usize = 16;

/// `count` instances of a PID block on one measurement, each with its own state.
///
/// Own: 0 measurement, 1 setpoint, 2 integral, 3 last error, 4 output, 5 error.
pub(crate) fn pid(count: u32) -> Program {
    use Elementary::Lreal;
    use Operation as O;
    let own = |slot| load(Root::Own(slot), Lreal);
    let times = |gain: f64, value| apply(O::Multiply(Lreal), [real(gain), value]);
    let add = |one, other| apply(O::Add(Lreal), [one, other]);
    let limit = |low: f64, value: Expression, high: f64| {
        let value = apply(O::Maximum(Lreal), [real(low), value]);
        apply(O::Minimum(Lreal), [value, real(high)])
    };
    let compare = |comparison, bound| apply(O::Compare(comparison, Lreal), [own(2), real(bound)]);
    let clamp = |comparison, bound: f64| {
        statement(StatementKind::If(
            vec![Branch {
                condition: compare(comparison, bound),
                body: vec![assign(Root::Own(2), real(bound))],
            }],
            Vec::new(),
        ))
    };
    let derivative = apply(O::Subtract(Lreal), [own(5), own(3)]);
    let block = vec![
        assign(Root::Own(5), apply(O::Subtract(Lreal), [own(1), own(0)])),
        assign(Root::Own(2), add(own(2), times(0.01, own(5)))),
        clamp(Comparison::Greater, 50.0),
        clamp(Comparison::Less, -50.0),
        assign(
            Root::Own(4),
            limit(
                0.0,
                add(add(times(2.0, own(5)), times(0.5, own(2))), times(0.1, derivative)),
                100.0,
            ),
        ),
        assign(Root::Own(3), own(5)),
        // The plant: a first-order lag.
        assign(Root::Own(0), add(times(0.99, own(0)), times(0.01, own(4)))),
    ];
    let instance =
        |index: u32| Place::new(Root::Own(6 * index), Type::Structure(StructureId(0), 6));
    let calls = (0..count)
        .map(|index| statement(StatementKind::Invoke(RoutineId(0), instance(index))))
        .collect();
    let mut program =
        program(Program::HEADER + 6 * count, vec![routine("PID", block), routine("MAIN", calls)]);
    for index in 0..count {
        program.initial.push(understudy_typed::Initial {
            slot: Program::HEADER + 6 * index + 1,
            value: (20.0 + f64::from(index)).to_bits(),
        });
    }
    program
}

/// Operations of a turn of the loop below.
pub(crate) const INTEGER_OPERATIONS: usize = 7;

/// `FOR i := 0 TO n - 1 DO a[i] := a[i] * 31 + i; IF a[i] > 1000000 THEN sum := sum + a[i]; END_IF; END_FOR`
///
/// Own: 0 counter, 1 sum, 2 the array.
pub(crate) fn integer(length: u32) -> Program {
    use Elementary::{Dint, Lint};
    use Operation as O;
    let element = || {
        let value = apply(O::Convert(Dint, Lint), [load(Root::Own(0), Dint)]);
        Place {
            indices: vec![Index { value, low: 0, high: i64::from(length) - 1, stride: 32 }],
            is_packed: true,
            ..Place::new(Root::Own(2), Type::Elementary(Dint))
        }
    };
    let loaded = || Expression {
        of: Type::Elementary(Dint),
        kind: ExpressionKind::Load(Box::new(element())),
    };
    let product = apply(O::Multiply(Dint), [loaded(), constant(Dint, 31)]);
    let value = apply(O::Add(Dint), [product, load(Root::Own(0), Dint)]);
    let greater = O::Compare(Comparison::Greater, Dint);
    let body = vec![
        statement(StatementKind::Assign(element(), value)),
        statement(StatementKind::If(
            vec![Branch {
                condition: apply(greater, [loaded(), constant(Dint, 1_000_000)]),
                body: vec![assign(
                    Root::Own(1),
                    apply(O::Add(Dint), [load(Root::Own(1), Dint), loaded()]),
                )],
            }],
            Vec::new(),
        )),
    ];
    let counted = StatementKind::For(Box::new(For {
        counter: Place::new(Root::Own(0), Type::Elementary(Dint)),
        from: constant(Dint, 0),
        to: constant(Dint, u64::from(length) - 1),
        by: constant(Dint, 1),
        body,
    }));
    let array = Array { ranges: vec![(0, i64::from(length) - 1)], element: Type::Elementary(Dint) };
    let slots = Type::Array(Arc::new(array)).slots() as u32;
    program(Program::HEADER + 2 + slots, vec![routine("MAIN", vec![statement(counted)])])
}

/// Operations of a rung below.
pub(crate) const BOOLEAN_OPERATIONS: usize = 4;

/// `x[i] := (x[a] OR x[i]) AND NOT x[b] XOR x[c]`, a row of BOOLs.
pub(crate) fn boolean(rungs: u32) -> Program {
    use Elementary::Bool;
    use Operation as O;
    let body = (0..rungs)
        .map(|rung| {
            let at = |step: u32| load(Root::Own((rung * step + step) % rungs), Bool);
            let either = apply(O::Or(Bool), [at(7), load(Root::Own(rung), Bool)]);
            let not = apply(O::Not(Bool), [at(31)]);
            let both = apply(O::And(Bool), [either, not]);
            assign(Root::Own(rung), apply(O::Xor(Bool), [both, at(3)]))
        })
        .collect();
    let mut program = program(Program::HEADER + rungs, vec![routine("MAIN", body)]);
    for rung in (0..rungs).step_by(3) {
        program.initial.push(understudy_typed::Initial { slot: Program::HEADER + rung, value: 1 });
    }
    program
}

//! What a scan costs, what validation finds, and what a fault looks like to a person.

#[path = "../benches/programs/mod.rs"]
mod programs;

use understudy_typed::{
    Cost, Elementary, Expression, ExpressionKind, Fault, Interpreter, Machine, Operation, Place,
    Program, Root, RoutineId, Scratch, Statement, StatementKind, Type,
};

/// Scans until the state holds a fault.
fn fault(program: &Program) -> Option<String> {
    assert_eq!(program.validate(), Ok(()));
    let machine = Machine::new(program);
    let mut state = machine.initial().to_vec();
    let mut expected = state.clone();
    for _ in 0..3 {
        machine.step(&mut Scratch::default(), &mut state, &[0], &mut [0]);
        Interpreter::new(program).step(&mut expected, &[0], &mut [0]);
        assert_eq!(state, expected);
    }
    Fault::read(&state).map(|fault| fault.describe(program))
}

#[test]
fn the_cost_of_a_loop_with_constant_bounds_is_exact() {
    // A turn: 2 for the loop; index, assignment, two operations and an index; index, comparison, jump; index, addition, assignment.
    let mut program = programs::integer(1_000);
    let cost = Cost::new(&program);
    let turns = cost.loops.expect("constant bounds");
    assert_eq!(turns % 1_000, 0);
    let turn = turns / 1_000;
    assert!((programs::INTEGER_OPERATIONS as u64..20).contains(&turn), "{turn}");
    assert!(!cost.is_bounded_by_budget());
    assert_eq!(cost.worst_case(), cost.straight + turns);
    assert_eq!(cost.state_bytes, 8 * u64::from(program.state));
    program.budget = turns;
    assert_eq!(fault(&program), None);
    program.budget = turns - 1;
    let expected = format!(
        "MAIN, line 1: the loops of one scan exceed the budget of {} operations",
        turns - 1
    );
    assert_eq!(fault(&program), Some(expected));
    assert!(Cost::new(&program).is_bounded_by_budget());
}

#[test]
fn a_loop_whose_counter_is_changed_is_bounded_by_the_budget_alone() {
    let mut program = programs::integer(10);
    let StatementKind::For(each) = &mut program.routines[0].body[0].kind else {
        panic!("a loop");
    };
    let counter = each.counter.clone();
    let value = Expression {
        of: Type::Elementary(Elementary::Dint),
        kind: ExpressionKind::Load(Box::new(counter.clone())),
    };
    each.body.push(Statement { line: 2, kind: StatementKind::Assign(counter, value) });
    let cost = Cost::new(&program);
    assert_eq!(cost.loops, None);
    assert!(cost.is_bounded_by_budget());
    assert_eq!(cost.worst_case(), cost.straight + program.budget);
}

#[test]
fn blocks_cost_what_is_called() {
    let one = Cost::new(&programs::pid(1));
    let ten = Cost::new(&programs::pid(10));
    assert_eq!(ten.straight, 10 * one.straight);
    assert_eq!(ten.loops, Some(0));
}

#[test]
fn a_value_that_no_actuator_can_follow_is_a_fault_that_names_the_output() {
    let mut program = programs::pid(1);
    let slot = Program::HEADER + 4;
    program.outputs.push("valve", Elementary::Lreal, slot);
    program.seal_points();
    let value = |value: f64| Expression {
        of: Type::Elementary(Elementary::Lreal),
        kind: ExpressionKind::Constant(value.to_bits()),
    };
    let divide = Operation::Divide(Elementary::Lreal);
    program.routines[1].body.push(Statement {
        line: 7,
        kind: StatementKind::Assign(
            Place::new(Root::Own(4), Type::Elementary(Elementary::Lreal)),
            Expression {
                kind: ExpressionKind::Apply(divide, vec![value(1.0), value(0.0)]),
                ..value(0.0)
            },
        ),
    });
    let machine = Machine::new(&program);
    let mut state = machine.initial().to_vec();
    let mut outputs = [0; 2];
    machine.step(&mut Scratch::default(), &mut state, &[0], &mut outputs);
    let fault = Fault::read(&state).expect("a fault");
    assert_eq!(fault.describe(&program), "output valve is INF, which is not a finite number");
    // The output holds what it was, and the fault is visible.
    assert_eq!(outputs, [0, 1]);
    assert_eq!(state[4..], machine.initial()[4..]);
}

type Breaks = fn(&mut Program);

#[test]
fn validation_names_what_is_wrong() {
    let broken: [(Breaks, &str); 6] = [
        (|program| program.tasks[0].every = 0, "task of routine 0"),
        (|program| program.state = 5, "outside the state"),
        (|program| program.routines[0].frame = (0, 9), "its frame is outside the frames"),
        (
            |program| program.routines[0].body[0].kind = StatementKind::Exit,
            "EXIT or CONTINUE outside a loop",
        ),
        (
            |program| {
                let own = Place::new(Root::Own(0), program.variables[0].of.clone());
                program.routines[0].body[0].kind = StatementKind::Invoke(RoutineId(0), own);
            },
            "calls itself",
        ),
        (
            |program| {
                let place = Place::new(Root::Own(0), Type::Elementary(Elementary::Dint));
                let value = Expression {
                    of: Type::Elementary(Elementary::Real),
                    kind: ExpressionKind::Constant(0),
                };
                program.routines[0].body[0].kind = StatementKind::Assign(place, value);
            },
            "in place of",
        ),
    ];
    for (breaks, expected) in broken {
        let mut program = programs::integer(10);
        program.variables.push(understudy_typed::Variable {
            name: "all".to_owned(),
            of: Type::Text(40),
            slot: Program::HEADER,
            address: None,
            description: None,
        });
        assert_eq!(program.validate(), Ok(()));
        breaks(&mut program);
        let found = program.validate().expect_err(expected);
        assert!(
            found.iter().any(|violation| violation.to_string().contains(expected)),
            "{expected}: {found:?}"
        );
    }
}

#[test]
fn the_programs_of_the_bench_mean_the_same_to_both_engines() {
    for program in [
        programs::pid(20),
        // More instances than routines are compiled for one by one.
        programs::pid(2_000),
        programs::integer(50),
        programs::boolean(100),
    ] {
        assert_eq!(program.validate(), Ok(()));
        let (machine, interpreter) = (Machine::new(&program), Interpreter::new(&program));
        let mut scratch = Scratch::default();
        let mut state = machine.initial().to_vec();
        let mut expected = state.clone();
        for _ in 0..20 {
            machine.step(&mut scratch, &mut state, &[], &mut []);
            interpreter.step(&mut expected, &[], &mut []);
            assert_eq!(state, expected);
        }
    }
    let _ = programs::BOOLEAN_OPERATIONS + programs::PID_OPERATIONS;
}

/// Transcendental functions of the platform differ between platforms; those of `libm` do not.
#[test]
fn no_source_calls_a_function_of_the_platform() {
    let sources = [
        include_str!("../src/operation/real.rs"),
        include_str!("../src/operation/apply.rs"),
        include_str!("../src/operation/text.rs"),
        include_str!("../src/machine/execute.rs"),
        include_str!("../src/interpreter/evaluate.rs"),
    ];
    let banned = [
        "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "exp2", "ln", "log", "log2",
        "log10", "powf", "powi", "cbrt", "hypot", "mul_add", "sinh", "cosh", "tanh",
    ];
    for source in sources {
        for name in banned {
            for call in [format!(".{name}("), format!("f32::{name}"), format!("f64::{name}")] {
                assert!(!source.contains(&call), "{call}");
            }
        }
    }
}

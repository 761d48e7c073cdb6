use proptest::prelude::*;
use understudy_typed::{Comparison, Elementary};

use super::*;
use crate::parser::{parse, parse_body, parse_expression, parse_statements};
use crate::syntax::{
    Argument, Expression, ExpressionKind, File, For, Initializer, Label, Literal, Name, Operator,
    Path, Statement, StatementKind, Step, TypeKind, TypeName,
};

/// What a tree says, without its places.
fn content(tree: &impl std::fmt::Debug) -> String {
    let text = format!("{tree:?}");
    let mut kept = String::with_capacity(text.len());
    let mut rest = text.as_str();
    while let Some(place) = rest.find("..") {
        let start = rest[..place].trim_end_matches(|next: char| next.is_ascii_digit());
        let end = rest[place + 2..].trim_start_matches(|next: char| next.is_ascii_digit());
        kept.push_str(start);
        kept.push('~');
        rest = end;
    }
    kept + rest
}

fn name() -> impl Strategy<Value = Name> {
    prop::sample::select(vec!["a", "Level", "x_1", "STEP", "ready", "T", "D", "N"])
        .prop_map(|word| Name::new(word, 0..0))
}

fn expression_of(kind: ExpressionKind) -> Expression {
    Expression { kind, span: 0..0 }
}

fn literal() -> impl Strategy<Value = Literal> {
    let integer = (0..i128::from(u64::MAX)).prop_map(|value| Literal::Integer {
        value,
        of: None,
        based: value % 3 == 0,
    });
    let typed = (-128..128_i128).prop_map(|value| Literal::Integer {
        value,
        of: Some(Elementary::Sint),
        based: false,
    });
    let bits = (0..65_536_i128).prop_map(|value| Literal::Integer {
        value,
        of: Some(Elementary::Word),
        based: true,
    });
    let real = (0..1000_u32, 0..1000_u32, -30..30_i32).prop_map(|(whole, part, exponent)| {
        Literal::Real { text: format!("{whole}.{part}E{exponent}"), of: None }
    });
    let kinds = prop::sample::select(vec![Elementary::Time, Elementary::DateAndTime]);
    let time = (any::<i64>(), kinds).prop_map(|(nanoseconds, of)| Literal::Time {
        nanoseconds: match of {
            Elementary::Time => nanoseconds.max(-i64::MAX),
            _ => nanoseconds.saturating_abs(),
        },
        of,
    });
    let text = (prop::collection::vec(any::<u8>(), 0..8), any::<bool>());
    let text = text.prop_map(|(bytes, wide)| Literal::Text { bytes, wide });
    prop_oneof![any::<bool>().prop_map(Literal::Boolean), integer, typed, bits, real, time, text]
}

fn path(inner: impl Strategy<Value = Expression> + Clone + 'static) -> impl Strategy<Value = Path> {
    let bits = (prop::sample::select(vec![1_u8, 8, 16, 32]), 0..64_u32);
    let step = prop_oneof![
        name().prop_map(Step::Field),
        prop::collection::vec(inner, 1..3).prop_map(Step::Index),
        bits.prop_map(|(width, number)| Step::Bits { width, number, span: 0..0 }),
        Just(Step::Follow),
    ];
    // A number behind a number would be a real one.
    let is_legal = |steps: &Vec<Step>| {
        let bits = |step: &Step| matches!(step, Step::Bits { .. });
        !steps.windows(2).any(|pair| bits(&pair[0]) && bits(&pair[1]))
    };
    let steps = prop::collection::vec(step, 0..3).prop_filter("bits of bits", is_legal);
    (name(), steps).prop_map(|(root, steps)| Path { root, steps, span: 0..0 })
}

fn argument(
    inner: impl Strategy<Value = Expression> + Clone + 'static,
) -> impl Strategy<Value = Argument> {
    let taken = (name(), path(inner.clone()), any::<bool>());
    prop_oneof![
        inner.clone().prop_map(Argument::Placed),
        (name(), inner).prop_map(|(name, value)| Argument::Given(name, value)),
        taken.prop_map(|(from, to, negated)| Argument::Taken { from, to, negated }),
    ]
}

fn operator() -> impl Strategy<Value = Operator> {
    prop::sample::select(vec![
        Operator::Or,
        Operator::Xor,
        Operator::And,
        Operator::OrElse,
        Operator::AndThen,
        Operator::Compare(Comparison::Equal),
        Operator::Compare(Comparison::NotEqual),
        Operator::Compare(Comparison::Less),
        Operator::Compare(Comparison::GreaterOrEqual),
        Operator::Add,
        Operator::Subtract,
        Operator::Multiply,
        Operator::Divide,
        Operator::Modulo,
        Operator::Power,
    ])
}

fn chain(first: Expression, operator: Operator, rest: Vec<Expression>) -> Expression {
    let rest = rest.into_iter().map(|right| (operator, right)).collect();
    expression_of(ExpressionKind::Chain(Box::new(first), rest))
}

fn any_expression() -> impl Strategy<Value = Expression> + Clone {
    let leaf = prop_oneof![
        literal().prop_map(ExpressionKind::Literal),
        name().prop_map(|root| ExpressionKind::Variable(Path {
            root,
            steps: Vec::new(),
            span: 0..0
        })),
        name().prop_map(|name| ExpressionKind::Qualified(Name::new("Colour", 0..0), name)),
    ];
    let leaf = leaf.prop_map(expression_of);
    leaf.prop_recursive(4, 24, 4, |inner| {
        let inner = inner.boxed();
        let boxed = inner.clone().prop_map(Box::new);
        let call = (path(inner.clone()), prop::collection::vec(argument(inner.clone()), 0..3));
        prop_oneof![
            path(inner.clone()).prop_map(|path| expression_of(ExpressionKind::Variable(path))),
            boxed.clone().prop_map(|inner| expression_of(ExpressionKind::Not(inner))),
            boxed.prop_map(|inner| expression_of(ExpressionKind::Minus(inner))),
            (inner.clone(), operator(), prop::collection::vec(inner.clone(), 1..3))
                .prop_map(|(first, operator, rest)| chain(first, operator, rest)),
            call.prop_map(|(path, arguments)| expression_of(ExpressionKind::Call(path, arguments))),
        ]
    })
    .boxed()
}

fn any_statement() -> impl Strategy<Value = Statement> {
    let value = any_expression();
    let leaf = prop_oneof![
        (path(value.clone()), value.clone())
            .prop_map(|(path, value)| StatementKind::Assign(path, value)),
        (path(value.clone()), prop::collection::vec(argument(value.clone()), 0..3))
            .prop_map(|(path, arguments)| StatementKind::Call(path, arguments)),
        Just(StatementKind::Exit),
        Just(StatementKind::Continue),
        Just(StatementKind::Return),
    ];
    let comments =
        prop::collection::vec(prop::sample::select(vec!["note".to_owned(), "a b".into()]), 0..2);
    let placed = move |kinds: BoxedStrategy<StatementKind>| {
        (kinds, comments.clone()).prop_map(|(kind, comments)| Statement {
            kind,
            span: 0..0,
            comments,
        })
    };
    let again = placed.clone();
    placed(leaf.boxed()).prop_recursive(3, 12, 3, move |inner| {
        let body = prop::collection::vec(inner, 0..3).boxed();
        let label = (0..9_i128, prop::option::of(10..19_i128)).prop_map(|(first, last)| {
            let number = |value| {
                expression_of(ExpressionKind::Literal(Literal::Integer {
                    value,
                    of: None,
                    based: false,
                }))
            };
            Label { first: number(first), last: last.map(number) }
        });
        let branch = (prop::collection::vec(label, 1..3), body.clone());
        let counted = (
            path(value.clone()),
            value.clone(),
            value.clone(),
            prop::option::of(value.clone()),
            body.clone(),
        );
        let kinds = prop_oneof![
            (prop::collection::vec((value.clone(), body.clone()), 1..3), body.clone())
                .prop_map(|(branches, otherwise)| StatementKind::If(branches, otherwise)),
            (value.clone(), prop::collection::vec(branch, 1..3), body.clone()).prop_map(
                |(selector, branches, otherwise)| StatementKind::Case(
                    selector, branches, otherwise
                )
            ),
            counted.prop_map(|(counter, from, to, by, body)| {
                StatementKind::For(Box::new(For { counter, from, to, by, body }))
            }),
            (value.clone(), body.clone())
                .prop_map(|(condition, body)| StatementKind::While(condition, body)),
            (body.clone(), value.clone())
                .prop_map(|(body, condition)| StatementKind::Repeat(body, condition)),
        ];
        again(kinds.boxed())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(192))]

    #[test]
    fn expressions_are_read_as_they_are_printed(tree in any_expression()) {
        let printed = expression(&tree);
        let (read, found) = parse_expression(&printed);
        prop_assert!(found.is_empty(), "{}: {:?}", printed, found);
        prop_assert_eq!(content(&read), content(&tree), "{}", printed);
    }

    #[test]
    fn statements_are_read_as_they_are_printed(trees in prop::collection::vec(any_statement(), 1..4)) {
        let printed = statements(&trees);
        let (read, found) = parse_statements(&printed);
        prop_assert!(found.is_empty(), "{}: {:?}", printed, found);
        prop_assert_eq!(content(&read), content(&trees), "{}", printed);
    }

    #[test]
    fn any_text_is_answered(text in "\\PC{0,200}", words in prop::collection::vec(prop::sample::select(WORDS.to_vec()), 0..60)) {
        for text in [text, words.join(" "), words.join("\n")] {
            let (file_read, _) = parse(&text);
            let (body, _) = parse_body(&text);
            // What was read can be printed, and what was printed can be read.
            let printed = file(&file_read);
            parse(&printed);
            let _ = format!("{body:?}");
        }
    }
}

const WORDS: [&str; 56] = [
    "PROGRAM",
    "END_PROGRAM",
    "FUNCTION_BLOCK",
    "FUNCTION",
    "METHOD",
    "PROPERTY",
    "ACTION",
    "TYPE",
    "END_TYPE",
    "STRUCT",
    "END_STRUCT",
    "VAR",
    "VAR_GLOBAL",
    "END_VAR",
    "ARRAY",
    "OF",
    "[",
    "]",
    "(",
    ")",
    ":=",
    "=>",
    ";",
    ":",
    ",",
    ".",
    "..",
    "IF",
    "THEN",
    "ELSE",
    "END_IF",
    "CASE",
    "END_CASE",
    "FOR",
    "TO",
    "DO",
    "REPEAT",
    "UNTIL",
    "INITIAL_STEP",
    "STEP",
    "TRANSITION",
    "FROM",
    "LD",
    "ANDN(",
    "CAL",
    "a",
    "b",
    "3",
    "T#1s",
    "'x'",
    "\"x\"",
    "#l",
    "INT",
    "CONFIGURATION",
    "TASK",
    "DATA_BLOCK",
];

fn named(word: &str) -> TypeName {
    let kind = TypeKind::Named(Name::new(word, 0..0));
    TypeName { kind, span: 0..0 }
}

#[test]
fn a_whole_file_is_read_as_it_is_printed() {
    let text = "TYPE P : STRUCT x : REAL := 1.5; y : ARRAY [0..3] OF INT := [1, 3(0)]; END_STRUCT; E : (a, b := 4) INT := b; S : INT (-5..5); END_TYPE
        (* Adds. *) FUNCTION_BLOCK F EXTENDS G IMPLEMENTS I VAR_INPUT a, b AT %IX0.0 : BOOL R_EDGE; END_VAR VAR RETAIN c : STRING[9] := 'x'; (* text *) END_VAR
        METHOD m : INT VAR_INPUT n : INT; END_VAR m := n; END_METHOD a := b; END_FUNCTION_BLOCK
        FUNCTION_BLOCK chart INITIAL_STEP s: go(L, T#1s); END_STEP STEP t: END_STEP TRANSITION u (PRIORITY := 1) FROM s TO t := a; END_TRANSITION ACTION go: b := 1; END_ACTION END_FUNCTION_BLOCK
        PROGRAM list VAR a : BOOL; END_VAR\nLD a\nAND( b\nORN c\n)\nCAL t(IN := a, Q => b)\nADD 4, x\nl: JMPC l\nRET\nEND_PROGRAM
        CONFIGURATION C VAR_GLOBAL g : P := (x := 1.0, y := [4(2)]); END_VAR RESOURCE R ON PLC TASK T1 (SINGLE := a, INTERVAL := T#10ms, PRIORITY := 1);
        PROGRAM i WITH T1 : F (a := g, b => g); END_RESOURCE END_CONFIGURATION";
    let (first, found) = parse(text);
    assert!(found.is_empty(), "{found:?}");
    let printed = file(&first);
    let (second, found) = parse(&printed);
    assert!(found.is_empty(), "{printed}\n{found:?}");
    assert_eq!(content(&second), content(&first), "{printed}");
    insta::assert_snapshot!(printed);
}

#[test]
fn parts_are_printed_alone() {
    assert_eq!(type_name(&named("REAL")), "REAL");
    let value = Initializer::Value(expression_of(ExpressionKind::Literal(Literal::Boolean(true))));
    assert_eq!(initializer(&value), "TRUE");
    assert_eq!(file(&File::default()), "");
    let (read, _) = parse("PROGRAM p END_PROGRAM");
    assert_eq!(unit(&read.units[0]), "PROGRAM p\nEND_PROGRAM\n");
    assert_eq!(declarations(&[]), "");
}

//! Functions of one type, `ADD_INT` and its like: the function, whose inputs are of that type.

use understudy_typed::{Elementary, Type};

use crate::lower::Lowering;
use crate::lower::numbers::Operand;
use crate::lower::types::elementary;
use crate::syntax::{self, Argument, Expression, ExpressionKind, Name, Path, Span};

/// Functions that have such names.
const FUNCTIONS: [&str; 37] = [
    "ABS", "SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN", "ADD", "SUB",
    "MUL", "DIV", "MOD", "EXPT", "MOVE", "SHL", "SHR", "ROL", "ROR", "AND", "OR", "XOR", "NOT",
    "MAX", "MIN", "LIMIT", "SEL", "MUX", "GT", "GE", "EQ", "NE", "LE", "LT",
];

/// Functions that are there for times as well: ADD_TIME and its like are functions of their own.
const OF_TIMES: [&str; 6] = ["MOVE", "SEL", "MUX", "MAX", "MIN", "LIMIT"];

/// Start of the name of the function that gives a value a type. It has a dot, so no program can call it.
const MARK: &str = "TYPED.";

/// A function for one type.
pub(super) struct Typed {
    pub(super) function: &'static str,
    of: Elementary,
}

/// The function of a name such as `ADD_INT`.
pub(super) fn of(key: &str) -> Option<Typed> {
    let (function, of) = key.split_once('_')?;
    let of = elementary(of)?;
    let function = FUNCTIONS.into_iter().find(|known| *known == function)?;
    (!of.is_time() || OF_TIMES.contains(&function)).then_some(Typed { function, of })
}

/// The type that a value is given.
pub(super) fn marked(key: &str) -> Option<Elementary> {
    elementary(key.strip_prefix(MARK)?)
}

impl Lowering<'_> {
    pub(super) fn typed_function(
        &mut self,
        typed: &Typed,
        values: &[&syntax::Expression],
        span: &Span,
    ) -> Operand {
        // The number of places, the exponent and what chooses are of their own types.
        let other = match typed.function {
            "SEL" | "MUX" => Some(0),
            "SHL" | "SHR" | "ROL" | "ROR" | "EXPT" => Some(1),
            _ => None,
        };
        let given = values.iter().enumerate().map(|(at, value)| match other == Some(at) {
            true => (*value).clone(),
            false => mark(value, typed.of),
        });
        let given: Vec<Expression> = given.collect();
        let given: Vec<&Expression> = given.iter().collect();
        let of = Type::Elementary(typed.of);
        self.standard_value(typed.function, &given, Some(&of), span)
    }
}

/// A value as one of a type.
fn mark(value: &Expression, of: Elementary) -> Expression {
    let span = value.span.clone();
    let path = Path {
        root: Name::new(format!("{MARK}{}", of.name()), span.clone()),
        steps: Vec::new(),
        span: span.clone(),
    };
    Expression { kind: ExpressionKind::Call(path, vec![Argument::Placed(value.clone())]), span }
}

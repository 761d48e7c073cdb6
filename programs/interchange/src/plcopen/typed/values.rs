//! The types of values, as far as what is kept between two objects of a network needs one.

use understudy_structured_text::library;
use understudy_structured_text::syntax::{
    Argument, Declaration, Expression, ExpressionKind, File, Literal, Name, Operator, Path, Span,
    Step, TypeKind, TypeName, Unit, UnitKind,
};

use super::make::named;

/// Aliases that are followed.
const MAXIMUM_ALIASES: usize = 32;

/// Numbers, the narrower first.
const NUMBERS: [&str; 10] =
    ["SINT", "USINT", "INT", "UINT", "DINT", "UDINT", "LINT", "ULINT", "REAL", "LREAL"];

/// What is known where a value stands.
pub(crate) struct Values<'a> {
    pub(crate) file: &'a File,
    /// The variables of the unit, and those that were made for it.
    pub(crate) declarations: &'a [Declaration],
    pub(crate) made: &'a [Declaration],
}

/// A unit of the file or of the library.
pub(crate) fn unit<'a>(file: &'a File, name: &str) -> Option<&'a Unit> {
    let mut units = file.units.iter().chain(&library().units);
    units.find(|unit| unit.name.is(name))
}

impl<'a> Values<'a> {
    /// The type of a value; a number without one takes the widest that it may need.
    pub(crate) fn of(&self, value: &Expression) -> TypeName {
        self.strong(value)
            .or_else(|| weak(value, &value.span))
            .unwrap_or_else(|| named("BOOL", &value.span))
    }

    /// The type of a value, where something in it has one.
    pub(crate) fn strong(&self, value: &Expression) -> Option<TypeName> {
        let span = &value.span;
        match &value.kind {
            ExpressionKind::Literal(literal) => match literal {
                Literal::Boolean(_) => Some(named("BOOL", span)),
                Literal::Integer { of, .. } | Literal::Real { of, .. } => {
                    of.map(|of| named(of.name(), span))
                }
                Literal::Time { of, .. } => Some(named(of.name(), span)),
                Literal::Text { wide, .. } => Some(text(*wide, span)),
            },
            ExpressionKind::Variable(path) => self.path(path),
            ExpressionKind::Qualified(of, _) => Some(named(of.as_str(), span)),
            ExpressionKind::Not(inner) | ExpressionKind::Minus(inner) => self.strong(inner),
            ExpressionKind::Chain(first, rest) => {
                let values = rest.iter().map(|(_, value)| value);
                match rest.first().map(|(operator, _)| *operator) {
                    Some(Operator::Compare(_)) => Some(named("BOOL", span)),
                    Some(operator) => {
                        let values: Vec<&Expression> =
                            std::iter::once(&**first).chain(values).collect();
                        self.joined(&values, operator)
                    }
                    None => self.strong(first),
                }
            }
            ExpressionKind::Call(path, arguments) => self.call(path, arguments),
            ExpressionKind::Faulty => None,
        }
    }

    /// The type of operands together: the widest.
    fn joined(&self, values: &[&Expression], operator: Operator) -> Option<TypeName> {
        let types: Vec<TypeName> = values.iter().filter_map(|value| self.strong(value)).collect();
        let is =
            |of: &TypeName, word: &str| matches!(&of.kind, TypeKind::Named(name) if name.is(word));
        let moments = ["TIME_OF_DAY", "TOD", "DATE_AND_TIME", "DT", "DATE"];
        let is_moment = |of: &TypeName| moments.iter().any(|word| is(of, word));
        if operator == Operator::Subtract && types.len() == 2 && types.iter().all(is_moment) {
            return types.first().map(|of| named("TIME", &of.span));
        }
        let rank = |of: &TypeName| {
            let known = NUMBERS.iter().position(|word| is(of, word));
            // What is no number, such as a TIME times a number, stays what it is.
            known.unwrap_or(NUMBERS.len())
        };
        types.into_iter().rev().max_by_key(rank)
    }

    fn call(&self, path: &Path, arguments: &[Argument]) -> Option<TypeName> {
        let span = &path.span;
        if path.steps.is_empty()
            && let Some(found) = unit(self.file, path.root.as_str())
            && found.kind == UnitKind::Function
        {
            return Some(found.result.clone().unwrap_or_else(|| named("BOOL", span)));
        }
        let key = path.root.key();
        let values: Vec<&Expression> = arguments
            .iter()
            .filter_map(|argument| match argument {
                Argument::Placed(value) => Some(value),
                Argument::Given(name, value) if !name.is("K") && !name.is("N") => Some(value),
                _ => None,
            })
            .collect();
        if let Some((_, to)) = key.rsplit_once("TO_")
            && (key.starts_with("TO_") || key.contains("_TO_"))
        {
            return Some(match to {
                "STRING" | "WSTRING" => text(to == "WSTRING", span),
                _ => named(to, span),
            });
        }
        match key.as_str() {
            "EQ" | "NE" | "LT" | "LE" | "GT" | "GE" => Some(named("BOOL", span)),
            "LEN" | "FIND" => Some(named("INT", span)),
            "CONCAT" | "LEFT" | "RIGHT" | "MID" | "INSERT" | "DELETE" | "REPLACE" => {
                Some(text(false, span))
            }
            "TIME" | "ADD_TIME" | "SUB_TIME" | "MULTIME" | "MUL_TIME" | "DIVTIME" | "DIV_TIME"
            | "SUB_DATE_DATE" | "SUB_TOD_TOD" | "SUB_DT_DT" => Some(named("TIME", span)),
            "ADD_TOD_TIME" | "SUB_TOD_TIME" => Some(named("TOD", span)),
            "ADD_DT_TIME" | "SUB_DT_TIME" | "CONCAT_DATE_TOD" => Some(named("DT", span)),
            "SUB" => self.joined(&values, Operator::Subtract),
            "TRUNC" => Some(named("DINT", span)),
            // The first input chooses.
            "SEL" | "MUX" if values.len() == arguments.len() || key == "SEL" => {
                self.joined(values.get(1..).unwrap_or_default(), Operator::Add)
            }
            "SHL" | "SHR" | "ROL" | "ROR" | "EXPT" => {
                values.first().and_then(|value| self.strong(value))
            }
            _ => self.joined(&values, Operator::Add),
        }
    }

    fn path(&self, path: &Path) -> Option<TypeName> {
        let root = path.root.as_str();
        let mut of = if root.starts_with('%') {
            named(address(root), &path.span)
        } else {
            self.variable(&path.root)?
        };
        for step in &path.steps {
            of = match step {
                Step::Field(name) => self.field(&of, name)?,
                Step::Index(_) => match self.resolved(of).kind {
                    TypeKind::Array(_, element) | TypeKind::OpenArray(_, element) => *element,
                    _ => return None,
                },
                Step::Bits { width, .. } => {
                    let word = match width {
                        8 => "BYTE",
                        16 => "WORD",
                        32 => "DWORD",
                        _ => "BOOL",
                    };
                    named(word, &path.span)
                }
                Step::Follow => match self.resolved(of).kind {
                    TypeKind::Pointer(to) => *to,
                    _ => return None,
                },
            };
        }
        Some(of)
    }

    fn variable(&self, name: &Name) -> Option<TypeName> {
        let mut known = self.declarations.iter().chain(self.made);
        let mut known = known.by_ref().chain(&self.file.globals);
        if let Some(found) = known.find(|variable| variable.name == *name) {
            return Some(found.of.clone());
        }
        // A value of an enumeration.
        let types = self.file.types.iter();
        let mut types = types.filter(|of| match &of.of.kind {
            TypeKind::Enumeration(values, _) => values.iter().any(|(value, _)| value == name),
            _ => false,
        });
        types.next().map(|of| named(of.name.as_str(), &name.span()))
    }

    fn field(&self, of: &TypeName, name: &Name) -> Option<TypeName> {
        let of = self.resolved(of.clone());
        match of.kind {
            TypeKind::Structure(fields) => {
                fields.into_iter().find(|field| field.name == *name).map(|field| field.of)
            }
            TypeKind::Named(block) => {
                let unit = unit(self.file, block.as_str())?;
                let mut variables = unit.declarations.iter();
                let found = variables.find(|variable| variable.name == *name)?;
                Some(found.of.clone())
            }
            _ => None,
        }
    }

    /// A type behind its names.
    pub(crate) fn resolved(&self, mut of: TypeName) -> TypeName {
        for _ in 0..MAXIMUM_ALIASES {
            let TypeKind::Named(name) = &of.kind else {
                break;
            };
            let mut types = self.file.types.iter();
            match types.find(|known| known.name == *name) {
                Some(known) => of = known.of.clone(),
                None => break,
            }
        }
        of
    }
}

fn weak(value: &Expression, span: &Span) -> Option<TypeName> {
    match &value.kind {
        ExpressionKind::Literal(Literal::Integer { .. }) => Some(named("DINT", span)),
        ExpressionKind::Literal(Literal::Real { .. }) => Some(named("LREAL", span)),
        ExpressionKind::Minus(inner) | ExpressionKind::Not(inner) => weak(inner, span),
        ExpressionKind::Chain(first, rest) => {
            let values = std::iter::once(&**first).chain(rest.iter().map(|(_, value)| value));
            values.rev().find_map(|value| weak(value, span))
        }
        ExpressionKind::Call(_, arguments) => {
            let mut values = arguments.iter().filter_map(|argument| match argument {
                Argument::Placed(value) | Argument::Given(_, value) => weak(value, span),
                Argument::Taken { .. } => None,
            });
            values.next_back()
        }
        _ => None,
    }
}

fn text(wide: bool, span: &Span) -> TypeName {
    TypeName { kind: TypeKind::Text { wide, length: None }, span: span.clone() }
}

fn address(written: &str) -> &'static str {
    match written.chars().nth(2).map(|letter| letter.to_ascii_uppercase()) {
        Some('B') => "BYTE",
        Some('W') => "WORD",
        Some('D') => "DWORD",
        Some('L') => "LWORD",
        _ => "BOOL",
    }
}

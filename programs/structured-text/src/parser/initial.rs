//! Initial values.

use super::Parser;
use crate::lexer::Lexeme;
use crate::syntax::{Initializer, Literal, TypeKind, TypeName};

impl Parser<'_> {
    /// The initial value of a variable of this type. That of an array may be without its brackets: `1, 2, 3(0)`.
    pub(super) fn initial_of(&mut self, of: &TypeName) -> Option<Initializer> {
        let is_array = matches!(of.kind, TypeKind::Array(..) | TypeKind::Named(_));
        let is_bare = is_array && !self.at_sign("[");
        let start = self.span().start;
        if !is_bare || !(self.at_repetition() || matches!(self.ahead(1), Lexeme::Sign(","))) {
            let first = self.initializer()?;
            if !is_bare || !self.at_sign(",") {
                return Some(first);
            }
            self.skip();
            let mut elements = vec![(None, vec![first])];
            elements.extend(self.elements()?);
            return Some(Initializer::Array(elements, self.since(start)));
        }
        let elements = self.elements()?;
        Some(Initializer::Array(elements, self.since(start)))
    }

    /// Whether `3(` is here: so many times what is in the brackets.
    fn at_repetition(&self) -> bool {
        let is_count = matches!(self.peek(), Lexeme::Literal(literal)
            if matches!(**literal, Literal::Integer { .. }));
        is_count && *self.ahead(1) == Lexeme::Sign("(")
    }

    /// One initial value.
    pub(super) fn initializer(&mut self) -> Option<Initializer> {
        self.enter(Self::initializer_here).flatten()
    }

    fn initializer_here(&mut self) -> Option<Initializer> {
        let start = self.span().start;
        if self.take_sign("[") {
            let elements = match self.at_sign("]") {
                true => Vec::new(),
                false => self.elements()?,
            };
            if !self.need_sign("]") {
                return None;
            }
            return Some(Initializer::Array(elements, self.since(start)));
        }
        let is_structure = self.at_sign("(") && self.names_field(1)
            || self.at_word("STRUCT") && *self.ahead(1) == Lexeme::Sign("(");
        if !is_structure {
            return Some(Initializer::Value(self.expression()));
        }
        self.take_word("STRUCT");
        self.skip();
        let mut fields = Vec::new();
        while !self.at_sign(")") {
            let name = self.part_name("a field")?;
            if !self.need_sign(":=") {
                return None;
            }
            fields.push((name, self.field_value()?));
            if !self.take_sign(",") {
                break;
            }
        }
        if !self.need_sign(")") {
            return None;
        }
        Some(Initializer::Structure(fields, self.since(start)))
    }

    fn names_field(&self, ahead: usize) -> bool {
        matches!(self.ahead(ahead), Lexeme::Word(_)) && *self.ahead(ahead + 1) == Lexeme::Sign(":=")
    }

    /// The value of a field: one of an array without its brackets goes on up to the next field.
    fn field_value(&mut self) -> Option<Initializer> {
        let start = self.span().start;
        let goes_on = |parser: &Self| parser.at_sign(",") && !parser.names_field(1);
        if self.at_repetition() {
            let elements = self.elements_while(goes_on)?;
            return Some(Initializer::Array(elements, self.since(start)));
        }
        let first = self.initializer()?;
        if !goes_on(self) || *self.ahead(1) == Lexeme::Sign(")") {
            return Some(first);
        }
        self.skip();
        let mut elements = vec![(None, vec![first])];
        elements.extend(self.elements_while(goes_on)?);
        Some(Initializer::Array(elements, self.since(start)))
    }

    fn elements(&mut self) -> Option<Elements> {
        self.elements_while(|parser| parser.at_sign(","))
    }

    /// Elements with commas between them, as long as `goes_on` at one.
    fn elements_while(&mut self, goes_on: impl Fn(&Self) -> bool) -> Option<Elements> {
        let mut elements = Vec::new();
        loop {
            elements.push(self.element()?);
            if !goes_on(self) {
                return Some(elements);
            }
            self.skip();
            // Some dialects have a comma behind the last one.
            if self.at_sign("]") {
                return Some(elements);
            }
        }
    }

    fn element(&mut self) -> Option<Element> {
        if !self.at_repetition() {
            return Some((None, vec![self.initializer()?]));
        }
        let span = self.span();
        let Lexeme::Literal(count) = self.peek() else {
            return None;
        };
        let kind = crate::syntax::ExpressionKind::Literal((**count).clone());
        let count = crate::syntax::Expression { kind, span };
        self.skip();
        self.skip();
        let mut repeated = Vec::new();
        while !self.at_sign(")") {
            // What is repeated may be repeated itself, `2(3(0))`.
            if self.at_repetition() {
                let start = self.span().start;
                let inner = self.enter(Self::element).flatten()?;
                repeated.push(Initializer::Array(vec![inner], self.since(start)));
            } else {
                repeated.push(self.initializer()?);
            }
            if !self.take_sign(",") {
                break;
            }
        }
        if !self.need_sign(")") {
            return None;
        }
        Some((Some(count), repeated))
    }
}

type Element = (Option<crate::syntax::Expression>, Vec<Initializer>);
type Elements = Vec<Element>;

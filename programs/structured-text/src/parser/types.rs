//! Types.

use super::Parser;
use super::declaration::Block;
use crate::lexer::Lexeme;
use crate::syntax::{Class, Expression, Name, Retention, TypeDefinition, TypeKind, TypeName};

/// Types of which an enumeration can be.
const INTEGERS: [&str; 12] = [
    "BYTE", "WORD", "DWORD", "LWORD", "SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT",
    "ULINT",
];

impl Parser<'_> {
    /// `BOOL`, `INT (0..9)`, `ARRAY [1..3] OF REAL`, `MyType`.
    pub(super) fn type_name(&mut self) -> Option<TypeName> {
        let start = self.span().start;
        let kind = self.enter(Self::type_kind).flatten()?;
        let span = self.since(start);
        Some(TypeName { kind, span })
    }

    fn type_kind(&mut self) -> Option<TypeKind> {
        if self.at_sign("(") {
            return self.enumeration(None);
        }
        let Some(word) = self.word() else {
            return self.named();
        };
        match word.to_ascii_uppercase().as_str() {
            "STRUCT" => self.structure(),
            "UNION" if !matches!(self.ahead(1), Lexeme::Sign(_)) => {
                self.refuse("`UNION` is", self.span(), Some("use a STRUCT"));
                self.recover_to(&["END_UNION", "END_TYPE"]);
                self.take_word("END_UNION");
                None
            }
            "ARRAY" => self.array(),
            "POINTER" | "REFERENCE" if self.follows("TO") => self.pointer(2),
            "REF_TO" => self.pointer(1),
            "REF" if self.follows("TO") => self.pointer(2),
            "STRING" | "WSTRING" => self.text_type(),
            _ => self.named(),
        }
    }

    fn follows(&self, word: &str) -> bool {
        matches!(self.ahead(1), Lexeme::Word(found) if found.eq_ignore_ascii_case(word))
    }

    fn pointer(&mut self, words: usize) -> Option<TypeKind> {
        for _ in 0..words {
            self.skip();
        }
        Some(TypeKind::Pointer(Box::new(self.type_name()?)))
    }

    /// A name, and what may be in brackets behind it.
    fn named(&mut self) -> Option<TypeKind> {
        let name = self.dotted_name("a type")?;
        if !self.at_sign("(") {
            return Some(TypeKind::Named(name));
        }
        let is_of_integers = INTEGERS.iter().any(|word| name.is(word));
        let is_list = matches!(self.ahead(1), Lexeme::Word(_))
            && matches!(self.ahead(2), Lexeme::Sign(":=" | "," | ")"));
        if is_list && is_of_integers {
            return self.enumeration(Some(name));
        }
        if !is_of_integers {
            let help = "write the values behind `:=`";
            let what = format!("`{name}` with values in brackets, which a method gets, is");
            self.refuse(&what, name.span(), Some(help));
            self.arguments();
            return Some(TypeKind::Named(name));
        }
        self.skip();
        let (first, last) = self.range()?;
        self.need_sign(")");
        Some(TypeKind::Subrange(name, Box::new(first), Box::new(last)))
    }

    /// `a..b`
    fn range(&mut self) -> Option<(Expression, Expression)> {
        let first = self.deeper(Self::expression);
        if !self.need_sign("..") {
            return None;
        }
        Some((first, self.deeper(Self::expression)))
    }

    fn text_type(&mut self) -> Option<TypeKind> {
        let wide = self.at_word("WSTRING");
        self.skip();
        let closing = if self.take_sign("[") {
            "]"
        } else if self.take_sign("(") {
            ")"
        } else {
            let length = None;
            return Some(TypeKind::Text { wide, length });
        };
        let length = Some(Box::new(self.deeper(Self::expression)));
        self.need_sign(closing);
        Some(TypeKind::Text { wide, length })
    }

    fn array(&mut self) -> Option<TypeKind> {
        self.skip();
        if !self.need_sign("[") {
            return None;
        }
        let mut open = 0;
        let mut ranges = Vec::new();
        loop {
            if self.take_sign("*") {
                open += 1;
            } else {
                ranges.push(self.range()?);
            }
            if !self.take_sign(",") {
                break;
            }
        }
        if open > 0 && !ranges.is_empty() {
            let message = "the bounds of an array are all given or all left open";
            self.error("U1034", message, self.span());
        }
        self.need_sign("]");
        self.need_word("OF");
        let element = Box::new(self.type_name()?);
        Some(match open {
            0 => TypeKind::Array(ranges, element),
            open => TypeKind::OpenArray(open, element),
        })
    }

    fn structure(&mut self) -> Option<TypeKind> {
        self.skip();
        if self.at_word("OVERLAP") {
            self.refuse("`OVERLAP` is", self.span(), Some("use parts of words, such as `.%B1`"));
            self.skip();
        }
        let block = Block { class: Class::Local, constant: false, retention: Retention::Unstated };
        let mut fields = Vec::new();
        self.fields(block, &mut fields);
        self.need_word("END_STRUCT");
        Some(TypeKind::Structure(fields))
    }

    /// `(red, green := 5)`, perhaps with the type of its values behind it.
    fn enumeration(&mut self, of: Option<Name>) -> Option<TypeKind> {
        self.skip();
        let mut values = Vec::new();
        loop {
            // Some dialects have a comma behind the last one.
            if self.at_sign(")") && !values.is_empty() {
                break;
            }
            let name = self.name("a value")?;
            let value = self.take_sign(":=").then(|| self.deeper(Self::expression));
            values.push((name, value));
            if !self.take_sign(",") {
                break;
            }
        }
        if !self.need_sign(")") {
            return None;
        }
        let is_behind = of.is_none() && INTEGERS.iter().any(|word| self.at_word(word));
        let of = match is_behind {
            true => self.name("a type"),
            false => of,
        };
        Some(TypeKind::Enumeration(values, of))
    }

    /// The content between `TYPE` and `END_TYPE`.
    pub(super) fn types(&mut self, into: &mut Vec<TypeDefinition>) {
        while !self.at_word("END_TYPE") && !self.at_end() && self.unit_keyword().is_none() {
            let before = self.place;
            if self.take_sign(";") {
                continue;
            }
            match self.type_definition() {
                Some(definition) => into.push(definition),
                None => self.recover(&["END_TYPE"]),
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_word("END_TYPE");
        self.take_sign(";");
    }

    fn type_definition(&mut self) -> Option<TypeDefinition> {
        self.access_words();
        let name = self.name("a type")?;
        self.siemens_header();
        if self.at_word("EXTENDS") {
            let help = "declare the fields of the other structure in this one";
            self.refuse("structures that extend others are", self.span(), Some(help));
            self.recover_to(&["STRUCT", "END_TYPE"]);
        } else if !self.take_sign(":") && !self.at_word("STRUCT") {
            self.expected("`:`");
            return None;
        }
        self.take_sign(":");
        let of = self.type_name()?;
        let initial = match self.take_sign(":=") {
            true => Some(self.initial_of(&of)?),
            false => None,
        };
        if !self.at_word("END_TYPE") {
            self.need_semicolon(&["END_TYPE"]);
        }
        Some(TypeDefinition { name, of, initial })
    }
}

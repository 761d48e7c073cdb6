//! What Siemens SCL has of its own: quoted names, headers, data blocks.

use understudy_text::Diagnostic;

use super::Parser;
use crate::lexer::{Lexeme, Placed};
use crate::syntax::{Class, Declaration, File, Literal, Name, Retention, TypeKind, TypeName};

/// Words that begin a unit or a type, which has a quoted name in SCL.
const NAMED: [&str; 5] = ["FUNCTION", "FUNCTION_BLOCK", "ORGANIZATION_BLOCK", "DATA_BLOCK", "TYPE"];

/// Whether a text is SCL: it has a word that only SCL has, or a unit with a quoted name.
pub(super) fn is_siemens(lexemes: &[Placed]) -> bool {
    let is_any = |lexeme: &Lexeme, words: &[&str]| match lexeme {
        Lexeme::Word(found) => words.iter().any(|word| found.eq_ignore_ascii_case(word)),
        _ => false,
    };
    lexemes.windows(2).any(|pair| {
        let (first, second) = (&pair[0].lexeme, &pair[1].lexeme);
        let is_start = pair[0].starts_line;
        is_start && is_any(first, &["ORGANIZATION_BLOCK", "DATA_BLOCK"])
            || is_any(first, &NAMED) && is_wide(second)
    })
}

fn is_wide(lexeme: &Lexeme) -> bool {
    matches!(lexeme, Lexeme::Literal(literal) if matches!(**literal, Literal::Text { wide: true, .. }))
}

impl Parser<'_> {
    /// Whether a quoted word is here that can be a name: anywhere in SCL, nowhere else.
    pub(super) fn at_quoted_name(&self) -> bool {
        self.is_siemens && is_wide(self.peek())
    }

    /// `"Motor 1"` as `Motor_1`.
    pub(super) fn quoted_name(&mut self) -> Option<Name> {
        if !self.at_quoted_name() {
            return None;
        }
        let span = self.span();
        let written = self.written().trim_start_matches('#').trim_matches('"');
        let mut name: String = written
            .chars()
            .map(|next| if next.is_ascii_alphanumeric() { next } else { '_' })
            .take(crate::lexer::MAXIMUM_NAME_LENGTH)
            .collect();
        if !name.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_') {
            name.insert(0, '_');
        }
        if name != written {
            let message = format!("the name \"{written}\" is read as `{name}`");
            self.diagnostics.push(Diagnostic::warning("U1067", message, span.clone()));
        }
        self.skip();
        Some(Name::new(name, span))
    }

    /// `TITLE = …`, `VERSION : 0.1`, `AUTHOR : …` behind the name of a unit.
    pub(super) fn siemens_header(&mut self) {
        const HEADERS: [&str; 6] =
            ["TITLE", "VERSION", "AUTHOR", "FAMILY", "NAME", "KNOW_HOW_PROTECT"];
        while self.is_siemens && self.at_any(&HEADERS) {
            self.skip();
            self.skip_line();
        }
    }

    /// `DATA_BLOCK "name" … BEGIN … END_DATA_BLOCK`: a global variable.
    pub(super) fn data_block(&mut self, file: &mut File) {
        let start = self.span().start;
        let comments = self.comments();
        self.skip();
        let name = self.name("the name of a data block");
        self.siemens_header();
        let mut retention = Retention::Unstated;
        while self.retention().is_some() {
            self.take_retention(&mut retention);
            self.skip();
        }
        if retention == Retention::Unstated {
            retention = Retention::Retained;
        }
        self.siemens_header();
        let of = if self.at_any(&["STRUCT", "ARRAY"]) {
            self.type_name()
        } else if self.at_word("VAR") {
            let mut fields = Vec::new();
            self.declaration_blocks(&mut fields);
            Some(TypeName { kind: TypeKind::Structure(fields), span: self.since(start) })
        } else {
            self.type_name()
        };
        self.take_sign(";");
        if self.take_word("BEGIN") && !self.at_word("END_DATA_BLOCK") {
            let span = self.span();
            self.recover_to(&["END_DATA_BLOCK"]);
            self.read_past(
                "the current values of a data block are not kept: the start values of its declaration count",
                span,
            );
        }
        if !self.at_word("END_DATA_BLOCK") {
            self.expected("`END_DATA_BLOCK`");
            self.recover_to(&["END_DATA_BLOCK"]);
        }
        self.take_word("END_DATA_BLOCK");
        self.take_sign(";");
        if let (Some(name), Some(of)) = (name, of) {
            file.globals.push(Declaration {
                name,
                class: Class::Global,
                constant: false,
                retention,
                edge: None,
                address: None,
                of,
                initial: None,
                description: (!comments.is_empty()).then(|| comments.join(" ")),
            });
        }
    }
}

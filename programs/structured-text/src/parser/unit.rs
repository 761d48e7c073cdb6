//! Files and units: programs, function blocks, functions, methods, classes, interfaces, namespaces.

use super::Parser;
use super::statement::ENDS;
use crate::lexer::Lexeme;
use crate::syntax::{Body, Class, File, Name, Statement, TypeKind, Unit, UnitKind};

/// Words that say who may use something, which are read past.
const ACCESS: [&str; 7] =
    ["PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL", "FINAL", "ABSTRACT", "OVERRIDE"];

/// Words at which something of a file begins.
const STARTS: [&str; 15] = [
    "PROGRAM",
    "FUNCTION_BLOCK",
    "FUNCTION",
    "CLASS",
    "ORGANIZATION_BLOCK",
    "DATA_BLOCK",
    "TYPE",
    "CONFIGURATION",
    "VAR_GLOBAL",
    "VAR_CONFIG",
    "VAR_ACCESS",
    "INTERFACE",
    "NAMESPACE",
    "USING",
    "END_NAMESPACE",
];

/// Words that begin a unit, what it is, and the word that ends it.
const UNITS: [(&str, UnitKind, &str); 5] = [
    ("PROGRAM", UnitKind::Program, "END_PROGRAM"),
    ("FUNCTION_BLOCK", UnitKind::FunctionBlock, "END_FUNCTION_BLOCK"),
    ("FUNCTION", UnitKind::Function, "END_FUNCTION"),
    ("CLASS", UnitKind::FunctionBlock, "END_CLASS"),
    ("ORGANIZATION_BLOCK", UnitKind::Program, "END_ORGANIZATION_BLOCK"),
];

impl Parser<'_> {
    /// The unit that begins here, and the word that ends it.
    pub(super) fn unit_keyword(&self) -> Option<(UnitKind, &'static str)> {
        let word = self.word()?;
        let found = UNITS.iter().find(|unit| word.eq_ignore_ascii_case(unit.0));
        found.map(|(_, kind, end)| (*kind, *end))
    }

    /// A whole text.
    pub(super) fn file(&mut self) -> File {
        let mut file = File::default();
        while !self.at_end() {
            let before = self.place;
            let comments = self.comments();
            if let Some((kind, end)) = self.unit_keyword() {
                self.skip();
                file.units.extend(self.unit(kind, end, comments));
            } else if self.take_word("TYPE") {
                self.types(&mut file.types);
            } else if self.take_word("CONFIGURATION") {
                self.configuration(&mut file);
            } else if self.take_word("VAR_GLOBAL") {
                self.variables(Class::Global, &mut file.globals);
            } else if self.at_any(&["VAR_CONFIG", "VAR_ACCESS"]) {
                let span = self.access_paths();
                file.read_past.push(span);
            } else if self.at_word("INTERFACE") {
                let span = self.interface(&mut file.interfaces);
                file.read_past.push(span);
            } else if self.at_word("DATA_BLOCK") {
                self.data_block(&mut file);
            } else {
                self.rest_of_file(&mut file, comments);
            }
            if self.place == before {
                self.skip();
            }
        }
        file
    }

    /// What is not the start of a unit.
    fn rest_of_file(&mut self, file: &mut File, comments: Vec<String>) {
        if self.take_word("NAMESPACE") {
            self.take_word("INTERNAL");
            self.dotted_name("the name of a namespace");
        } else if self.take_word("USING") {
            while !self.at_sign(";") && self.dotted_name("the name of a namespace").is_some() {
                self.take_sign(",");
            }
            self.need_semicolon(&STARTS);
        } else if self.take_word("END_NAMESPACE") || self.take_sign(";") {
            self.take_sign(";");
        } else if self.at_member() {
            self.late_member(file, comments);
        } else {
            self.expected("PROGRAM, FUNCTION_BLOCK, FUNCTION, TYPE, VAR_GLOBAL or CONFIGURATION");
            self.skip();
            while !self.at_end() && !self.at_any(&STARTS) && !self.at_member() {
                self.skip();
            }
        }
    }

    /// A member behind the unit that it belongs to, or alone.
    fn late_member(&mut self, file: &mut File, comments: Vec<String>) {
        if self.headers_only && file.units.is_empty() {
            if self.at_word("METHOD") {
                self.skip();
                file.units.extend(self.method(comments));
            } else {
                self.members(&mut Vec::new());
            }
            return;
        }
        match file.units.last_mut() {
            Some(_) => {
                let mut methods = Vec::new();
                self.members(&mut methods);
                if let Some(unit) = file.units.last_mut() {
                    unit.methods.extend(methods);
                }
            }
            None => {
                self.expected("a FUNCTION_BLOCK before its members");
                self.members(&mut Vec::new());
            }
        }
    }

    pub(super) fn access_words(&mut self) {
        while self.at_any(&ACCESS) && matches!(self.ahead(1), Lexeme::Word(_)) {
            self.skip();
        }
    }

    fn unit(&mut self, kind: UnitKind, end: &'static str, comments: Vec<String>) -> Option<Unit> {
        let start = self.end();
        let mut unit = self.header(kind, comments)?;
        self.declaration_blocks(&mut unit.declarations);
        self.members(&mut unit.methods);
        self.declaration_blocks(&mut unit.declarations);
        // Of Siemens; elsewhere a variable may be called so.
        if !matches!(self.ahead(1), Lexeme::Sign(":=" | "(" | "." | "[")) {
            self.take_word("BEGIN");
        }
        if !(self.headers_only && self.at_end()) {
            unit.body = self.body(&[end]);
            while !self.at_word(end) && !self.at_end() && !self.at_start() {
                if self.at_member() {
                    self.members(&mut unit.methods);
                    continue;
                }
                self.expected(&format!("a statement or `{end}`"));
                self.skip();
                let more = self.statements(&[end]);
                if let Body::Statements(statements) = &mut unit.body {
                    statements.extend(more);
                }
            }
            // A file of TwinCAT has the header alone, a faulty one has lost its end.
            self.need_word(end);
            self.take_sign(";");
        }
        unit.span = self.since(start);
        Some(unit)
    }

    /// Whether a unit or a configuration begins here.
    fn at_start(&self) -> bool {
        self.at_any(&STARTS)
    }

    /// `name EXTENDS base IMPLEMENTS a, b : result`
    fn header(&mut self, kind: UnitKind, comments: Vec<String>) -> Option<Unit> {
        self.access_words();
        let name = self.unit_name()?;
        self.siemens_header();
        let mut extends = None;
        let mut implements = Vec::new();
        if self.take_word("EXTENDS") {
            extends = self.dotted_name("the block that is extended");
            while self.take_sign(",") {
                self.dotted_name("an interface");
            }
        }
        if self.take_word("IMPLEMENTS") {
            loop {
                implements.extend(self.dotted_name("an interface"));
                if !self.take_sign(",") {
                    break;
                }
            }
        }
        let result = if self.take_sign(":") {
            let result = self.type_name();
            result.filter(|of| !matches!(&of.kind, TypeKind::Named(name) if name.is("VOID")))
        } else {
            None
        };
        self.take_sign(";");
        self.siemens_header();
        while self.take_word("USING") {
            self.dotted_name("the name of a namespace");
            self.take_sign(";");
        }
        Some(Unit {
            kind,
            comments,
            result,
            declarations: Vec::new(),
            body: Body::default(),
            methods: Vec::new(),
            extends,
            implements,
            span: name.span(),
            name,
        })
    }

    /// The name of a unit, which may be that of a type or a standard function, as in `FUNCTION TIME : TIME`.
    fn unit_name(&mut self) -> Option<Name> {
        match self.name("the name of a unit") {
            Some(name) => Some(name),
            None => {
                self.recover_to(&STARTS);
                None
            }
        }
    }

    /// Whether a method, an action or a property begins here.
    fn at_member(&self) -> bool {
        self.at_any(&["METHOD", "ACTION", "PROPERTY"]) && matches!(self.ahead(1), Lexeme::Word(_))
    }

    /// All methods, actions and properties that are here.
    fn members(&mut self, methods: &mut Vec<Unit>) {
        while self.at_member() {
            let comments = self.comments();
            if self.at_word("PROPERTY") {
                self.property();
            } else if self.take_word("ACTION") {
                methods.extend(self.action_as_method(comments));
            } else {
                self.skip();
                methods.extend(self.method(comments));
            }
        }
    }

    fn method(&mut self, comments: Vec<String>) -> Option<Unit> {
        let start = self.end();
        let mut unit = self.header(UnitKind::Method, comments)?;
        self.declaration_blocks(&mut unit.declarations);
        if !(self.headers_only && self.at_end()) {
            unit.body = self.body(&["END_METHOD"]);
            if !self.take_word("END_METHOD") && !self.at_end() {
                self.expected("a statement or `END_METHOD`");
                self.recover_to(&ENDS);
                self.take_word("END_METHOD");
            }
            self.take_sign(";");
        }
        unit.span = self.since(start);
        Some(unit)
    }

    /// `ACTION name: … END_ACTION` of a unit that is not a chart.
    fn action_as_method(&mut self, comments: Vec<String>) -> Option<Unit> {
        let start = self.end();
        let name = self.name("the name of an action")?;
        self.take_sign(":");
        let body = self.body(&["END_ACTION"]);
        self.need_word("END_ACTION");
        self.take_sign(";");
        Some(Unit {
            kind: UnitKind::Method,
            name,
            comments,
            result: None,
            declarations: Vec::new(),
            body,
            methods: Vec::new(),
            extends: None,
            implements: Vec::new(),
            span: self.since(start),
        })
    }

    fn property(&mut self) {
        let span = self.span();
        self.skip();
        self.access_words();
        let name = self.word().unwrap_or("").to_owned();
        let help = "write two methods, one that answers with the value and one that sets it";
        self.refuse(&format!("PROPERTY `{name}` is"), span, Some(help));
        self.recover_to(&["END_PROPERTY"]);
        self.take_word("END_PROPERTY");
        self.take_sign(";");
    }

    /// Reads past an interface; answers its place.
    fn interface(&mut self, interfaces: &mut Vec<Name>) -> crate::syntax::Span {
        let start = self.span().start;
        self.skip();
        self.access_words();
        let span = self.span();
        let name = self.name("the name of an interface");
        if self.headers_only {
            while !self.at_end() {
                self.skip();
            }
        }
        self.recover_to(&["END_INTERFACE"]);
        self.take_word("END_INTERFACE");
        self.take_sign(";");
        if let Some(name) = name {
            let message = format!(
                "INTERFACE `{name}` is not checked: the methods of the blocks that implement it count"
            );
            self.read_past(message, span);
            interfaces.push(name);
        }
        self.since(start)
    }

    /// Statements up to `end`, as of an action of a chart; other bodies are refused.
    pub(super) fn action_statements(&mut self, end: &'static str) -> Vec<Statement> {
        let span = self.span();
        match self.body(&[end]) {
            Body::Statements(statements) => statements,
            Body::Chart(_) => {
                self.refuse("a chart in an action is", span, Some("write it as a function block"));
                Vec::new()
            }
            Body::Instructions(_) => {
                self.refuse("an instruction list in an action of a chart is", span, None);
                Vec::new()
            }
        }
    }
}

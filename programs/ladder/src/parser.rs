//! Lexemes to a [`Program`], with recovery: what is wrong is reported and passed over, so that one run finds everything.
//!
//! Recursive descent; every loop consumes a lexeme or ends, and brackets nest at most [`MAXIMUM_NESTING`] deep, so any text
//! is read in linear time and bounded stack. The grammar is in `docs/reference/ladder-format.md`; each function names its rule.

mod alias;
mod rung;

pub use rung::MAXIMUM_PRESET_VALUE;

use std::ops::Range;

use understudy_text::spelling::nearest;
use understudy_text::{Diagnostic, MAXIMUM_FINDINGS, has_errors};

use crate::check::check;
use crate::lexer::{Lexeme, Placed, lex};
use crate::program::{Name, Program, Rung, Signal};

/// The longest text in bytes.
pub const MAXIMUM_TEXT_BYTES: usize = 16 << 20;

/// The most rungs of a program.
pub const MAXIMUM_RUNGS: usize = 100_000;

/// How deep brackets and braces may nest.
pub const MAXIMUM_NESTING: usize = 64;

/// Reserved words; each begins a part of the program, `at` comes before an address.
pub const KEYWORDS: [&str; 7] = ["program", "input", "output", "memory", "retain", "rung", "at"];

/// Those that begin a part of the program.
const PARTS: [&str; 6] = ["program", "input", "output", "memory", "retain", "rung"];

/// What a text says.
#[derive(Debug, Clone)]
pub struct Parsed {
    /// What was understood; whole only where no diagnostic is an error.
    pub program: Program,
    /// What was found, in the order of the places.
    pub diagnostics: Vec<Diagnostic>,
}

impl Parsed {
    /// The program and the warnings, or every diagnostic where one of them is an error.
    pub fn into_result(self) -> Result<(Program, Vec<Diagnostic>), Vec<Diagnostic>> {
        if has_errors(&self.diagnostics) {
            Err(self.diagnostics)
        } else {
            Ok((self.program, self.diagnostics))
        }
    }
}

/// Reads a ladder program and checks it; finds all errors and warnings of the text in one run.
pub fn parse(text: &str) -> Parsed {
    if text.len() > MAXIMUM_TEXT_BYTES {
        let message = format!(
            "the text has {} bytes; a program has at most {MAXIMUM_TEXT_BYTES}",
            text.len()
        );
        return Parsed {
            program: Program::default(),
            diagnostics: vec![Diagnostic::error("U0112", message, 0..0)],
        };
    }
    let (lexemes, diagnostics) = lex(text);
    let mut parser = Parser { lexemes, position: 0, comments: Vec::new(), diagnostics };
    let mut program = parser.program();
    alias::resolve(&mut program);
    let mut diagnostics = parser.diagnostics;
    diagnostics.extend(check(&program));
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.start, diagnostic.span.end));
    Parsed { program, diagnostics }
}

struct Parser {
    lexemes: Vec<Placed>,
    position: usize,
    /// Comments passed and not yet given to what they belong to.
    comments: Vec<String>,
    diagnostics: Vec<Diagnostic>,
}

impl Parser {
    fn program(&mut self) -> Program {
        let mut program = Program::default();
        let mut header: Option<Range<usize>> = None;
        loop {
            self.pass_comments();
            let span = self.span();
            let Lexeme::Word(word) = self.lexeme().clone() else {
                if *self.lexeme() == Lexeme::End {
                    break;
                }
                self.pass_to_keyword();
                continue;
            };
            match word.as_str() {
                "program" => {
                    let comments = std::mem::take(&mut self.comments);
                    self.advance();
                    let name = self.name("the program's name");
                    let description = self.description();
                    if let Some(first) = &header {
                        self.diagnostics.push(
                            Diagnostic::error("U0105", "a second `program` in one text", span)
                                .with_related(first.clone(), "the first is here"),
                        );
                        continue;
                    }
                    header = Some(span);
                    program.comments = comments;
                    program.description = description;
                    program.name = name.unwrap_or_default();
                }
                "input" => program.inputs.extend(self.signal("input")),
                "output" => program.outputs.extend(self.signal("output")),
                "memory" => program.memory.extend(self.signal("memory")),
                "retain" => self.retained(&mut program.retained),
                "rung" => {
                    let rung = self.rung();
                    if program.rungs.len() == MAXIMUM_RUNGS {
                        let message = format!("a program has at most {MAXIMUM_RUNGS} rungs");
                        self.diagnostics.push(Diagnostic::error("U0115", message, span));
                        return program;
                    }
                    program.rungs.push(rung);
                }
                _ => self.pass_to_keyword(),
            }
        }
        program.footer = std::mem::take(&mut self.comments);
        if header.is_none() {
            self.diagnostics.push(
                Diagnostic::error("U0119", "the program has no name", 0..0)
                    .with_help("begin with a line such as `program press`"),
            );
        }
        program
    }

    /// Reports a lexeme where a part of the program should begin, and passes to the next part.
    fn pass_to_keyword(&mut self) {
        let span = self.span();
        if *self.lexeme() != Lexeme::Faulty {
            let mut diagnostic =
                Diagnostic::error("U0102", format!("{} does not belong here", self.found()), span)
                    .with_label(
                        "expected `program`, `input`, `output`, `memory`, `retain` or `rung`",
                    );
            if let Lexeme::Word(word) = self.lexeme()
                && let Some(keyword) = nearest(word, PARTS)
            {
                diagnostic = diagnostic.with_help(format!("did you mean `{keyword}`?"));
            }
            self.diagnostics.push(diagnostic);
        }
        self.advance();
        self.pass_line();
    }

    /// Passes to the next line or the next part, without a word: what is wrong there has been said.
    fn pass_line(&mut self) {
        while !self.at_part() && !self.placed().starts_line {
            self.advance();
        }
    }

    /// declaration = ( "input" | "output" | "memory" ), name, [ "at", address ], [ "=", ( "0" | "1" ) ];
    fn signal(&mut self, keyword: &str) -> Option<Signal> {
        let comments = std::mem::take(&mut self.comments);
        self.advance();
        let Some(name) = self.name("a name") else {
            self.pass_line();
            return None;
        };
        let mut signal = Signal { comments, ..Signal::new(name) };
        let sound = self.located(keyword, &mut signal) && self.initial(keyword, &mut signal);
        signal.description = self.description();
        let line_goes_on = !self.at_part() && !self.placed().starts_line;
        if sound && line_goes_on && *self.lexeme() != Lexeme::Faulty {
            self.unexpected("the end of the line");
        }
        self.pass_line();
        Some(signal)
    }

    /// [ "at", address ]; false where that was reported to be wrong.
    fn located(&mut self, keyword: &str, signal: &mut Signal) -> bool {
        if !self.is_word("at") {
            return true;
        }
        self.advance();
        let Lexeme::Address(address) = self.lexeme().clone() else {
            if *self.lexeme() != Lexeme::Faulty {
                self.unexpected("an address such as %IX0.0");
            }
            return false;
        };
        let area = match keyword {
            "input" => 'I',
            "output" => 'Q',
            _ => 'M',
        };
        if address.area.letter() != area {
            let message = format!("`{address}` is not an address of {keyword}");
            self.error("U0109", message, format!("expected %{area}X…"));
        }
        signal.address = Some(address);
        self.advance();
        true
    }

    /// [ "=", ( "0" | "1" ) ]; false where that was reported to be wrong.
    fn initial(&mut self, keyword: &str, signal: &mut Signal) -> bool {
        if !self.is_sign("=") {
            return true;
        }
        let start = self.span().start;
        self.advance();
        let Lexeme::Number(value @ (0 | 1)) = *self.lexeme() else {
            if *self.lexeme() != Lexeme::Faulty {
                self.unexpected("0 or 1");
            }
            return false;
        };
        if keyword == "input" {
            let message = format!("the input `{}` cannot have an initial value", signal.name);
            let span = start..self.span().end;
            self.diagnostics.push(
                Diagnostic::error("U0117", message, span)
                    .with_help("its value is sampled before every scan"),
            );
        } else {
            signal.initial = Some(value == 1);
        }
        self.advance();
        true
    }

    /// retention = "retain", name, { ",", name };
    fn retained(&mut self, retained: &mut Vec<Name>) {
        self.advance();
        loop {
            let Some(name) = self.name("the name of an output, a memory bit or a block") else {
                return self.pass_line();
            };
            retained.push(name);
            if !self.is_sign(",") {
                break;
            }
            self.advance();
            self.pass_comments();
        }
        let line_goes_on = !self.at_part() && !self.placed().starts_line;
        let is_comment = matches!(self.lexeme(), Lexeme::Comment(_));
        if line_goes_on && !is_comment && *self.lexeme() != Lexeme::Faulty {
            self.unexpected("`,` or the end of the line");
        }
        if !is_comment {
            self.pass_line();
        }
    }

    /// rung = "rung", [ text ], series, { coil };
    fn rung(&mut self) -> Rung {
        let comments = std::mem::take(&mut self.comments);
        let start = self.span();
        self.advance();
        let mut rung = Rung::default();
        self.pass_inner_comments();
        if let Lexeme::Text(title) = self.lexeme().clone() {
            rung.title = Some(title);
            self.advance();
        }
        self.body(&mut rung, start);
        rung.comments = comments;
        rung.comments.append(&mut self.comments);
        self.pass_comments();
        rung
    }

    // What every rule needs.

    fn placed(&self) -> &Placed {
        &self.lexemes[self.position]
    }

    fn lexeme(&self) -> &Lexeme {
        &self.placed().lexeme
    }

    fn span(&self) -> Range<usize> {
        self.placed().span.clone()
    }

    fn advance(&mut self) {
        if *self.lexeme() == Lexeme::End {
            return;
        }
        self.position += 1;
        if self.diagnostics.len() >= MAXIMUM_FINDINGS {
            let place = self.span().start;
            self.diagnostics.push(Diagnostic::too_many(place));
            self.position = self.lexemes.len() - 1;
        }
    }

    fn is_sign(&self, sign: &str) -> bool {
        matches!(self.lexeme(), Lexeme::Sign(found) if *found == sign)
    }

    fn is_word(&self, word: &str) -> bool {
        matches!(self.lexeme(), Lexeme::Word(found) if found == word)
    }

    /// At a word that begins a part of the program, or at the end.
    fn at_part(&self) -> bool {
        match self.lexeme() {
            Lexeme::Word(word) => PARTS.contains(&word.as_str()),
            Lexeme::End => true,
            _ => false,
        }
    }

    fn error(&mut self, code: &'static str, message: String, label: impl Into<String>) {
        let span = self.span();
        self.diagnostics.push(Diagnostic::error(code, message, span).with_label(label));
    }

    /// Reports the present lexeme and leaves it where it is.
    fn unexpected(&mut self, expected: &str) {
        let message = format!("expected {expected}, found {}", self.found());
        self.error("U0102", message, format!("expected {expected}"));
    }

    fn found(&self) -> String {
        match self.lexeme() {
            Lexeme::Word(word) if KEYWORDS.contains(&word.as_str()) => {
                format!("the reserved word `{word}`")
            }
            Lexeme::Word(word) => format!("`{word}`"),
            Lexeme::Number(number) => format!("`{number}`"),
            Lexeme::Time(time) => format!("the time {time:?}"),
            Lexeme::Address(address) => format!("the address {address}"),
            Lexeme::Text(_) => "a text in quotes".into(),
            Lexeme::Sign(sign) => format!("`{sign}`"),
            Lexeme::Comment(_) => "a comment".into(),
            Lexeme::Faulty => "something that was not understood".into(),
            Lexeme::End => "the end of the text".into(),
        }
    }

    /// A name that is not reserved; reports any other lexeme and leaves it.
    fn name(&mut self, expected: &str) -> Option<Name> {
        match self.lexeme().clone() {
            Lexeme::Word(word) if !KEYWORDS.contains(&word.as_str()) => {
                let name = Name::at(word, self.span());
                self.advance();
                Some(name)
            }
            Lexeme::Faulty => {
                self.advance();
                None
            }
            _ => {
                self.unexpected(expected);
                None
            }
        }
    }

    /// The comment behind something on its line.
    fn description(&mut self) -> Option<String> {
        match self.placed() {
            Placed { lexeme: Lexeme::Comment(comment), starts_line: false, .. } => {
                let comment = comment.clone();
                self.advance();
                Some(comment).filter(|comment| !comment.is_empty())
            }
            _ => None,
        }
    }

    fn pass_comments(&mut self) {
        while let Lexeme::Comment(comment) = self.lexeme() {
            let comment = comment.clone();
            self.comments.push(comment);
            self.advance();
        }
    }

    /// Takes the comments inside of a rung; comment lines below its last line belong to what follows and stay.
    fn pass_inner_comments(&mut self) {
        loop {
            let mut ahead = self.position;
            while matches!(self.lexemes[ahead].lexeme, Lexeme::Comment(_))
                && (self.lexemes[ahead].starts_line || ahead == self.position)
            {
                ahead += 1;
            }
            if ahead == self.position {
                return;
            }
            let ends = match &self.lexemes[ahead].lexeme {
                Lexeme::Word(word) => PARTS.contains(&word.as_str()),
                lexeme => *lexeme == Lexeme::End,
            };
            if ends && self.placed().starts_line {
                return;
            }
            let end = if ends { self.position + 1 } else { ahead };
            while self.position < end {
                if let Lexeme::Comment(comment) = self.lexeme() {
                    let comment = comment.clone();
                    self.comments.push(comment);
                }
                self.advance();
            }
        }
    }
}

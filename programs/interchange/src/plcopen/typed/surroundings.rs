//! What the surroundings of a document declare: panels and logs of Beremiz, and global variables of its extensions.

use understudy_structured_text::parser::parse_declarations_at;
use understudy_structured_text::syntax::{Class, Declaration, Span, TypeKind};
use understudy_text::Diagnostic;

use super::Typed;

/// Blocks that have no effect on what a program does: their names, their declaration, and the warning. Python has no
/// outputs here, so a program that reads its answer is refused.
const BLOCKS: [(&[&str], &str, &str); 3] = [
    (&["LOGGER", "LOGLEVEL"], LOG, "what a LOGGER writes is not kept: there is no log here"),
    (
        &["PYTHON_EVAL"],
        "FUNCTION_BLOCK PYTHON_EVAL VAR_INPUT TRIG : BOOL; CODE : STRING; END_VAR END_FUNCTION_BLOCK",
        "Python is not executed here, and so has no outputs",
    ),
    (
        &["PYTHON_POLL"],
        "FUNCTION_BLOCK PYTHON_POLL VAR_INPUT TRIG : BOOL; CODE : STRING; END_VAR END_FUNCTION_BLOCK",
        "Python is not executed here, and so has no outputs",
    ),
];

const LOG: &str = "TYPE LOGLEVEL : (CRITICAL, WARNING, INFO, DEBUG) := INFO; END_TYPE
FUNCTION_BLOCK LOGGER VAR_INPUT TRIG : BOOL; MSG : STRING; LEVEL : LOGLEVEL := LOGLEVEL#INFO; END_VAR END_FUNCTION_BLOCK";

impl Typed {
    /// Declares what a document uses and its editor provides, and says so.
    pub(super) fn surroundings(&mut self) {
        for (words, text, message) in BLOCKS {
            let units = self.file.units.iter().map(|unit| &unit.name);
            let mut names = units.chain(self.file.types.iter().map(|of| &of.name));
            if names.any(|name| words.iter().any(|word| name.is(word))) {
                continue;
            }
            if let Some(span) = words.iter().find_map(|word| self.first_use(word)) {
                let (file, _) = parse_declarations_at(text, &|_| span.clone());
                self.file.units.extend(file.units);
                self.file.types.extend(file.types);
                let found = Diagnostic::warning("U1023", message, span);
                self.diagnostics.push(found);
            }
        }
        let mut missing: Vec<Declaration> = Vec::new();
        for variable in self.variables_of_units() {
            let known = self.file.globals.iter().chain(&missing);
            let mut known = known.filter(|known| known.name == variable.name);
            if variable.class == Class::External && known.next().is_none() {
                missing.push(variable.clone());
            }
        }
        for mut variable in missing {
            let message = format!(
                "the global variable `{}` is declared outside this file: nothing else writes it here",
                variable.name
            );
            let found = Diagnostic::warning("U1023", message, variable.name.span());
            let help = "declare it in the configuration or in a resource";
            self.diagnostics.push(found.with_help(help));
            variable.class = Class::Global;
            variable.constant = false;
            self.file.globals.push(variable);
        }
    }

    fn variables_of_units(&self) -> impl Iterator<Item = &Declaration> {
        self.file.units.iter().skip(self.known).flat_map(|unit| &unit.declarations)
    }

    /// Where a variable of that type is declared first.
    fn first_use(&self, word: &str) -> Option<Span> {
        let mut variables = self.variables_of_units();
        let found = variables
            .find(|variable| matches!(&variable.of.kind, TypeKind::Named(name) if name.is(word)));
        found.map(|variable| variable.name.span())
    }
}

//! Variables, types and the configuration.

use super::super::lexer::Lexeme;
use super::super::syntax::{
    Class, Declaration, Expression, ExpressionKind, File, TypeDefinition, TypeMeaning, TypeName,
    UnitKind,
};
use super::Parser;
use understudy_ladder::{Name, PERIODS};
use understudy_text::Diagnostic;

impl Parser {
    /// The unit that begins here, and the word that ends it.
    pub(super) fn unit_keyword(&self) -> Option<(UnitKind, &'static str)> {
        [
            ("PROGRAM", UnitKind::Program, "END_PROGRAM"),
            (
                "FUNCTION_BLOCK",
                UnitKind::FunctionBlock,
                "END_FUNCTION_BLOCK",
            ),
            ("FUNCTION", UnitKind::Function, "END_FUNCTION"),
        ]
        .into_iter()
        .find(|(word, _, _)| self.at_word(word))
        .map(|(_, kind, end)| (kind, end))
    }

    /// All blocks of declarations that stand here.
    pub(super) fn declaration_blocks(&mut self, declarations: &mut Vec<Declaration>) {
        loop {
            let (class, temporary) = if self.take_word("VAR_INPUT") {
                (Class::Input, false)
            } else if self.take_word("VAR_OUTPUT") {
                (Class::Output, false)
            } else if self.take_word("VAR_IN_OUT") {
                (Class::InOut, false)
            } else if self.take_word("VAR_EXTERNAL") {
                (Class::External, false)
            } else if self.take_word("VAR_TEMP") {
                (Class::Local, true)
            } else if self.take_word("VAR") {
                (Class::Local, false)
            } else {
                return;
            };
            self.declarations(class, temporary, declarations);
        }
    }

    /// The content between `VAR…` and `END_VAR`.
    pub(super) fn declarations(
        &mut self,
        class: Class,
        temporary: bool,
        into: &mut Vec<Declaration>,
    ) {
        let mut constant = false;
        while self.at_any(&[
            "CONSTANT",
            "RETAIN",
            "NON_RETAIN",
            "PERSISTENT",
            "PUBLIC",
            "PRIVATE",
        ]) {
            constant |= self.at_word("CONSTANT");
            if self.at_any(&["RETAIN", "PERSISTENT"]) {
                let message = "what is retained over a loss of power is not kept: the state of a circuit is kept by its copies";
                self.diagnostics
                    .push(Diagnostic::warning("U1055", message, self.span()));
            }
            self.skip();
        }
        let ends = [
            "END_VAR",
            "END_PROGRAM",
            "END_FUNCTION_BLOCK",
            "END_FUNCTION",
        ];
        while !self.at_any(&ends) && *self.peek() != Lexeme::End {
            let before = self.place;
            match self.declaration(class, temporary, constant) {
                Some(found) => into.extend(found),
                None => self.recover(&ends),
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_word("END_VAR");
        self.take_sign(";");
    }

    /// `a, b AT %IX0.0 : BOOL := TRUE;`
    fn declaration(
        &mut self,
        class: Class,
        temporary: bool,
        constant: bool,
    ) -> Option<Vec<Declaration>> {
        let above = self.placed().comments.clone();
        let mut names = Vec::new();
        loop {
            // A variable may be an address alone: `AT %IX0.0 : BOOL`.
            if self.at_word("AT") && names.is_empty() {
                break;
            }
            names.push(self.name("a variable")?);
            if !self.take_sign(",") {
                break;
            }
        }
        let mut address = None;
        if self.take_word("AT") {
            let Lexeme::Address(text) = self.peek().clone() else {
                self.expected("an address such as %IX0.0");
                return None;
            };
            if names.is_empty() {
                names.push(Name::at(text.replace('.', "_"), self.span()));
            }
            address = Some(Name::at(text, self.span()));
            self.skip();
        }
        if !self.need_sign(":") {
            return None;
        }
        let type_name = self.type_name()?;
        if self.at_any(&["R_EDGE", "F_EDGE"]) {
            let message = "inputs with edge detection are not supported";
            let finding = Diagnostic::error("U1040", message, self.span());
            self.diagnostics
                .push(finding.with_help("declare an R_TRIG or F_TRIG and call it"));
            self.skip();
        }
        let initial = if self.take_sign(":=") {
            Some(self.expression())
        } else {
            None
        };
        if !self.need_sign(";") {
            return None;
        }
        let about: Vec<String> = above.into_iter().chain(self.remark()).collect();
        let description = (!about.is_empty()).then(|| about.join(" "));
        let declared = names.into_iter().map(|name| Declaration {
            name,
            class,
            constant,
            temporary,
            address: address.clone(),
            type_name: type_name.clone(),
            initial: initial.clone(),
            description: description.clone(),
        });
        Some(declared.collect())
    }

    /// `BOOL`, `INT (0..9)`, `MyType`.
    pub(super) fn type_name(&mut self) -> Option<TypeName> {
        if self.at_any(&["STRUCT", "ARRAY"]) || self.at_sign("(") {
            let message = "structures, arrays and enumerations without a name are not supported";
            self.diagnostics
                .push(Diagnostic::error("U1040", message, self.span()));
            while !self.at_sign(";")
                && !self.at_any(&["END_STRUCT", "END_VAR"])
                && *self.peek() != Lexeme::End
            {
                self.skip();
            }
            self.take_word("END_STRUCT");
            return None;
        }
        let name = self.name("a type")?;
        let mut range = None;
        if self.take_sign("(") {
            let (first, _) = (self.whole_number()?, self.need_sign(".."));
            let last = self.whole_number()?;
            if first > last {
                let message = format!("the range {first}..{last} is empty");
                self.diagnostics
                    .push(Diagnostic::error("U1036", message, name.span()));
            }
            self.need_sign(")");
            range = Some((first, last.max(first)));
        }
        Some(TypeName { name, range })
    }

    fn whole_number(&mut self) -> Option<i64> {
        let negative = self.take_sign("-");
        let Lexeme::Number(number) = *self.peek() else {
            self.expected("a whole number");
            return None;
        };
        self.skip();
        Some(if negative { -number } else { number })
    }

    /// The content between `TYPE` and `END_TYPE`.
    pub(super) fn types(&mut self, into: &mut Vec<TypeDefinition>) {
        while !self.at_word("END_TYPE")
            && *self.peek() != Lexeme::End
            && self.unit_keyword().is_none()
        {
            let before = self.place;
            if let Some(definition) = self.type_definition() {
                into.push(definition);
            } else {
                self.recover(&["END_TYPE"]);
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_word("END_TYPE");
        self.take_sign(";");
    }

    fn type_definition(&mut self) -> Option<TypeDefinition> {
        let name = self.name("a type")?;
        if !self.need_sign(":") {
            return None;
        }
        let meaning = if self.take_sign("(") {
            let mut values = Vec::new();
            loop {
                values.push(self.name("a value")?);
                if !self.take_sign(",") {
                    break;
                }
            }
            self.need_sign(")");
            TypeMeaning::Enumeration(values)
        } else {
            TypeMeaning::Alias(self.type_name()?)
        };
        self.need_sign(";");
        Some(TypeDefinition { name, meaning })
    }

    /// Of a configuration its global variables and the interval of its first task are kept.
    pub(super) fn configuration(&mut self, file: &mut File) {
        self.name("a name");
        while !self.at_word("END_CONFIGURATION") && *self.peek() != Lexeme::End {
            let span = self.span();
            if self.take_word("VAR_GLOBAL") {
                self.declarations(Class::External, false, &mut file.globals);
            } else if self.take_word("INTERVAL") {
                if self.need_sign(":=") {
                    self.interval(file);
                }
                // The rest of the task.
                self.recover(&["END_CONFIGURATION", "END_RESOURCE"]);
            } else if self.at_any(&["VAR_ACCESS", "VAR_CONFIG"]) {
                let message = "access paths and values of a configuration are not kept";
                self.diagnostics
                    .push(Diagnostic::warning("U1055", message, span));
                self.recover_to("END_VAR");
                self.take_word("END_VAR");
            } else if self.take_word("RESOURCE") || self.take_word("ON") {
                self.name("a name");
            } else if !self.at_any(&["TASK", "PROGRAM", "END_RESOURCE"]) {
                let message = "this part of the configuration is not read";
                self.diagnostics
                    .push(Diagnostic::warning("U1055", message, span));
                self.recover(&["END_CONFIGURATION", "END_RESOURCE"]);
            } else if self.take_word("END_RESOURCE") {
                self.take_sign(";");
            } else {
                // Its name and priority have no meaning here.
                while !self.take_sign(";")
                    && !self.at_any(&["END_CONFIGURATION", "END_RESOURCE", "INTERVAL"])
                    && *self.peek() != Lexeme::End
                {
                    self.skip();
                }
            }
        }
        self.need_word("END_CONFIGURATION");
        self.take_sign(";");
    }

    /// Skips to a word, which is not consumed.
    fn recover_to(&mut self, word: &str) {
        while !self.at_word(word) && *self.peek() != Lexeme::End {
            self.skip();
        }
    }

    /// The interval of a task; that of the first one counts.
    fn interval(&mut self, file: &mut File) {
        let before = self.diagnostics.len();
        let Expression { kind, span } = self.expression();
        match (kind, file.period) {
            (ExpressionKind::Time(period), None) if PERIODS.contains(&period) => {
                file.period = Some(period);
            }
            (ExpressionKind::Time(period), Some(first)) if period != first => {
                let message = format!(
                    "the interval {period:?} of a further task is not kept: the first is {first:?}"
                );
                self.diagnostics
                    .push(Diagnostic::warning("U1055", message, span));
            }
            (ExpressionKind::Time(_), Some(_)) => {}
            _ if self.diagnostics.len() > before => {}
            _ => {
                let message = format!(
                    "the interval of a task is a time from {:?} to {:?}",
                    PERIODS.start(),
                    PERIODS.end()
                );
                let finding = Diagnostic::error("U1043", message, span);
                self.diagnostics
                    .push(finding.with_help("write it as a literal such as T#20ms"));
            }
        }
    }
}

//! Configurations: tasks, instances of programs, global variables.

use understudy_text::Diagnostic;

use super::Parser;
use crate::lexer::Lexeme;
use crate::syntax::{
    Argument, Class, ExpressionKind, File, Literal, ProgramInstance, Retention, Task,
};

/// Words at which a part of a configuration begins or ends.
const PARTS: [&str; 10] = [
    "VAR_GLOBAL",
    "VAR_ACCESS",
    "VAR_CONFIG",
    "RESOURCE",
    "TASK",
    "PROGRAM",
    "END_RESOURCE",
    "END_CONFIGURATION",
    "FUNCTION_BLOCK",
    "CONFIGURATION",
];

impl Parser<'_> {
    /// The content of a configuration, behind its word.
    pub(super) fn configuration(&mut self, file: &mut File) {
        self.name("the name of a configuration");
        while !self.at_word("END_CONFIGURATION") && !self.at_end() {
            let before = self.place;
            if self.take_word("VAR_GLOBAL") {
                self.variables(Class::Global, &mut file.globals);
            } else if self.at_any(&["VAR_ACCESS", "VAR_CONFIG"]) {
                let span = self.access_paths();
                file.read_past.push(span);
            } else if self.take_word("RESOURCE") {
                self.name("the name of a resource");
                if self.take_word("ON") {
                    self.name("the type of a resource");
                }
            } else if self.take_word("TASK") {
                file.tasks.extend(self.task());
            } else if self.take_word("PROGRAM") {
                file.instances.extend(self.instance());
            } else if self.take_word("END_RESOURCE") {
                self.take_sign(";");
            } else if self.at_any(&["FUNCTION_BLOCK", "FUNCTION", "TYPE", "CONFIGURATION"]) {
                break;
            } else if !self.take_sign(";") {
                self.expected("TASK, PROGRAM, RESOURCE, VAR_GLOBAL or END_CONFIGURATION");
                self.recover(&PARTS);
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_word("END_CONFIGURATION");
        self.take_sign(";");
    }

    /// `name (SINGLE := a, INTERVAL := T#10ms, PRIORITY := 1);`
    fn task(&mut self) -> Option<Task> {
        let mut task = Task {
            name: self.name("the name of a task")?,
            interval: None,
            priority: None,
            single: None,
        };
        if self.take_sign("(") {
            while !self.at_sign(")") && !self.at_sign(";") && !self.at_end() {
                if self.take_word("INTERVAL") {
                    self.need_sign(":=");
                    task.interval = self.interval();
                } else if self.take_word("PRIORITY") {
                    self.need_sign(":=");
                    task.priority = self.whole_number();
                } else if self.take_word("SINGLE") {
                    self.need_sign(":=");
                    task.single = Some(self.expression());
                } else {
                    self.expected("INTERVAL, PRIORITY or SINGLE");
                    self.skip();
                }
                if !self.take_sign(",") {
                    break;
                }
            }
            self.need_sign(")");
        }
        self.need_semicolon(&PARTS);
        Some(task)
    }

    fn interval(&mut self) -> Option<i64> {
        let before = self.diagnostics.len();
        let found = self.expression();
        match found.kind {
            ExpressionKind::Literal(Literal::Time { nanoseconds, .. }) if nanoseconds >= 0 => {
                Some(nanoseconds)
            }
            _ if self.diagnostics.len() > before
                || matches!(found.kind, ExpressionKind::Faulty) =>
            {
                None
            }
            _ => {
                let message = "the interval of a task is a positive duration";
                let finding = Diagnostic::error("U1043", message, found.span);
                let help = "write it as a literal such as T#20ms";
                self.diagnostics.push(finding.with_help(help));
                None
            }
        }
    }

    /// `name WITH task : type (in := a, q => b);`
    fn instance(&mut self) -> Option<ProgramInstance> {
        let mut retention = Retention::Unstated;
        if let Some(found) = self.retention()
            && matches!(self.ahead(1), Lexeme::Word(_))
        {
            retention = found;
            self.skip();
        }
        let name = self.name("the name of a program")?;
        let task = match self.take_word("WITH") {
            true => Some(self.name("a task")?),
            false => None,
        };
        if !self.need_sign(":") {
            self.recover(&PARTS);
            return None;
        }
        let of = self.dotted_name("the type of a program")?;
        let connections = match self.at_sign("(") {
            true => self.connections(),
            false => Vec::new(),
        };
        self.need_semicolon(&PARTS);
        Some(ProgramInstance { name, retention, task, of, connections })
    }

    /// What a program is connected to. The tasks of its blocks are read past.
    fn connections(&mut self) -> Vec<Argument> {
        let has_tasks = (0..)
            .map(|ahead| self.ahead(ahead))
            .take_while(|next| !matches!(next, Lexeme::Sign(";") | Lexeme::End))
            .any(|next| matches!(next, Lexeme::Word(word) if word.eq_ignore_ascii_case("WITH")));
        if !has_tasks {
            return self.arguments();
        }
        let span = self.span();
        self.read_past(
            "tasks of blocks of a program are not kept: blocks are executed where the program calls them",
            span,
        );
        let mut connections = Vec::new();
        self.skip();
        while !self.at_sign(")") && !self.at_sign(";") && !self.at_end() {
            let is_task =
                matches!(self.ahead(1), Lexeme::Word(word) if word.eq_ignore_ascii_case("WITH"));
            if is_task {
                self.skip();
                self.skip();
                self.name("a task");
            } else {
                connections.extend(self.argument());
            }
            if !self.take_sign(",") {
                break;
            }
        }
        self.need_sign(")");
        connections
    }
}

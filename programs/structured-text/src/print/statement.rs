//! Statements.

use super::Printer;
use super::expression::{expression, list, path};
use crate::syntax::{Label, Statement, StatementKind};

impl Printer {
    pub(super) fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            self.comments(&statement.comments);
            self.place(&statement.span);
            self.statement(&statement.kind);
        }
    }

    fn block(&mut self, statements: &[Statement]) {
        self.within(|printer| printer.statements(statements));
    }

    fn statement(&mut self, kind: &StatementKind) {
        match kind {
            StatementKind::Assign(to, value) => {
                self.line(&format!("{} := {};", path(to), expression(value)));
            }
            StatementKind::Call(called, arguments) => {
                self.line(&format!("{}({});", path(called), list(arguments)));
            }
            StatementKind::If(branches, otherwise) => {
                for (index, (condition, body)) in branches.iter().enumerate() {
                    let word = if index == 0 { "IF" } else { "ELSIF" };
                    self.line(&format!("{word} {} THEN", expression(condition)));
                    self.block(body);
                }
                if !otherwise.is_empty() {
                    self.line("ELSE");
                    self.block(otherwise);
                }
                self.line("END_IF;");
            }
            StatementKind::Case(selector, branches, otherwise) => {
                self.line(&format!("CASE {} OF", expression(selector)));
                self.within(|printer| {
                    for (labels, body) in branches {
                        let labels: Vec<String> = labels.iter().map(label).collect();
                        printer.line(&format!("{}:", labels.join(", ")));
                        match body.is_empty() {
                            // A branch is not empty in the standard.
                            true => printer.within(|printer| printer.line(";")),
                            false => printer.block(body),
                        }
                    }
                });
                if !otherwise.is_empty() {
                    self.line("ELSE");
                    self.block(otherwise);
                }
                self.line("END_CASE;");
            }
            StatementKind::For(found) => {
                let by = found.by.as_ref();
                let by = by.map(|by| format!(" BY {}", expression(by)));
                self.line(&format!(
                    "FOR {} := {} TO {}{} DO",
                    path(&found.counter),
                    expression(&found.from),
                    expression(&found.to),
                    by.unwrap_or_default()
                ));
                self.block(&found.body);
                self.line("END_FOR;");
            }
            StatementKind::While(condition, body) => {
                self.line(&format!("WHILE {} DO", expression(condition)));
                self.block(body);
                self.line("END_WHILE;");
            }
            StatementKind::Repeat(body, condition) => {
                self.line("REPEAT");
                self.block(body);
                self.line(&format!("UNTIL {}", expression(condition)));
                self.line("END_REPEAT;");
            }
            StatementKind::Exit => self.line("EXIT;"),
            StatementKind::Continue => self.line("CONTINUE;"),
            StatementKind::Return => self.line("RETURN;"),
            StatementKind::Code(code) => self.line(code),
            StatementKind::Nothing => self.line(";"),
        }
    }
}

fn label(label: &Label) -> String {
    match &label.last {
        Some(last) => format!("{}..{}", expression(&label.first), expression(last)),
        None => expression(&label.first),
    }
}

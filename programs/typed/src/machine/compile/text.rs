//! Texts are evaluated into working texts beside the row.

use super::Compiler;
use crate::form::{Expression, ExpressionKind, Place};
use crate::machine::instruction::{Code, TextApplication, TextSource};
use crate::operation::{Operation, TextOperation};
use crate::types::Type;

impl Compiler<'_> {
    /// A working text with the value of an expression.
    pub(super) fn text(&mut self, expression: &Expression) -> u32 {
        let text = self.new_text();
        self.scope(|compiler| compiler.text_into(expression, text));
        text
    }

    fn text_into(&mut self, expression: &Expression, to: u32) {
        match &expression.kind {
            ExpressionKind::Text(text) => {
                self.tables.texts.push(text.clone());
                let constant = self.tables.texts.len() as u32 - 1;
                self.emit(Code::TextConstant, to, constant, 0);
            }
            ExpressionKind::Load(place) => {
                let address = self.address(place);
                self.emit(Code::TextLoad, to, address, capacity(place));
            }
            ExpressionKind::Apply(Operation::Text(operation), operands) => {
                self.apply_to_texts(*operation, operands, TextSource::Text(to));
            }
            ExpressionKind::Choose(parts) => {
                let [condition, first, second] = &**parts;
                let (otherwise, end) = (self.label(), self.label());
                self.scope(|compiler| compiler.condition(condition, otherwise, false));
                self.scope(|compiler| compiler.text_into(first, to));
                self.jump(Code::Jump, 0, 0, end);
                self.place_label(otherwise);
                self.scope(|compiler| compiler.text_into(second, to));
                self.place_label(end);
            }
            ExpressionKind::Call(call) => {
                let own = self.call(call);
                if let Some(place) = &call.result {
                    let address = self.in_routine(own, |compiler| compiler.address(place));
                    self.emit(Code::TextLoad, to, address, capacity(place));
                }
            }
            other => panic!("{other:?} is no text"),
        }
    }

    /// An operation on texts, whose result goes to `target`.
    pub(super) fn apply_to_texts(
        &mut self,
        operation: TextOperation,
        operands: &[Expression],
        target: TextSource,
    ) {
        let mut sources = Vec::with_capacity(operands.len());
        for (index, operand) in operands.iter().enumerate() {
            sources.push(match operand.of {
                Type::Text(_) => TextSource::Text(self.text(operand)),
                _ => TextSource::Number(self.operand_before(operand, &operands[index + 1..])),
            });
        }
        self.tables.text_applications.push(TextApplication {
            operation,
            operands: sources.into(),
            target,
        });
        let table = self.tables.text_applications.len() as u32 - 1;
        self.emit(Code::TextApply, table, 0, 0);
    }
}

/// Bytes that a text has at most.
pub(super) fn capacity(place: &Place) -> u32 {
    match place.of {
        Type::Text(capacity) => u32::from(capacity),
        _ => 0,
    }
}

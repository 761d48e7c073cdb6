//! Numbers in rungs that are not of the schema: a preset of a timer counts scans, and ET and CV go into variables of any type,
//! which nothing may read.

use std::collections::HashSet;
use std::ops::Range;

use understudy_ladder::{BlockKind, Name as Written};
use understudy_structured_text::syntax::{
    Class, Declaration, Expression, ExpressionKind, Initializer, Literal, TypeKind,
};
use understudy_typed::Elementary;

use super::Network;
use crate::plcopen::document::Graph;
use crate::plcopen::plan::{Action, Call, Plan};
use crate::plcopen::power::Power;
use crate::written::USUAL_PERIOD;

/// What becomes of the numbers of a unit.
#[derive(Debug, Default)]
pub(super) struct Numbers {
    /// Presets of timers are numbers of scans.
    count_scans: bool,
    /// Nothing reads them: they are left out. In capitals.
    unread: HashSet<String>,
    /// In capitals.
    written: HashSet<String>,
}

impl Network<'_> {
    /// Finds the numbers of the only graph of a unit.
    pub(super) fn find_numbers(&mut self, graph: &Graph, plan: &Plan) {
        if !graph.has_rungs() {
            return;
        }
        let (mut read, mut written) = (HashSet::new(), HashSet::new());
        for step in &plan.steps {
            for power in step.action.powers() {
                power.visit(&mut |part| {
                    if let Power::Read(reading) = part {
                        let is_end = |letter: char| !letter.is_alphanumeric() && letter != '_';
                        read.extend(reading.text.to_uppercase().split(is_end).map(str::to_owned));
                    }
                });
            }
            if let Action::Write { targets, .. } = &step.action {
                written.extend(targets.iter().map(|(target, _)| target.to_uppercase()));
            }
        }
        let numbers = self.declarations.iter().filter(|known| is_own_number(known));
        let unread = numbers.filter(|known| !read.contains(&known.name.key()));
        let unread: Vec<&Declaration> = unread.collect();
        for known in &unread {
            let message = format!("the number `{}`, which nothing reads, is not kept", known.name);
            self.notes.push((message, known.name.span()));
        }
        let unread = unread.into_iter().map(|known| known.name.key()).collect();
        self.numbers = Numbers { count_scans: true, unread, written };
    }

    /// Whether a variable is one of the numbers that nothing reads.
    pub(in crate::plcopen::typed) fn is_unread(&self, key: &str) -> bool {
        self.numbers.unread.contains(key)
    }

    /// The time of a preset that counts scans.
    pub(super) fn preset_in_scans(
        &mut self,
        call: &Call,
        pin: &Written,
        power: &Power,
    ) -> Option<Expression> {
        let is_timer = BlockKind::of_word(&call.type_name)?.preset_time().is_some();
        let Power::Read(read) = power else {
            return None;
        };
        if !self.numbers.count_scans || !is_timer || !pin.eq_ignore_ascii_case("PT") {
            return None;
        }
        let known = self.declarations.iter().find(|known| known.name.is(&read.text))?;
        let Some(Initializer::Value(Expression { kind, .. })) = &known.initial else {
            return None;
        };
        let ExpressionKind::Literal(Literal::Integer { value, .. }) = kind else {
            return None;
        };
        if !is_own_number(known) || self.numbers.written.contains(&known.name.key()) {
            return None;
        }
        let period = self.period();
        let nanoseconds = i64::try_from(value.checked_mul(i128::from(period))?).ok()?;
        let message =
            format!("the type of the preset `{}`, which counts scans, is not kept", known.name);
        self.notes.push((message, read.text.span()));
        Some(time(nanoseconds, &read.text.span()))
    }

    /// Nanoseconds from one scan to the next.
    fn period(&self) -> i64 {
        let usual = i64::try_from(USUAL_PERIOD.as_nanos()).unwrap_or(i64::MAX);
        self.file.tasks.iter().find_map(|task| task.interval).unwrap_or(usual)
    }
}

fn time(nanoseconds: i64, span: &Range<usize>) -> Expression {
    let kind = ExpressionKind::Literal(Literal::Time { nanoseconds, of: Elementary::Time });
    Expression { kind, span: span.clone() }
}

/// A variable of the unit alone, with a whole number or a time.
fn is_own_number(known: &Declaration) -> bool {
    const WORDS: [&str; 9] =
        ["SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "TIME"];
    known.class == Class::Local
        && known.address.is_none()
        && matches!(&known.of.kind, TypeKind::Named(name) if WORDS.contains(&name.key().as_str()))
}

//! Statements.

use std::collections::BTreeMap;

use understudy_text::Diagnostic;
use understudy_typed::{
    Branch, Case, Comparison, Elementary, Expression, ExpressionKind as Kind, For, Operation,
    Place, Statement, StatementKind, Type,
};

use crate::lexer::code_refused;
use crate::syntax::{self, ExpressionKind, Label, Span};

use super::Lowering;
use super::convert::{as_integer, is_whole, limits};
use super::fold::{apply, convert, reinterpret};
use super::names::number;
use super::numbers::{Number, Operand};
use super::places::{Target, insert, load};
use super::ranges::ranges;
use super::standard_blocks::CYCLE;

/// Labels of a CASE: the last value and the place by the first value.
type Labels = BTreeMap<i64, (i64, Span)>;

impl Lowering<'_> {
    pub(super) fn statements(
        &mut self,
        statements: &[syntax::Statement],
        body: &mut Vec<Statement>,
    ) {
        for statement in statements {
            self.statement(statement, body);
        }
    }

    fn block_of(&mut self, statements: &[syntax::Statement]) -> Vec<Statement> {
        let mut body = Vec::with_capacity(statements.len());
        self.statements(statements, &mut body);
        body
    }

    fn statement(&mut self, statement: &syntax::Statement, body: &mut Vec<Statement>) {
        let line = self.line(&statement.span);
        if let Some(kind) = self.statement_kind(statement, line, body) {
            body.push(Statement { line, kind });
        }
    }

    fn statement_kind(
        &mut self,
        statement: &syntax::Statement,
        line: u32,
        body: &mut Vec<Statement>,
    ) -> Option<StatementKind> {
        use syntax::StatementKind as S;
        match &statement.kind {
            S::Assign(path, value) => {
                if let ExpressionKind::Call(callee, arguments) = &value.kind
                    && self.has_enable(callee, arguments)
                {
                    self.enabled_assignment(path, value, line, body);
                    return None;
                }
                self.assign(path, value)
            }
            S::Call(path, arguments) => {
                self.call_statement(path, arguments, &statement.span, line, body);
                None
            }
            S::If(branches, otherwise) => {
                let mut lowered = Vec::with_capacity(branches.len());
                let mut ends = Vec::with_capacity(branches.len());
                for (condition, statements) in branches {
                    let condition = self.condition(condition);
                    let mut rest = self.facts.clone();
                    if let Some(condition) = &condition {
                        self.facts.refine(condition, true);
                        rest.refine(condition, false);
                    }
                    let body = self.block_of(statements);
                    ends.push(std::mem::replace(&mut self.facts, rest));
                    if let Some(condition) = condition {
                        lowered.push(Branch { condition, body });
                    }
                }
                let otherwise = self.block_of(otherwise);
                ends.iter().for_each(|end| self.facts.join(end));
                Some(StatementKind::If(lowered, otherwise))
            }
            S::Case(selector, cases, otherwise) => self.case(selector, cases, otherwise),
            S::For(written) => self.counted(written),
            S::While(condition, statements) => {
                self.facts.forget();
                let condition = self.condition(condition);
                if let Some(condition) = &condition {
                    self.facts.refine(condition, true);
                }
                let body = self.looped(statements);
                Some(StatementKind::While(condition?, body))
            }
            S::Repeat(statements, condition) => {
                self.facts.forget();
                let body = self.looped(statements);
                Some(StatementKind::Repeat(body, self.condition(condition)?))
            }
            S::Exit => self.in_loop("EXIT", &statement.span, StatementKind::Exit),
            S::Continue => self.in_loop("CONTINUE", &statement.span, StatementKind::Continue),
            S::Return => Some(StatementKind::Return),
            S::Code(_) => {
                self.report(code_refused(statement.span.clone()));
                None
            }
            S::Nothing => None,
        }
    }

    fn in_loop(&mut self, word: &str, span: &Span, kind: StatementKind) -> Option<StatementKind> {
        if self.scope.loops > 0 {
            return Some(kind);
        }
        let message = format!("{word} stands in no loop");
        let help = "remove it, or write RETURN";
        self.error_with("U1035", message, span.clone(), help);
        None
    }

    fn looped(&mut self, statements: &[syntax::Statement]) -> Vec<Statement> {
        self.scope.loops += 1;
        let body = self.block_of(statements);
        self.scope.loops -= 1;
        self.facts.forget();
        body
    }

    pub(super) fn assign(
        &mut self,
        path: &syntax::Path,
        value: &syntax::Expression,
    ) -> Option<StatementKind> {
        if let Some(syntax::Step::Field(name)) = path.steps.last() {
            self.sets_cycle |= name.is(CYCLE);
        }
        let target = self.target(path);
        let writable = match &target {
            Some(target) => self.writable(target, path),
            None => None,
        };
        let hint = target.as_ref().map(Target::of);
        let operand = match &hint {
            Some(of) => self.operand_for(value, of),
            None => self.operand(value, None),
        };
        let span = value.span.clone();
        let value = self.coerce(operand, &hint?, &span)?;
        writable?;
        self.has_no_references(&value.of, &path.span)?;
        self.store(target?, value, &span)
    }

    /// A block whose VAR_IN_OUT stand for variables cannot be copied.
    fn has_no_references(&mut self, of: &Type, span: &Span) -> Option<()> {
        let Type::Structure(id, _) = of else {
            return Some(());
        };
        let fields = &self.program.structures[id.0 as usize].fields;
        if fields.iter().any(|field| field.is_reference) {
            let message = "a block with VAR_IN_OUT cannot be assigned";
            self.error_with("U1040", message, span.clone(), "assign its parts");
            return None;
        }
        Some(())
    }

    /// Writes a value of the target's type.
    pub(super) fn store(
        &mut self,
        target: Target,
        value: Expression,
        span: &Span,
    ) -> Option<StatementKind> {
        let value = match target.bits {
            Some((part, at)) => {
                let old = load(target.place.clone());
                insert(old, value, part, at)
            }
            None => value,
        };
        self.within(&value, &target.place, span)?;
        self.facts.stored(&target.place, &value);
        Some(StatementKind::Assign(target.place, value))
    }

    fn case(
        &mut self,
        selector: &syntax::Expression,
        cases: &[(Vec<Label>, Vec<syntax::Statement>)],
        otherwise: &[syntax::Statement],
    ) -> Option<StatementKind> {
        let value = self.typed(selector, None);
        let of = value.as_ref().map(|value| value.of.clone());
        let elementary = of.as_ref().and_then(Type::elementary);
        let elementary = elementary.filter(|of| is_whole(*of));
        if let (Some(of), None) = (&of, elementary) {
            let found = self.describe(of);
            let message =
                format!("CASE needs a whole number or an enumeration, and this is {found}");
            let help = "use IF … ELSIF";
            self.error_with("U1043", message, selector.span.clone(), help);
        }
        let mut lowered = Vec::with_capacity(cases.len());
        let mut known = Labels::default();
        let before = self.facts.clone();
        let mut known_at_ends = Vec::with_capacity(cases.len());
        for (labels, statements) in cases {
            let mut ranges = Vec::with_capacity(labels.len());
            for label in labels {
                let range = of.as_ref().zip(elementary);
                let range = range.and_then(|(of, elementary)| self.label(label, of, elementary));
                if let Some(range) = range {
                    self.told_before(&mut known, range, &label.first.span);
                    ranges.push(range);
                }
            }
            self.facts.clone_from(&before);
            let ends = ranges.iter().map(|(first, last)| (i128::from(*first), i128::from(*last)));
            let ends = ends.reduce(|one, other| (one.0.min(other.0), one.1.max(other.1)));
            if let Some((value, ends)) = value.as_ref().zip(ends) {
                self.facts.is_in(value, ends);
            }
            let body = self.block_of(statements);
            known_at_ends.push(self.facts.clone());
            lowered.push(Case { ranges, body });
        }
        self.facts = before;
        let otherwise = self.block_of(otherwise);
        known_at_ends.iter().for_each(|end| self.facts.join(end));
        elementary?;
        let mut value = value?;
        if let Some(of) = elementary.filter(|of| of.is_bit_string()) {
            value = reinterpret(value, as_integer(of));
        }
        Some(StatementKind::Case(value, lowered, otherwise))
    }

    /// Warns where a label of CASE has a value that one before it has.
    fn told_before(&mut self, known: &mut Labels, (first, last): (i64, i64), span: &Span) {
        let before = known.range(..=last).next_back();
        let Some((_, (_, place))) = before.filter(|(_, (end, _))| *end >= first) else {
            known.insert(first, (last, span.clone()));
            return;
        };
        let value = match first == last {
            true => format!("the value {first}"),
            false => format!("a value of {first}..{last}"),
        };
        let message = format!("an earlier label of this CASE has {value}");
        let found = Diagnostic::warning("U1036", message, span.clone())
            .with_related(place.clone(), "the first one counts")
            .with_help("give each value one label");
        if !self.in_library() {
            self.report(found);
        }
    }

    fn label(&mut self, label: &Label, of: &Type, elementary: Elementary) -> Option<(i64, i64)> {
        let first = self.label_value(&label.first, of);
        let last = match &label.last {
            Some(last) => self.label_value(last, of),
            None => first,
        };
        let (first, last) = (first?, last?);
        if first > last {
            let message = format!("the range {first}..{last} is empty");
            let span = label.first.span.clone();
            self.error_with("U1036", message, span, "write the lower value first");
            return None;
        }
        let (least, most) = limits(elementary);
        if last < least || first > most {
            let message = format!("{elementary} never has the value {first}");
            let span = label.first.span.clone();
            let help = format!("{elementary} is {least} to {most}");
            self.warn("U1080", message, span, help);
            return None;
        }
        let clamp = |value: i128| i64::try_from(value).unwrap_or(i64::MAX);
        Some((clamp(first.max(least)), clamp(last.min(most))))
    }

    fn label_value(&mut self, value: &syntax::Expression, of: &Type) -> Option<i128> {
        let operand = self.operand(value, Some(of));
        let found = match operand {
            Operand::Faulty => return None,
            Operand::Number(Number::Integer(value)) => return Some(value),
            Operand::Number(_) => None,
            Operand::Typed(value) | Operand::Wide(value, _) => {
                match (&value.kind, value.of.elementary()) {
                    (understudy_typed::ExpressionKind::Constant(stored), Some(of))
                        if is_whole(of) =>
                    {
                        Some(of.signed(*stored))
                    }
                    _ => None,
                }
            }
        };
        if found.is_none() {
            let message =
                "a value of CASE is a whole number that is known when the program is read";
            let help = "write a literal, a constant or a value of the enumeration";
            self.error_with("U1082", message, value.span.clone(), help);
        }
        found
    }

    fn counted(&mut self, written: &syntax::For) -> Option<StatementKind> {
        let target = self.target(&written.counter);
        let of = target.as_ref().map(Target::of);
        let elementary = of.as_ref().and_then(Type::elementary);
        let elementary = elementary.filter(|of| is_whole(*of));
        let Some((target, of)) = target.zip(elementary) else {
            if let Some(of) = of {
                let found = self.describe(&of);
                let message = format!("FOR counts with a whole number, and this is {found}");
                let span = written.counter.span.clone();
                self.error_with("U1043", message, span, "use an INT or DINT");
            }
            self.looped(&written.body);
            return None;
        };
        let writable = self.writable(&target, &written.counter);
        if target.bits.is_some() {
            let message = "FOR counts with a whole variable";
            self.error("U1043", message, written.counter.span.clone());
            return None;
        }
        let counter = as_integer(of);
        let wanted = Type::Elementary(of);
        let whole = Place { of: wanted, ..target.place.clone() };
        let from = self.stored_at(&written.from, &whole);
        let to = self.bound(&written.to, counter);
        let (to, passes) = to.map_or((None, None), |(to, passes)| (Some(to), passes));
        let passes = self.repeated(passes, &target.place, (&written.to, counter));
        let to = to.filter(|to| self.within(to, &target.place, &written.to.span).is_some());
        let by = match &written.by {
            Some(by) => self.bound(by, counter).map(|(by, _)| by),
            None => Some(number(Type::Elementary(counter), 1)),
        };
        self.facts.forget();
        if let (Some(from), Some(to)) = (&from, &to) {
            let (from, to) = (ranges(from, Some(&self.facts)), ranges(to, Some(&self.facts)));
            let turns = from.possible.hull(to.possible).ends();
            self.facts.is_in(&load(target.place.clone()), turns);
        }
        let statements = self.looped(&written.body);
        let (from, to, by) = (from?, to?, by?);
        writable?;
        // A bit string counts as the unsigned number of its width, which is stored alike.
        let mut place = target.place;
        place.of = Type::Elementary(counter);
        let from = reinterpret(from, counter);
        let no_turn = StatementKind::Assign(place.clone(), from.clone());
        let turns =
            StatementKind::For(Box::new(For { counter: place, from, to, by, body: statements }));
        let Some(condition) = passes else {
            return Some(turns);
        };
        // An end below 0, which no unsigned counter has, makes no turn.
        let line = self.line(&written.counter.span);
        let statement = |kind| Statement { line, kind };
        let branch = Branch { condition, body: vec![statement(turns)] };
        Some(StatementKind::If(vec![branch], vec![statement(no_turn)]))
    }

    /// The condition of a loop, where it can be evaluated once more than it is written: it calls nothing, and the counter does not change it. Warns
    /// otherwise.
    fn repeated(
        &mut self,
        condition: Option<Expression>,
        counter: &Place,
        (written, of): (&syntax::Expression, Elementary),
    ) -> Option<Expression> {
        let condition = condition?;
        if is_repeatable(&condition, counter) {
            return Some(condition);
        }
        let message = format!("an end below 0 of a FOR with a counter of type {of} counts as 0");
        let help = "count with an INT or DINT";
        self.warn("U1080", message, written.span.clone(), help);
        None
    }

    /// A bound or a step, which may be of a wider type than the counter: then it is limited to it. Where it can be below 0 and the counter cannot, with
    /// the condition that it is not.
    fn bound(
        &mut self,
        written: &syntax::Expression,
        counter: Elementary,
    ) -> Option<(Expression, Option<Expression>)> {
        let wanted = Type::Elementary(counter);
        let operand = self.operand(written, Some(&wanted));
        let from = match &operand {
            Operand::Typed(value) | Operand::Wide(value, _) => value.of.elementary(),
            Operand::Number(_) | Operand::Faulty => None,
        };
        let from = from.filter(|of| is_whole(*of)).map(as_integer);
        match (from, operand) {
            (Some(from), Operand::Typed(value) | Operand::Wide(value, _)) => {
                let ((least, most), (low, high)) = (limits(counter), limits(from));
                let mut value = reinterpret(value, from);
                let constant =
                    |limit: i128| number(Type::Elementary(from), limit as u64 & from.mask());
                let possible = ranges(&value, Some(&self.facts)).possible.ends();
                let is_positive = (low < 0 && least == 0 && possible.0 < 0).then(|| {
                    let operands = vec![value.clone(), constant(0)];
                    let of = Type::Elementary(Elementary::Bool);
                    let compare = Operation::Compare(Comparison::GreaterOrEqual, from);
                    apply(compare, operands, of)
                });
                if high > most {
                    value = apply(
                        Operation::Minimum(from),
                        vec![value, constant(most)],
                        Type::Elementary(from),
                    );
                }
                if low < least {
                    value = apply(
                        Operation::Maximum(from),
                        vec![value, constant(least.max(low))],
                        Type::Elementary(from),
                    );
                }
                Some((convert(value, counter), is_positive))
            }
            (_, operand) => Some((self.coerce(operand, &wanted, &written.span)?, None)),
        }
    }
}

/// Whether an expression calls nothing and does not read what a loop counts with.
fn is_repeatable(expression: &Expression, counter: &Place) -> bool {
    match &expression.kind {
        Kind::Constant(_) => true,
        Kind::Load(place) => place.indices.is_empty() && place.root != counter.root,
        Kind::Apply(_, operands) => operands.iter().all(|operand| is_repeatable(operand, counter)),
        _ => false,
    }
}

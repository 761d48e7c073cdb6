//! Sequential function charts in text: steps, transitions, actions.

use super::Parser;
use crate::lexer::Lexeme;
use crate::syntax::{
    Action, Association, Body, Chart, ChartStep, Expression, ExpressionKind, Name, Transition,
};

/// Qualifiers of actions.
const QUALIFIERS: [&str; 12] = ["N", "R", "S", "L", "D", "P", "P0", "P1", "SD", "DS", "SL", "NC"];

/// Words at which a part of a chart begins.
const PARTS: [&str; 4] = ["INITIAL_STEP", "STEP", "TRANSITION", "ACTION"];

impl Parser<'_> {
    /// Whether the body that begins here is a chart.
    pub(super) fn at_chart(&self) -> bool {
        let follows_name = matches!(self.ahead(1), Lexeme::Word(_));
        self.at_word("INITIAL_STEP")
            || self.at_word("STEP") && follows_name && *self.ahead(2) == Lexeme::Sign(":")
            || self.at_word("TRANSITION") && (follows_name || *self.ahead(1) == Lexeme::Sign("("))
    }

    /// Whether a part of a chart begins here.
    fn at_part(&self) -> bool {
        self.at_chart() || self.at_word("ACTION") && matches!(self.ahead(1), Lexeme::Word(_))
    }

    pub(super) fn chart(&mut self) -> Chart {
        let mut chart = Chart::default();
        while self.at_part() {
            if self.take_word("TRANSITION") {
                chart.transitions.extend(self.transition());
            } else if self.take_word("ACTION") {
                chart.actions.extend(self.action());
            } else {
                let is_initial = self.at_word("INITIAL_STEP");
                self.skip();
                chart.steps.extend(self.step(is_initial));
            }
            self.take_sign(";");
        }
        chart
    }

    fn step(&mut self, is_initial: bool) -> Option<ChartStep> {
        let name = self.name("the name of a step")?;
        self.need_sign(":");
        let mut associations = Vec::new();
        while !self.at_word("END_STEP") && !self.at_end() && !self.at_part() {
            let before = self.place;
            match self.association() {
                Some(association) => {
                    associations.push(association);
                    if !self.at_word("END_STEP") {
                        self.need_semicolon(&["END_STEP"]);
                    }
                }
                None => self.recover(&["END_STEP"]),
            }
            if self.place == before {
                self.skip();
            }
        }
        self.need_word("END_STEP");
        Some(ChartStep { name, is_initial, associations })
    }

    /// `action(L, T#3s, indicator)`
    fn association(&mut self) -> Option<Association> {
        let action = self.name("an action")?;
        let mut association = Association {
            qualifier: Name::new("N", action.span()),
            action,
            duration: None,
            indicators: Vec::new(),
        };
        if !self.take_sign("(") {
            return Some(association);
        }
        let qualifier = self.word().filter(|word| {
            let is_known = QUALIFIERS.iter().any(|known| known.eq_ignore_ascii_case(word));
            is_known && matches!(self.ahead(1), Lexeme::Sign("," | ")"))
        });
        if let Some(qualifier) = qualifier {
            association.qualifier = Name::new(qualifier.to_ascii_uppercase(), self.span());
            self.skip();
            let is_timed = qualifier.contains(['L', 'l', 'D', 'd']);
            if is_timed && self.take_sign(",") {
                association.duration = Some(self.expression());
            }
            self.take_sign(",");
        }
        while !self.at_sign(")") && !self.at_sign(";") && !self.at_end() {
            let span = self.span();
            let Some(path) = self.path() else { break };
            self.read_past("the indicator variable of an action is not kept", span);
            association.indicators.push(path.root);
            if !self.take_sign(",") {
                break;
            }
        }
        self.need_sign(")");
        Some(association)
    }

    /// `name (PRIORITY := 1) FROM a TO (b, c) := condition; END_TRANSITION`
    fn transition(&mut self) -> Option<Transition> {
        let start = self.end();
        let name = match self.word() {
            Some(word) if !word.eq_ignore_ascii_case("FROM") => self.name("a name"),
            _ => None,
        };
        let mut priority = None;
        if self.take_sign("(") {
            self.need_word("PRIORITY");
            self.need_sign(":=");
            priority = self.whole_number();
            self.need_sign(")");
        }
        self.need_word("FROM");
        let from = self.step_names();
        self.need_word("TO");
        let to = self.step_names();
        let condition = if self.take_sign(":=") {
            let condition = self.expression();
            self.take_sign(";");
            condition
        } else {
            self.need_sign(":");
            self.condition_of_instructions()
        };
        if !self.at_word("END_TRANSITION") {
            self.expected("`END_TRANSITION`");
            self.recover_to(&["END_TRANSITION", "INITIAL_STEP", "STEP", "TRANSITION"]);
        }
        self.take_word("END_TRANSITION");
        Some(Transition { name, priority, from, to, condition, span: self.since(start) })
    }

    /// A condition in an instruction list.
    fn condition_of_instructions(&mut self) -> Expression {
        let span = self.span();
        if matches!(self.body(&["END_TRANSITION"]), Body::Instructions(_) | Body::Statements(_)) {
            let help = "write the condition behind `:=`, such as `:= a AND NOT b;`";
            self.refuse("conditions in other languages are", span.clone(), Some(help));
        }
        let kind = ExpressionKind::Faulty;
        Expression { kind, span }
    }

    /// `a` or `(a, b)`
    fn step_names(&mut self) -> Vec<Name> {
        let mut names = Vec::new();
        if !self.take_sign("(") {
            names.extend(self.name("a step"));
            return names;
        }
        loop {
            names.extend(self.name("a step"));
            if !self.take_sign(",") {
                break;
            }
        }
        self.need_sign(")");
        names
    }

    fn action(&mut self) -> Option<Action> {
        let name = self.name("the name of an action")?;
        self.take_sign(":");
        let body = self.action_statements("END_ACTION");
        if !self.at_word("END_ACTION") {
            self.expected("a statement or `END_ACTION`");
            self.recover_to(&["END_ACTION", PARTS[0], PARTS[1], PARTS[2]]);
        }
        self.take_word("END_ACTION");
        Some(Action { name, body })
    }
}

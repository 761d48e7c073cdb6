//! The inside of a rung: series, branches, blocks and coils.

use std::ops::Range;
use std::time::Duration;

use understudy_text::Diagnostic;
use understudy_text::spelling::nearest;

use super::{MAXIMUM_NESTING, Parser};
use crate::lexer::Lexeme;
use crate::program::{
    Block, BlockKind, Coil, CoilKind, Comparison, Contact, ContactKind, Element, Feed, Name,
    Relation, Rung, Series,
};

/// The largest counter preset, that of IEC 61131-3's INT.
pub const MAXIMUM_PRESET_VALUE: u16 = 32_767;

impl Parser {
    /// rung = "rung", [ text ], series, { coil }; from the series on.
    pub(super) fn body(&mut self, rung: &mut Rung, start: Range<usize>) {
        rung.network = self.series(0);
        let mut coils = 0;
        while self.is_sign("(") {
            coils += 1;
            rung.coils.extend(self.coil());
            self.pass_inner_comments();
            let place = self.span();
            let behind = self.series(0);
            if !behind.is_empty() {
                self.diagnostics.push(
                    Diagnostic::error("U0118", "an element follows a coil", place)
                        .with_help("coils come last; begin a new rung for what follows"),
                );
            }
        }
        let has_block = crate::program::visit_any(&rung.network, |element| {
            matches!(element, Element::Block(_))
        });
        if coils == 0 && !has_block {
            self.diagnostics.push(
                Diagnostic::error("U0116", "the rung has no coil", start)
                    .with_help("end it with a coil such as ( motor )"),
            );
        }
    }

    /// series = { element }; ends before what can only follow a series.
    fn series(&mut self, depth: usize) -> Series {
        let mut series = Vec::new();
        loop {
            self.pass_inner_comments();
            if self.at_part() || self.is_sign("(") || matches!(self.lexeme(), Lexeme::Comment(_)) {
                return series;
            }
            if depth > 0 && (self.is_sign("|") || self.is_sign("]")) {
                return series;
            }
            self.element(depth, &mut series);
        }
    }

    /// element = contact | comparison | branches | block; consumes at least one lexeme.
    fn element(&mut self, depth: usize, series: &mut Series) {
        match self.lexeme().clone() {
            Lexeme::Word(word) if word != "at" => series.extend(self.contact()),
            Lexeme::Sign("/" | "+" | "-") => series.extend(self.contact()),
            Lexeme::Sign("[" | "{") if depth == MAXIMUM_NESTING => {
                let message = format!("brackets nest deeper than {MAXIMUM_NESTING}");
                self.error("U0113", message, "too deep");
                self.pass_brackets();
            }
            Lexeme::Sign("[") => self.branches(depth + 1, series),
            Lexeme::Sign("{") => series.extend(self.block(depth + 1).map(Element::Block)),
            Lexeme::Sign(sign @ ("]" | "}" | ")")) => {
                let message = format!("`{sign}` closes nothing");
                self.error("U0102", message, "nothing was opened");
                self.advance();
            }
            Lexeme::Sign("|") => {
                self.error("U0102", "`|` outside of brackets".into(), "expected an element");
                self.advance();
            }
            Lexeme::Faulty => self.advance(),
            _ => {
                self.unexpected("a contact, a branch, a block or a coil");
                self.advance();
            }
        }
    }

    /// contact = [ "/" | "+" | "-" ], operand; comparison = counter, ( ".CV" | ".ACC" ), relation, number;
    fn contact(&mut self) -> Option<Element> {
        let kind = match self.lexeme() {
            Lexeme::Sign("/") => ContactKind::NormallyClosed,
            Lexeme::Sign("+") => ContactKind::Rising,
            Lexeme::Sign("-") => ContactKind::Falling,
            _ => ContactKind::NormallyOpen,
        };
        let start = self.span();
        if kind != ContactKind::NormallyOpen {
            self.advance();
        }
        let operand = self.name("the name of a signal")?;
        let relation = match self.lexeme() {
            Lexeme::Sign(sign) => Relation::of_sign(sign),
            _ => None,
        };
        let Some(relation) = relation else {
            return Some(Element::Contact(Contact { kind, operand }));
        };
        self.advance();
        let value = match *self.lexeme() {
            Lexeme::Number(number) => {
                let value = self.counter_value(number);
                self.advance();
                value?
            }
            Lexeme::Faulty => {
                self.advance();
                return None;
            }
            _ => {
                self.unexpected("a number");
                return None;
            }
        };
        if kind != ContactKind::NormallyOpen {
            self.diagnostics.push(
                Diagnostic::error("U0111", "a comparison takes no sign", start)
                    .with_help("write the opposite relation, or put it into a memory bit"),
            );
            return None;
        }
        let Some(counter) = operand.strip_suffix(".CV").or_else(|| operand.strip_suffix(".ACC"))
        else {
            self.diagnostics.push(
                Diagnostic::error(
                    "U0111",
                    format!("`{operand}` cannot be compared with a number"),
                    operand.span(),
                )
                .with_help("only the value of a counter can, such as parts.CV >= 5"),
            );
            return None;
        };
        Some(Element::Comparison(Comparison {
            counter: Name::at(counter, operand.span()),
            relation,
            value,
        }))
    }

    fn counter_value(&mut self, number: u64) -> Option<u16> {
        let value = u16::try_from(number).ok().filter(|value| *value <= MAXIMUM_PRESET_VALUE);
        if value.is_none() {
            let message = format!("{number} is more than a counter can hold");
            self.error("U0110", message, format!("at most {MAXIMUM_PRESET_VALUE}"));
        }
        value
    }

    /// branches = "[", series, { "|", series }, "]"; a single series counts as standing without brackets.
    fn branches(&mut self, depth: usize, series: &mut Series) {
        let opened = self.span();
        self.advance();
        let mut branches = Vec::new();
        loop {
            let place = self.span();
            let branch = self.series(depth);
            if !branch.is_empty() {
                branches.push(branch);
            } else if self.is_sign("|") || self.is_sign("]") {
                self.diagnostics.push(
                    Diagnostic::error("U0118", "a branch is empty", place.start..self.span().end)
                        .with_label("expected a contact")
                        .with_help(
                            "a wire in parallel with other branches makes them idle; remove them",
                        ),
                );
            }
            if !self.is_sign("|") {
                break;
            }
            self.advance();
        }
        self.close("]", opened);
        match branches.len() {
            0 => {}
            1 => series.append(&mut branches.remove(0)),
            _ => series.push(Element::Branches(branches)),
        }
    }

    /// block = "{", kind, name, [ preset ], { pin, "=", ( contact | branches ) }, "}";
    fn block(&mut self, depth: usize) -> Option<Block> {
        let opened = self.span();
        self.advance();
        self.pass_inner_comments();
        let block = self.block_head().map(|(kind, name)| {
            let mut pins = Vec::new();
            while let Some(feed) = self.feed(depth) {
                pins.push(feed);
            }
            Block { name, kind, pins }
        });
        if block.is_none() {
            while !self.at_part() && !self.is_sign("}") && !self.is_sign("(") {
                self.advance();
            }
        }
        self.close("}", opened);
        block
    }

    fn block_head(&mut self) -> Option<(BlockKind, Name)> {
        let word = match self.lexeme().clone() {
            Lexeme::Word(word) => word,
            Lexeme::Faulty => return None,
            _ => {
                self.unexpected("a block such as TON");
                return None;
            }
        };
        let Some(kind) = BlockKind::of_word(&word) else {
            let span = self.span();
            let diagnostic =
                Diagnostic::error("U0104", format!("no block is called `{word}`"), span)
                    .with_label("expected TON, TOF, TP, CTU, CTD, CTUD, SR, RS, R_TRIG or F_TRIG");
            let upper = word.to_uppercase();
            self.diagnostics.push(match nearest(&upper, BlockKind::ALL.map(BlockKind::word)) {
                Some(near) => diagnostic.with_help(format!("did you mean `{near}`?")),
                None => diagnostic,
            });
            return None;
        };
        self.advance();
        self.pass_inner_comments();
        let name = self.name("the block's name")?;
        self.pass_inner_comments();
        let kind = match (kind.preset_time(), kind.preset_value()) {
            (Some(_), _) => kind.with_time(self.preset_time()),
            (_, Some(_)) => kind.with_value(self.preset_value()),
            (None, None) => kind,
        };
        Some((kind, name))
    }

    /// The preset, or 0 where it was reported to be wrong, so that the block is known all the same.
    fn preset_time(&mut self) -> Duration {
        match *self.lexeme() {
            Lexeme::Time(time) => {
                self.advance();
                return time;
            }
            Lexeme::Faulty => self.advance(),
            Lexeme::Number(_) => {
                self.unexpected("a preset time such as 300ms");
                self.advance();
            }
            _ => self.unexpected("a preset time such as 300ms"),
        }
        Duration::ZERO
    }

    /// The preset, or 0 where it was reported to be wrong, so that the block is known all the same.
    fn preset_value(&mut self) -> u16 {
        match *self.lexeme() {
            Lexeme::Number(number) => {
                let value = self.counter_value(number);
                self.advance();
                return value.unwrap_or(0);
            }
            Lexeme::Faulty => self.advance(),
            Lexeme::Time(_) => {
                self.unexpected("a preset value such as 5");
                self.advance();
            }
            _ => self.unexpected("a preset value such as 5"),
        }
        0
    }

    /// pin, "=", ( contact | comparison | branches ); `None` where no pin follows.
    fn feed(&mut self, depth: usize) -> Option<Feed> {
        loop {
            self.pass_inner_comments();
            match self.lexeme() {
                Lexeme::Word(_) if !self.at_part() => break,
                Lexeme::Sign("}" | "(") | Lexeme::End => return None,
                _ if self.at_part() || matches!(self.lexeme(), Lexeme::Comment(_)) => return None,
                Lexeme::Faulty => self.advance(),
                _ => {
                    self.unexpected("an input of the block or `}`");
                    self.advance();
                }
            }
        }
        let pin = self.name("an input of the block")?;
        self.pass_inner_comments();
        if self.is_sign("=") {
            self.advance();
        } else {
            self.unexpected("`=` and what feeds the input");
        }
        self.pass_inner_comments();
        let mut network = Vec::new();
        // Where nothing follows, the check of the program says so.
        if !self.is_sign("}") && !self.is_sign("(") && !self.at_part() {
            self.element(depth, &mut network);
        }
        Some(Feed { pin, network })
    }

    /// coil = "(", [ "/" | "+" | "-" | "S" | "R" ], name, ")";
    fn coil(&mut self) -> Option<Coil> {
        let opened = self.span();
        self.advance();
        let ahead = self.lexemes.get(self.position + 1);
        let letter = ahead.is_some_and(|ahead| matches!(ahead.lexeme, Lexeme::Word(_)));
        let kind = match self.lexeme() {
            Lexeme::Sign("/") => CoilKind::Negated,
            Lexeme::Sign("+") => CoilKind::Rising,
            Lexeme::Sign("-") => CoilKind::Falling,
            Lexeme::Word(word) if letter && word.eq_ignore_ascii_case("S") => CoilKind::Set,
            Lexeme::Word(word) if letter && word.eq_ignore_ascii_case("R") => CoilKind::Reset,
            _ => CoilKind::Plain,
        };
        if kind != CoilKind::Plain {
            self.advance();
        }
        let target = self.name("the name of an output or a memory bit");
        if target.is_none() {
            while !self.at_part() && !self.placed().starts_line && !self.is_sign(")") {
                self.advance();
            }
            if self.is_sign(")") {
                self.advance();
            }
            return None;
        }
        self.close(")", opened);
        target.map(|target| Coil { kind, target })
    }

    fn close(&mut self, sign: &str, opened: Range<usize>) {
        self.pass_inner_comments();
        if self.is_sign(sign) {
            self.advance();
            return;
        }
        let span = self.span();
        let message = format!("expected `{sign}`, found {}", self.found());
        self.diagnostics.push(
            Diagnostic::error("U0102", message, span)
                .with_label(format!("expected `{sign}`"))
                .with_related(opened, "opened here"),
        );
    }

    /// Passes an opening bracket and everything up to the one that closes it.
    fn pass_brackets(&mut self) {
        let mut open = 0_usize;
        while !self.at_part() {
            match self.lexeme() {
                Lexeme::Sign("[" | "{") => open += 1,
                Lexeme::Sign("]" | "}") => open -= 1,
                _ => {}
            }
            self.advance();
            if open == 0 {
                return;
            }
        }
    }
}

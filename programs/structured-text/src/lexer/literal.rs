//! Numbers, texts, and literals with their type in front.

use understudy_typed::Elementary;

use super::moment::{self, Moment};
use super::{Lexeme, Lexer, is_word_start};
use crate::syntax::Literal;

fn literal<'a>(literal: Literal) -> Lexeme<'a> {
    Lexeme::Literal(Box::new(literal))
}

/// The type that is written in front of a number; Siemens has short words for those of bits.
fn type_of(word: &str) -> Option<Elementary> {
    let short = [
        ("B", Elementary::Byte),
        ("W", Elementary::Word),
        ("DW", Elementary::Dword),
        ("LW", Elementary::Lword),
        ("L", Elementary::Dint),
    ];
    let short = short.iter().find(|(name, _)| word.eq_ignore_ascii_case(name));
    let named = || {
        let all = Elementary::ALL.into_iter();
        let mut plain = all.filter(|of| !of.is_time());
        plain.find(|of| of.name().eq_ignore_ascii_case(word))
    };
    short.map(|(_, of)| *of).or_else(named)
}

impl<'a> Lexer<'a> {
    /// A literal with its type in front: `T#3s`, `BOOL#TRUE`, `INT#16#FF`, `Colour#red`.
    pub(super) fn typed(&mut self, word: &'a str, start: usize) -> Lexeme<'a> {
        self.place += 1;
        if let Some(kind) = moment::kind(word) {
            return self.moment(kind, start);
        }
        let next = self.rest().chars().next().unwrap_or(' ');
        let is_number = next.is_ascii_digit() || matches!(next, '+' | '-');
        match type_of(word) {
            Some(Elementary::Bool) => return self.boolean(start),
            Some(of) if is_number && of.is_real() => return self.typed_real(of, start),
            Some(of) if is_number => return self.typed_integer(of, start),
            _ => {}
        }
        let is = |other: &str| word.eq_ignore_ascii_case(other);
        if matches!(next, '\'' | '"') && (is("STRING") || is("WSTRING")) {
            return self.quoted(next, self.place);
        }
        if is_word_start(next) {
            return match self.plain_word() {
                Lexeme::Word(_) => Lexeme::Qualified(self.since(start)),
                faulty => faulty,
            };
        }
        self.take_while(|next| next.is_alphanumeric() || "_#.+-:".contains(next));
        let text = self.since(start);
        if is("S5T") || is("S5TIME") || is("P") || is("CHAR") || is("WCHAR") {
            let message = format!("literals such as `{text}` are not supported");
            return self.error("U1040", message, start);
        }
        let message = format!("invalid literal `{text}`: expected a type, `#` and a value of it");
        self.error("U1032", message, start)
    }

    fn boolean(&mut self, start: usize) -> Lexeme<'a> {
        let text =
            self.take_while(|next| next.is_ascii_alphanumeric() || next == '#' || next == '_');
        match text.to_ascii_uppercase().as_str() {
            "TRUE" | "1" | "2#1" | "16#1" => literal(Literal::Boolean(true)),
            "FALSE" | "0" | "2#0" | "16#0" => literal(Literal::Boolean(false)),
            _ => {
                let message = format!("`{text}` is neither TRUE nor FALSE");
                self.error("U1032", message, start)
            }
        }
    }

    fn typed_real(&mut self, of: Elementary, start: usize) -> Lexeme<'a> {
        let value = self.place;
        let signed = self.rest().starts_with(['+', '-']);
        self.place += usize::from(signed);
        let text = match self.decimal() {
            Some(text) => text,
            None => self.take_while(|next| next.is_ascii_digit() || next == '_').replace('_', ""),
        };
        self.no_tail(start).unwrap_or_else(|| {
            let sign = if self.text[value..].starts_with('-') { "-" } else { "" };
            literal(Literal::Real { text: format!("{sign}{text}"), of: Some(of) })
        })
    }

    fn typed_integer(&mut self, of: Elementary, start: usize) -> Lexeme<'a> {
        let negative = self.rest().starts_with('-');
        self.place += usize::from(negative || self.rest().starts_with('+'));
        let (mut value, based) = match self.whole() {
            Some(found) => found,
            None => return self.no_whole_number(start),
        };
        if let Some(faulty) = self.no_tail(start) {
            return faulty;
        }
        if negative {
            value = -value;
        }
        let mask = i128::from(of.mask());
        let (least, most) = match of.is_signed() {
            true => (-(mask / 2) - 1, mask / 2),
            false => (0, mask),
        };
        // The bits of a negative number are often written in base 16.
        if based && of.is_signed() && value > most && value <= mask {
            value -= mask + 1;
        }
        if value < least || value > most {
            let text = self.since(start);
            let message = format!("`{text}` is not in the range of {of}: {least} to {most}");
            return self.error("U1032", message, start);
        }
        literal(Literal::Integer { value, of: Some(of), based })
    }

    /// A number without a type.
    pub(super) fn number(&mut self, start: usize) -> Lexeme<'a> {
        if let Some(text) = self.decimal() {
            let real = literal(Literal::Real { text, of: None });
            return self.no_tail(start).unwrap_or(real);
        }
        match self.whole() {
            Some((value, based)) => {
                let whole = literal(Literal::Integer { value, of: None, based });
                self.no_tail(start).unwrap_or(whole)
            }
            None => self.no_whole_number(start),
        }
    }

    fn no_whole_number(&mut self, start: usize) -> Lexeme<'a> {
        self.take_while(|next| next.is_alphanumeric() || next == '_' || next == '#');
        let text = self.since(start);
        let most = u64::MAX;
        let message = format!("invalid number `{text}`: expected a whole number up to {most}");
        self.error("U1032", message, start)
    }

    /// A number that runs into letters.
    fn no_tail(&mut self, start: usize) -> Option<Lexeme<'a>> {
        if !self.rest().starts_with(is_word_start) {
            return None;
        }
        self.take_while(|next| next.is_alphanumeric() || next == '_');
        let text = self.since(start);
        Some(self.error("U1032", format!("invalid number `{text}`"), start))
    }

    /// A number with a point or an exponent, without its `_`. Takes nothing where it has neither.
    fn decimal(&mut self) -> Option<String> {
        let start = self.place;
        let belongs = |next: char| next.is_ascii_digit() || next == '_';
        self.take_while(belongs);
        let mut behind = self.rest().chars();
        let (first, second) = (behind.next(), behind.next());
        let is_digit = |next: Option<char>| next.is_some_and(|next| next.is_ascii_digit());
        let mut has_point = false;
        // `1.` is 1.0 in some dialects; `1..2` is a range.
        let point_alone = |next: Option<char>| {
            next.is_none_or(|next| next != '.' && next != '%' && !is_word_start(next))
        };
        if first == Some('.') && (is_digit(second) || point_alone(second)) {
            self.place += 1;
            self.take_while(belongs);
            has_point = true;
        }
        let mut text = self.since(start).replace('_', "");
        if text.ends_with('.') {
            text.push('0');
        }
        let mut behind = self.rest().chars();
        let has_exponent = matches!(behind.next(), Some('e' | 'E'))
            && match behind.next() {
                Some('+' | '-') => is_digit(behind.next()),
                next => is_digit(next),
            };
        if has_exponent {
            let exponent = self.place;
            self.place += 2;
            self.take_while(belongs);
            text.push_str(&self.since(exponent).replace('_', ""));
        }
        if has_point || has_exponent {
            return Some(text);
        }
        self.place = start;
        None
    }

    /// A whole number without its sign, and whether it has a base in front.
    fn whole(&mut self) -> Option<(i128, bool)> {
        let belongs = |next: char| next.is_ascii_digit() || next == '_';
        let digits = self.take_while(belongs).replace('_', "");
        let (digits, base) = if self.rest().starts_with('#') {
            let base = digits.parse().ok();
            let base = base.filter(|base| matches!(base, 2 | 8 | 16))?;
            self.place += 1;
            let digits = self.take_while(|next| next.is_ascii_hexdigit() || next == '_');
            (digits.replace('_', ""), base)
        } else {
            (digits, 10)
        };
        let value = u64::from_str_radix(&digits, base).ok()?;
        Some((i128::from(value), base != 10))
    }

    fn moment(&mut self, kind: Moment, start: usize) -> Lexeme<'a> {
        let value = self.place;
        let length = moment::length(kind, self.rest());
        self.place += length;
        self.take_while(|next| next.is_alphanumeric() || next == '_');
        let text = self.since(value);
        match moment::nanoseconds(kind, text) {
            Ok(nanoseconds) => literal(Literal::Time { nanoseconds, of: kind.elementary() }),
            Err(expected) => {
                let what = kind.elementary().name();
                let message = format!("invalid {what} `{text}`: expected {expected}");
                self.error("U1032", message, start)
            }
        }
    }

    /// A text in quotes, with its `$` sequences resolved.
    pub(super) fn quoted(&mut self, quote: char, start: usize) -> Lexeme<'a> {
        self.place = start + 1;
        let wide = quote == '"';
        let mut bytes = Vec::new();
        let mut fault = None;
        loop {
            let Some(character) = self.rest().chars().next().filter(|next| *next != '\n') else {
                return self.error("U1031", "a text does not end on its line".into(), start);
            };
            let place = self.place;
            self.place += character.len_utf8();
            if character == quote {
                break;
            }
            let code = match character {
                '$' => self.escape(wide),
                other => Some(u32::from(other)),
            };
            match code.map(u8::try_from) {
                Some(Ok(byte)) => bytes.push(byte),
                Some(Err(_)) => fault = fault.or(Some((place, false))),
                None => fault = fault.or(Some((place, true))),
            }
        }
        let Some((place, is_escape)) = fault else {
            return literal(Literal::Text { bytes, wide });
        };
        let end = std::mem::replace(&mut self.place, place);
        let shown: String = self.rest().chars().take(if is_escape { 3 } else { 1 }).collect();
        self.place += shown.len().min(end - place);
        let faulty = if is_escape {
            let message = format!(
                "invalid sequence `{}` in a text: expected `$$`, `$'`, `$\"`, `$L`, `$N`, `$P`, `$R`, `$T` or `$0A`",
                shown.escape_debug()
            );
            self.error("U1032", message, place)
        } else {
            let message = format!("`{shown}` in a text is not a character of Latin-1");
            self.error("U1040", message, place)
        };
        self.place = end;
        faulty
    }

    /// What follows a `$` stands for.
    fn escape(&mut self, wide: bool) -> Option<u32> {
        let next = self.rest().chars().next()?;
        let code = match next {
            '$' | '\'' | '"' => u32::from(next),
            'l' | 'L' | 'n' | 'N' => 0x0A,
            'p' | 'P' => 0x0C,
            'r' | 'R' => 0x0D,
            't' | 'T' => 0x09,
            _ => {
                let length = if wide { 4 } else { 2 };
                let digits = self.rest().get(..length)?;
                if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
                    return None;
                }
                self.place += length;
                return u32::from_str_radix(digits, 16).ok();
            }
        };
        self.place += 1;
        Some(code)
    }
}

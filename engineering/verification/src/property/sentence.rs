//! Sentences that mean formulas.
//!
//! | sentence | formula |
//! |---|---|
//! | `never p and q` | `AG !(p & q)` |
//! | `always p` | `AG p` |
//! | `p only while q` | `AG (p -> q)` |
//! | `p is followed by q` | `AG (p -> AF q)` |
//! | `p is followed by q within 5 scans` | `AG (p -> ABF 0..5 q)` |
//! | `within 2s of p: q` | `AG (p -> ABF 0..n q)`, with the whole scans in 2 s |
//! | `p stays until q` | `AG (p -> !E[!q U (!p & !q)])` |
//! | `p can be reached` | `EF p` |
//! | `p can always be reached` | `AG EF p` |
//!
//! p and q are signals or formulas of one scan, such as `a & !b`.

use super::lexer::Sign;
use super::parse::{Parser, Read};
use super::{Formula, Path};

impl Parser<'_, '_> {
    /// A sentence; none without consuming anything if the words do not form one.
    pub(super) fn sentence(&mut self) -> Option<Option<Read>> {
        if self.takes_word("never") {
            return Some(self.never());
        }
        if self.takes_word("always") {
            return Some(self.formula().map(Formula::always));
        }
        if self.takes_word("within") {
            return Some(self.within());
        }
        let words = [
            "is followed by",
            "only while",
            "stays until",
            "can be reached",
            "can always be reached",
        ];
        words.iter().any(|words| self.has_words(words)).then(|| self.relation())
    }

    fn never(&mut self) -> Option<Read> {
        let mut all = self.formula()?;
        while self.takes_word("and") {
            all = all.and(self.formula()?);
        }
        self.takes_word("together");
        Some(all.negated().always())
    }

    fn within(&mut self) -> Option<Read> {
        let scans = self.scans()?;
        if !self.takes_word("of") {
            return self.wrong("`of`");
        }
        let first = self.formula()?;
        if !self.takes(Sign::Colon) {
            return self.wrong("`:`");
        }
        let answer = Box::new(self.formula()?);
        Some(first.implies(Formula::Within(Path::All, scans, answer)).always())
    }

    fn relation(&mut self) -> Option<Read> {
        let first = self.formula()?;
        if self.takes_words("can be reached") {
            return Some(first.reachable());
        }
        if self.takes_words("can always be reached") {
            return Some(first.reachable().always());
        }
        if self.takes_words("only while") {
            return Some(first.implies(self.formula()?).always());
        }
        if self.takes_words("stays until") {
            let end = self.formula()?;
            let lost = first.clone().negated().and(end.clone().negated());
            let not_yet = Box::new(end.negated());
            let lost_before = Formula::Until(Path::Some, not_yet, Box::new(lost));
            return Some(first.implies(lost_before.negated()).always());
        }
        if !self.takes_words("is followed by") {
            return self.wrong(
                "`is followed by`, `only while`, `stays until`, `can be reached` or `can always be reached`",
            );
        }
        let answer = Box::new(self.formula()?);
        let answered = if self.takes_word("within") {
            Formula::Within(Path::All, self.scans()?, answer)
        } else {
            Formula::Eventually(Path::All, answer)
        };
        Some(first.implies(answered).always())
    }
}
